"""Rasterize, interpolate, shade; the methods by name."""
