"""Viscosity in Pa s, from water to honey and beyond."""
