"""Triangles cut by parallel planes.

A cut point is worked out from the ends of its edge in an order that does not depend on the triangle, so that neighbors
get the same one.
"""

from typing import Any, NamedTuple

import drjit as dr

FANS = 4
"""Triangles that the part of a triangle between two planes is made of, at most; some may have no area."""


class Corner(NamedTuple):
    """A point, and the weights of corners 2 and 3 of the whole triangle there."""

    point: Any
    second: Any
    third: Any


def before(p: Any, q: Any) -> Any:
    """Whether p comes before q, by x, then y, then z."""
    return (p.x < q.x) | ((p.x == q.x) & ((p.y < q.y) | ((p.y == q.y) & (p.z < q.z))))


def in_order(corners: list[Corner]) -> list[Corner]:
    """Three corners, each before the next."""
    a, b, c = corners
    a, b = _swapped(a, b)
    b, c = _swapped(b, c)
    a, b = _swapped(a, b)
    return [a, b, c]


def _swapped(p: Corner, q: Corner) -> tuple[Corner, Corner]:
    return chosen(wrong := before(q.point, p.point), q, p), chosen(wrong, p, q)


def chosen(condition: Any, p: Corner, q: Corner) -> Corner:
    """One of two corners."""
    return Corner(*(dr.select(condition, x, y) for x, y in zip(p, q, strict=True)))


def _cut(p: Corner, q: Corner, depth: Any) -> Corner:
    """Where the edge from p to q meets a plane z = depth; p is before q."""
    rise = q.point.z - p.point.z
    part = (depth - p.point.z) / dr.select(rise != 0, rise, 1.0)
    mixed = [x + part * (y - x) for x, y in zip(p, q, strict=True)]
    mixed[0].z = depth
    return Corner(*mixed)


def between(corners: list[Corner], near: Any, far: Any) -> list[list[Corner]]:
    """FANS triangles that make up the part of a triangle with near <= z <= far, for lanes where there is such a part.

    Those that are not needed have two equal corners.
    """
    ends, there = [], []
    for k in range(3):
        p, q = corners[k], corners[(k + 1) % 3]
        turned = before(q.point, p.point)
        low, high = chosen(turned, q, p), chosen(turned, p, q)
        first, last = (_held(end, low, high, near, far) for end in (p, q))
        seen = (dr.maximum(p.point.z, q.point.z) >= near) & (dr.minimum(p.point.z, q.point.z) <= far)
        ends.append([first, last])
        there.append(seen)
    # One edge may lie beyond the planes: both of its ends become the last one of the edge before it.
    for k in range(3):
        ends[k] = [chosen(there[k], end, ends[k - 1][1]) for end in ends[k]]
    polygon = [end for edge in ends for end in edge]
    return [[polygon[0], polygon[k], polygon[k + 1]] for k in range(1, FANS + 1)]


def _held(end: Corner, low: Corner, high: Corner, near: Any, far: Any) -> Corner:
    """An end of an edge, or where the edge meets the plane that the end lies beyond."""
    result = chosen(end.point.z < near, _cut(low, high, near), end)
    return chosen(end.point.z > far, _cut(low, high, far), result)
