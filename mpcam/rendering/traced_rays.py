"""The rays of a camera as Mitsuba traces them: one for each pixel, or the pieces of a bent one, each up to its end."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.types import PosedRays

CHUNK = 1 << 16
"""Pixels at a time."""
SLACK = 4e-6
"""How much farther a piece is traced than it goes, over its length and its place: no ray slips through at a bend."""


@dataclass(frozen=True, eq=False)
class TracedRays:
    """Mitsuba's rays, row by row, around a point in a unit. start: the kernels' Float, the length of the bent ray
    before them, or None.
    """

    ray: Any
    valid: Any
    start: Any = None


def straight_rays(mi: Any, posed: PosedRays, origin: np.ndarray, unit: float) -> list[TracedRays]:
    """Straight rays around a point (3,) of the world in a unit."""
    import drjit as dr

    world, along, valid = rays_around(posed, origin, unit)
    ray = mi.Ray3f(mi.Point3f(*map(mi.Float, world)), mi.Vector3f(*map(mi.Float, along)))
    found = TracedRays(ray, mi.Bool(valid))
    dr.eval(found.ray, found.valid)
    return [found]


def bent_rays(mi: Any, camera: Camera, origin: np.ndarray, unit: float) -> list[TracedRays]:
    """The pieces of a camera's bent rays around a point (3,) of the world in a unit, from the camera's own in float64.

    Nothing here is shared with what the kernels make of the pieces.
    """
    import drjit as dr

    zero, found = mi.Float(opaque_zero()), []
    for table in _tables(camera, origin, unit):
        start, way = (mi.Vector3f(table[rows]) + zero for rows in (slice(0, 3), slice(3, 6)))
        most = mi.Float(aligned(table[6])) + zero
        before = types().Float(aligned(table[7])) + opaque_zero()
        ray = mi.Ray3f(mi.Point3f(start), way, most, mi.Float(0), [])
        found.append(TracedRays(ray, most > 0, before))
        dr.eval(ray, found[-1].valid, before)
    return found


def _tables(camera: Camera, origin: np.ndarray, unit: float) -> list[np.ndarray]:
    """For each piece eight rows of numbers: where it starts, its direction, how far it is traced, and what was before.

    What is not valid is zero, and is not traced at all.
    """
    count, width = camera.width * camera.height, camera.width
    tables: list[np.ndarray] = []
    for first in range(0, count, CHUNK):
        number = np.arange(first, min(first + CHUNK, count))
        pieces = camera.ray_pieces(np.stack([number % width + 0.5, number // width + 0.5], -1))
        for k in range(pieces.start.shape[-1]):
            if k == len(tables):
                tables.append(np.zeros((8, count), np.float32))
            which = np.flatnonzero(pieces.valid[:, k])
            start, length = ((part[which, k]) / unit for part in (pieces.start, pieces.end - pieces.start))
            here = (pieces.origin[which, k] - origin).T / unit
            most = length + SLACK * (length + np.abs(here).max(0, initial=0.0) + 1.0)
            tables[k][:, first + which] = [*here, *pieces.direction[which, k].T, most, start]
    return tables


def rays_around(posed: PosedRays, origin: np.ndarray, unit: float) -> tuple[Any, Any, Any]:
    """Origin, direction and validity of rays, row by row, in world axes around a point (3,) in a unit."""
    rotation = posed.pose[:3, :3]
    numbers = opaque_numbers([*rotation.ravel(), *((rotation @ origin + posed.pose[:3, 3]) / unit), 1.0 / unit])
    columns, shift, scale = [numbers[i:9:3] for i in range(3)], numbers[9:12], numbers[12]

    def turned(vector: Any) -> list[Any]:
        return [sum(column[j] * vector[j] for j in range(3)) for column in columns]

    start = [posed.ray.origin[i] * scale - shift[i] for i in range(3)]
    return turned(start), turned(posed.ray.direction), posed.ray.valid
