"""Depth images of any camera with one image of a point, and rays against them (Rosen et al. 2011)."""
