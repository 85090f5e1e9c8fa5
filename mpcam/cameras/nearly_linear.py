"""Images in camera triangles that are nearly general linear: the closed form as a start, then Newton's steps.

Where ray lengths are shared around vertices so that directions have nearly the same part along each triangle's normal,
the one image of the general linear camera with these rays lies near the image that the continuous camera has. Two steps
on both weights and the distance together end there, without a cubic.
"""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras import three_rays
from mpcam.cameras.hulls import minus
from mpcam.cameras.plane_sweep import plane_sweep
from mpcam.math import Array, Vector, absolute, cross, dot, epsilon, isfinite, norm, vector, where

LIMIT = 1e-6
"""Largest residual that counts as an image."""
_EDGE = 1e-9


class NearImage(NamedTuple):
    """Weights of corners 2 and 3, distance along the mixed ray in units of its length, and |p + c D - q|.

    residual: relative to the distances that it is made of; infinite where there is no start.
    """

    second: Array
    third: Array
    c: Array
    residual: Array


def near_image(places: Any, rays: Any, point: Vector, steps: int = 2) -> NearImage:
    """The image of a point (scene units) in camera triangles with corners and rays (three vectors each).

    The start is exact where all rays have the same part along the normal. Where the residual is
    not small, ask `three_rays.project`, which finds all images.
    """
    a, b, c = places
    second, third, distance, usable, _ = plane_sweep(places, rays, point)
    sides = minus(b, a), minus(c, a)
    turns = minus(rays[1], rays[0]), minus(rays[2], rays[0])
    for _ in range(steps):
        along, gap, _ = _miss(a, rays[0], sides, turns, point, second, third, distance)
        columns = [
            vector(*(side[i] + distance * turn[i] for i in range(3))) for side, turn in zip(sides, turns, strict=True)
        ]
        volume = dot(cross(columns[0], columns[1]), along)
        size = norm(columns[0]) * norm(columns[1]) * norm(along)
        regular = absolute(volume) > 16.0 * epsilon(volume) * size
        inverse = where(regular, -1.0, 0.0) / where(regular, volume, 1.0)
        second, third, distance = (
            second + dot(cross(gap, columns[1]), along) * inverse,
            third + dot(cross(columns[0], gap), along) * inverse,
            distance + dot(cross(columns[0], columns[1]), gap) * inverse,
        )
    along, gap, size = _miss(a, rays[0], sides, turns, point, second, third, distance)
    residual = norm(gap) / size
    sound = usable & isfinite(residual)
    return NearImage(second, third, distance, where(sound, residual, float("inf")))


def nearest_image(places: Any, rays: Any, point: np.ndarray, steps: int = 2) -> NearImage:
    """The same, of points (3, N) that lie in these camera triangles, for NumPy: exact where the steps are not.

    Where they do not end on an image in the triangle, `three_rays.project` finds all, and the one nearest to where the
    steps led is taken; without one, the residual stays what it was. places, rays: three arrays (3, N) each.
    """
    with np.errstate(all="ignore"):
        found = near_image(places, rays, point, steps)
        least = np.minimum(np.minimum(found.second, found.third), 1.0 - found.second - found.third)
        left = np.flatnonzero(~((found.residual <= LIMIT) & (least >= -_EDGE) & (found.c >= 0)))
        if not len(left):
            return found
        second, third, c, residual = (np.array(part) for part in found)
        corners, ways = ([part[:, left] for part in parts] for parts in (places, rays))
        images = three_rays.project(corners, ways, point[:, left])
        away = np.stack([np.abs(i.w2 - second[left]) + np.abs(1.0 - i.w1 - i.w2 - third[left]) for i in images])
        away = np.where(np.stack([i.valid for i in images]), np.where(np.isfinite(away), away, 1e300), np.inf)
        best, column = away.argmin(axis=0), np.arange(len(left))
        some = np.isfinite(away[best, column])
        first, other, distance = (np.stack([i[k] for i in images])[best, column] for k in range(3))
        w2, w3 = other, 1.0 - first - other
        sides, turns = ([minus(part[k], part[0]) for k in (1, 2)] for part in (corners, ways))
        _, gap, size = _miss(corners[0], ways[0], sides, turns, point[:, left], w2, w3, distance)
        for table, values in ((second, w2), (third, w3), (c, distance), (residual, norm(gap) / size)):
            table[left[some]] = values[some]
    return NearImage(second, third, c, residual)


def _miss(
    first: Vector, ray: Vector, sides: Any, turns: Any, point: Vector, second: Array, third: Array, distance: Array
) -> tuple[Vector, Vector, Array]:
    """Mixed direction, p + c D - q, and the distances that it is made of."""
    along = vector(*(ray[i] + second * turns[0][i] + third * turns[1][i] for i in range(3)))
    origin = vector(*(first[i] + second * sides[0][i] + third * sides[1][i] for i in range(3)))
    reach = minus(point, origin)
    gap = vector(*(distance * along[i] - reach[i] for i in range(3)))
    return along, gap, norm(reach) + norm(sides[0]) + norm(sides[1])
