"""Mitsuba: every camera as a sensor, meshes as shapes, and the variant that fits the kernels."""
