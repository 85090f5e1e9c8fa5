"""Where rays cross planes at right angles to the true ones: the measure of all errors of rays, for NumPy and JAX."""

from typing import NamedTuple

from mpcam.math import Array, Vector, dot, maximum, normalize, vector

NEAR, FAR = 0.5, 2.0
"""Distances of the two planes that fits hold together, in radii of the reflector: one alone spoils the others."""


class Crossing(NamedTuple):
    """miss: from the true ray to the other one, in the plane (scene units). along: the other one's unit direction.
    forward: part of it along the true ray. reach: how far it runs to the plane.
    """

    miss: Vector
    along: Vector
    forward: Array
    reach: Array


def crossing(
    origin: Vector, along: Vector, point: Vector, true: Vector, distance: Array, least: float | None = None
) -> Crossing:
    """Where rays (any length) cross the plane `distance` scene units along true unit rays from their points.

    least: smallest `forward` that is counted with, so that rays that leave sideways or backwards have an error that is
    large and finite.
    """
    along = normalize(along)
    forward = dot(along, true)
    if least is not None:
        forward = maximum(forward, least)
    gap = vector(*(origin[i] - point[i] - distance * true[i] for i in range(3)))
    reach = -dot(gap, true) / forward
    return Crossing(vector(*(gap[i] + reach * along[i] for i in range(3))), along, forward, reach)
