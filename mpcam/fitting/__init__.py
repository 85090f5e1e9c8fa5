"""Fits in JAX: camera triangles to what a mirror or lens does, and general linear cameras to rays."""
