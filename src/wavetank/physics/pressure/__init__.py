"""Pressure of the whole tank, on a grid."""
