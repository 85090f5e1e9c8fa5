"""Images in a camera triangle that is a general linear camera in its own plane (Yu et al. 2009, eq. 5)."""

from typing import Any, NamedTuple

from mpcam.cameras.hulls import minus
from mpcam.math import Array, Vector, absolute, cross, detach, dot, epsilon, minimum, norm, vector, where

ROUNDINGS = 4.0
"""Of coordinates, that weights have to be sure of."""
UNCERTAIN = 0.25
"""Weights that rounding may change by this much are no image: slits, centers and the like."""
LARGEST_SLACK = 2.0**-10
"""Most that rounding may take a weight outside of the triangle."""


class Sweep(NamedTuple):
    """Where the swept plane of a camera triangle meets a point.

    second, third: weights of those corners. distance: along the rays, in units of their mean part along the normal.
    sure: False where rounding decides, in planes of slits for instance, or rays leave on both sides of the triangle.
    slack: how far weights may be off by rounding.
    """

    second: Array
    third: Array
    distance: Array
    sure: Array
    slack: Array


def plane_sweep(places: Any, rays: Any, point: Vector) -> Sweep:
    """The image of a point, for corners and rays (three vectors each): the ray's length is left out of it.

    How far the point lies off the triangle's plane says how far the plane is swept along the rays; the weights in the
    swept triangle are ratios of areas.
    """
    # Component by component: tables of camera triangles and of points broadcast against each other.
    a, b, c = places
    normal = cross(minus(b, a), minus(c, a))
    parts = [dot(normal, ray) for ray in rays]
    one_sided = (parts[0] * parts[1] > 0) & (parts[1] * parts[2] > 0)
    height = dot(normal, minus(point, a))
    sweeps = [height / where(one_sided, part, 1.0) for part in parts]
    p, q, r = (
        vector(*(place[i] + sweep * ray[i] for i in range(3)))
        for place, ray, sweep in zip(places, rays, sweeps, strict=True)
    )
    right, down, back = minus(q, p), minus(r, p), minus(p, point)
    area = dot(normal, cross(right, down))
    size = norm(a) + norm(b) + norm(c) + norm(point)
    for sweep, ray in zip(sweeps, rays, strict=True):
        size = size + absolute(sweep) * norm(ray)
    doubt = ROUNDINGS * epsilon(area) * detach(size * norm(normal) * (norm(right) + norm(down)))
    sure = one_sided & (absolute(area) > doubt / UNCERTAIN)
    inverse = 1.0 / where(sure, area, 1.0)
    second, third = dot(normal, cross(down, back)) * inverse, -dot(normal, cross(right, back)) * inverse
    slack = minimum(doubt * absolute(detach(inverse)), LARGEST_SLACK)
    mean = (parts[0] + parts[1] + parts[2]) * (1.0 / 3.0)
    return Sweep(second, third, height / where(one_sided, mean, 1.0), sure, slack)
