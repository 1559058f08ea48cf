"""Shapes as data, and their signed distances on the device."""
