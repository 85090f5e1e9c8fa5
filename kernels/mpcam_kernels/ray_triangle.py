"""Which rays through one point hit a triangle: homogeneous edge functions.

A ray along d from the origin hits triangle (a, b, c) where d . (b x c), d . (c x a) and d . (a x b) have one sign.
"""

from typing import Any, NamedTuple

import drjit as dr

Float = Any
Vector = Any


class RayTriangle(NamedTuple):
    """Edge normals (towards the inside), and the plane as n with n . x = 1 for its points x."""

    edges: tuple[Vector, Vector, Vector]
    plane: Vector
    usable: Any


def follows(p: Vector, q: Vector) -> Any:
    """Lexicographic order of positions."""
    return (p.x > q.x) | ((p.x == q.x) & ((p.y > q.y) | ((p.y == q.y) & (p.z > q.z))))


def _edge_normal(p: Vector, q: Vector) -> Vector:
    """p x q, to the bit the negative of q x p, so that neighbors leave no gap between them.

    Written with q - p, which is exact for short edges: the edge is then off by an angle of a few units in the last
    place, however small the triangle is.
    """
    swap = follows(p, q)
    low, high = dr.select(swap, q, p), dr.select(swap, p, q)
    normal = dr.cross(low, high - low)
    return dr.select(swap, -normal, normal)


def corner(row: Any) -> Vector:
    """What a set-up takes of a vertex's first row of four numbers."""
    return row.xyz


def turn(a: Vector, b: Vector, c: Vector) -> Float:
    """Below zero where corners run counter-clockwise seen from the eye."""
    return dr.dot(a, dr.cross(b - a, c - a))


def setup(a: Vector, b: Vector, c: Vector) -> RayTriangle:
    """Edge functions of triangles with corners a, b, c seen from the origin; unusable where seen edge-on."""
    normal = dr.cross(b - a, c - a)
    offset = dr.dot(a, normal)
    edges = (_edge_normal(b, c), _edge_normal(c, a), _edge_normal(a, b))
    flip = offset < 0
    edges = tuple(dr.select(flip, -edge, edge) for edge in edges)
    plane = normal / offset
    usable = (offset != 0) & dr.isfinite(dr.squared_norm(plane))
    return RayTriangle(edges, plane, usable)  # pyright: ignore[reportArgumentType]


def inside(triangle: RayTriangle, direction: Vector) -> Any:
    """Whether rays run between the three edges; false for a direction of zero length."""
    e0, e1, e2 = (dr.dot(edge, direction) for edge in triangle.edges)
    return (e0 >= 0) & (e1 >= 0) & (e2 >= 0) & (e0 + e1 + e2 > 0)


def hit(triangle: RayTriangle, direction: Vector) -> tuple[Any, Float]:
    """Whether rays run between the three edges, and the inverse of the distance along a unit direction.

    Rays hit where both hold: between the edges, and an inverse distance above zero.
    """
    e0, e1, e2 = (dr.dot(edge, direction) for edge in triangle.edges)
    return (e0 >= 0) & (e1 >= 0) & (e2 >= 0), dr.dot(triangle.plane, direction)


def weights(triangle: RayTriangle, direction: Vector) -> tuple[Float, Float]:
    """Barycentric weights of corners b and c at the point that a ray hits."""
    e0, e1, e2 = (dr.dot(edge, direction) for edge in triangle.edges)
    scale = 1.0 / (e0 + e1 + e2)
    return e1 * scale, e2 * scale


def may_hit(triangle: RayTriangle, center: Vector, right: Vector, down: Vector, spread: Float) -> Any:
    """False only where no direction of a square (see `samples.Bounds`) hits the triangle."""
    possible = triangle.usable & (spread >= 0)
    for edge in triangle.edges:
        length = dr.sqrt(dr.squared_norm(edge))
        reach = abs(dr.dot(edge, right)) + abs(dr.dot(edge, down)) + length * (spread + 1e-6)
        possible = possible & (dr.dot(edge, center) + reach >= 0)
    return possible


ROWS = 3  # rows of four numbers that a set-up packs into


def pack(types: Any, triangle: RayTriangle) -> list[Any]:
    """The set-up in rows of four numbers."""
    return [types.Array4f(e.x, e.y, e.z, part) for e, part in zip(triangle.edges, triangle.plane, strict=True)]


def unpack(rows: list[Any]) -> RayTriangle:
    """The set-up of a usable triangle from its rows."""
    kind = type(rows[0].xyz)
    edges = (rows[0].xyz, rows[1].xyz, rows[2].xyz)
    return RayTriangle(edges, kind(rows[0].w, rows[1].w, rows[2].w), True)
