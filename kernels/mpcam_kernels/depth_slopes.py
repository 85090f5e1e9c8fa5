"""How the depth of a plane changes from a pixel to the next ones."""

from typing import Any

import drjit as dr

STEEPEST = 12.0
"""Footprints of a pixel: planes that are steeper, within five degrees of edge-on, are taken to be as steep as this. To
the edge of a pixel they would reach far beyond their triangle, as fins that rays from the side would meet."""


def slope_of_plane(
    types: Any, size: tuple[int, int], pixel: Any, depth: Any, normal: Any, footprint: Any, rays: tuple[Any, ...]
) -> tuple[Any, Any]:
    """Derivatives to the right and downwards, per pixel, of the depth of planes through what the pixels see.

    pixel: numbers, row by row. normal: Array3f of any length, in the frame of the rays. footprint: of the pixels. rays:
    direction, origin (or None: all from one point) and validity of each pixel's ray.
    """
    width, height = size
    direction, origin, valid = rays
    column, row = pixel % width, pixel // width
    ray = dr.gather(types.Array3f, direction, pixel)
    start = None if origin is None else dr.gather(types.Array3f, origin, pixel)
    toward = dr.dot(normal, ray)
    found = []
    for at, count, stride in ((column, width, 1), (row, height, width)):
        if count == 1:
            found.append(types.Float(0))
            continue
        forward = at + 1 < count
        there = dr.select(forward, pixel + stride, pixel - stride)
        change = dr.gather(types.Array3f, direction, there) - ray
        moved = depth * dr.dot(normal, change)
        if start is not None:
            moved += dr.dot(normal, dr.gather(types.Array3f, origin, there) - start)
        slope = dr.select(forward, -moved, moved) / dr.select(toward != 0, toward, 1e-30)
        limit = STEEPEST * footprint
        usable = dr.gather(types.Bool, valid, there)
        found.append(dr.select(usable, dr.clip(slope, -limit, limit), 0.0))
    return found[0], found[1]
