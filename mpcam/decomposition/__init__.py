"""Curved mirrors and lenses as camera triangles: cut, measured, and put back on the surface (Hou et al. 2006)."""
