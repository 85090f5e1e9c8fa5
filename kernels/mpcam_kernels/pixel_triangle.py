"""Which pixels a straight-edged triangle covers in the image plane, for parallel rays and for projected vertices."""

from typing import Any, NamedTuple

import drjit as dr

Float = Any
Vector = Any


class PixelTriangle(NamedTuple):
    """Edges as a corner and a direction (signed so that the inside is positive), and the corners' depths."""

    starts: tuple[Vector, Vector, Vector]
    steps: tuple[Vector, Vector, Vector]
    depths: Vector
    usable: Any


def _edge(p: Vector, q: Vector, flip: Any) -> tuple[Vector, Vector]:
    """The edge from its lexicographically lower end, so that neighbors compute the same numbers."""
    swap = (p.x > q.x) | ((p.x == q.x) & (p.y > q.y))
    low, high = dr.select(swap, q, p), dr.select(swap, p, q)
    return low, dr.select(swap ^ flip, low - high, high - low)


def corner(row: Any) -> Vector:
    """What a set-up takes of a vertex's first row of four numbers."""
    return row.xyz


def turn(a: Vector, b: Vector, c: Vector) -> Float:
    """Below zero where corners run counter-clockwise in the image (v points down)."""
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)


def setup(a: Vector, b: Vector, c: Vector) -> PixelTriangle:
    """Edge functions of image triangles; x, y of the corners are pixels and z their depths."""
    area = turn(a, b, c)
    flip = area < 0
    pairs = [_edge(p.xy, q.xy, flip) for p, q in ((b, c), (c, a), (a, b))]
    depths = type(a)(a.z, b.z, c.z)
    starts, steps = tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs)
    return PixelTriangle(starts, steps, depths, area != 0)  # pyright: ignore[reportArgumentType]


def _edges(triangle: PixelTriangle, pixel: Vector) -> list[Float]:
    return [
        step.x * (pixel.y - start.y) - step.y * (pixel.x - start.x)
        for start, step in zip(triangle.starts, triangle.steps, strict=True)
    ]


def inside(triangle: PixelTriangle, pixel: Vector) -> Any:
    """Whether pixels are covered, at a depth above zero."""
    return hit(triangle, pixel)[0]


def hit(triangle: PixelTriangle, pixel: Vector) -> tuple[Any, Float]:
    """Whether pixels are covered at a depth above zero, and the inverse of that depth, which is linear in the image."""
    e0, e1, e2 = _edges(triangle, pixel)
    total = e0 + e1 + e2
    depth = e0 * triangle.depths.x + e1 * triangle.depths.y + e2 * triangle.depths.z
    return (e0 >= 0) & (e1 >= 0) & (e2 >= 0) & (total > 0) & (depth > 0), total / depth


def weights(triangle: PixelTriangle, pixel: Vector) -> tuple[Float, Float]:
    """Barycentric weights of corners b and c."""
    e0, e1, e2 = _edges(triangle, pixel)
    scale = 1.0 / (e0 + e1 + e2)
    return e1 * scale, e2 * scale


def may_hit(triangle: PixelTriangle, center: Vector, right: Vector, down: Vector, spread: Float) -> Any:
    """False only where no pixel of a square (see `samples.Bounds`) is covered."""
    possible = triangle.usable & (spread >= 0)
    for value, step in zip(_edges(triangle, center), triangle.steps, strict=True):
        reach = abs(step.x * down.y) + abs(step.y * right.x) + (abs(step.x) + abs(step.y)) * 1e-3
        possible = possible & (value + reach >= 0)
    return possible


ROWS = 4  # rows of four numbers that a set-up packs into


def pack(types: Any, triangle: PixelTriangle) -> list[Any]:
    """The set-up in rows of four numbers."""
    edges = [types.Array4f(p.x, p.y, s.x, s.y) for p, s in zip(triangle.starts, triangle.steps, strict=True)]
    return [*edges, types.Array4f(triangle.depths.x, triangle.depths.y, triangle.depths.z, 0)]


def unpack(rows: list[Any]) -> PixelTriangle:
    """The set-up of a usable triangle from its rows."""
    starts, steps = (rows[0].xy, rows[1].xy, rows[2].xy), (rows[0].zw, rows[1].zw, rows[2].zw)
    return PixelTriangle(starts, steps, rows[3].xyz, True)
