"""Which rays hit a triangle, for rays with any origin and direction: Pluecker coordinates.

A ray from o along d passes the edge from a to b on the side that the sign of d . (a x b) + (o x d) . (b - a) tells. It
hits where the signs of the three edges agree.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

Float = Any
Vector = Any


@dataclass(frozen=True)
class Rays:
    """Unit directions, moments (origin x direction) and origins, number by number; all zero where there is no ray."""

    dx: Any
    dy: Any
    dz: Any
    mx: Any
    my: Any
    mz: Any
    ox: Any
    oy: Any
    oz: Any

    def __iter__(self) -> Any:
        return iter((self.dx, self.dy, self.dz, self.mx, self.my, self.mz, self.ox, self.oy, self.oz))


class SkewTriangle(NamedTuple):
    """Per edge a x b and b - a; the normal, not of unit length, and its inner product with a corner."""

    edges: tuple[tuple[Vector, Vector], ...]
    normal: Vector
    offset: Float
    usable: Any


def _edge(p: Vector, q: Vector) -> tuple[Vector, Vector]:
    """p x q and q - p, to the bit the negatives of those of the edge from q to p, so that neighbours leave no gap."""
    swap = (p.x > q.x) | ((p.x == q.x) & ((p.y > q.y) | ((p.y == q.y) & (p.z > q.z))))
    low, high = dr.select(swap, q, p), dr.select(swap, p, q)
    along = high - low
    across = dr.cross(low, along)
    return dr.select(swap, -across, across), dr.select(swap, -along, along)


def setup(a: Vector, b: Vector, c: Vector) -> SkewTriangle:
    """Edges and plane of triangles with corners a, b, c; unusable where they have no area."""
    normal = dr.cross(b - a, c - a)
    squared = dr.squared_norm(normal)
    return SkewTriangle(
        (_edge(b, c), _edge(c, a), _edge(a, b)), normal, dr.dot(normal, a), (squared > 0) & dr.isfinite(squared)
    )


def _sides(triangle: SkewTriangle, ray: Any) -> list[Float]:
    return [
        dr.fma(
            ray.dx,
            n.x,
            dr.fma(ray.dy, n.y, dr.fma(ray.dz, n.z, dr.fma(ray.mx, e.x, dr.fma(ray.my, e.y, ray.mz * e.z)))),
        )
        for n, e in triangle.edges
    ]


def hit(triangle: SkewTriangle, ray: Any) -> tuple[Any, Float]:
    """Whether lines run between the three edges, and the inverse of the distance along the ray.

    Rays hit where both hold: between the edges, and an inverse distance above zero.
    """
    sides, n = _sides(triangle, ray), triangle.normal
    lowest, highest = dr.minimum(dr.minimum(*sides[:2]), sides[2]), dr.maximum(dr.maximum(*sides[:2]), sides[2])
    away = triangle.offset - dr.fma(ray.ox, n.x, dr.fma(ray.oy, n.y, ray.oz * n.z))
    towards = dr.fma(ray.dx, n.x, dr.fma(ray.dy, n.y, ray.dz * n.z))
    # A ray that starts in the triangle's plane is at no distance from it: no hit, as for a tracer.
    return ((lowest >= 0) | (highest <= 0)) & (away != 0), towards / away


def inside(triangle: SkewTriangle, ray: Any) -> Any:
    """Whether rays hit."""
    covered, nearness = hit(triangle, ray)
    return covered & (nearness > 0)


def weights(triangle: SkewTriangle, ray: Any) -> tuple[Float, Float]:
    """Barycentric weights of corners b and c at the point that a ray hits."""
    e0, e1, e2 = _sides(triangle, ray)
    scale = 1.0 / (e0 + e1 + e2)
    return e1 * scale, e2 * scale


ROWS = 6  # rows of four numbers that a set-up packs into


def pack(types: Any, triangle: SkewTriangle) -> list[Any]:
    """The set-up in rows of four numbers."""
    (n0, e0), (n1, e1), (n2, e2) = triangle.edges
    rows = [(*n0, triangle.offset), (*e0, e2.x), (*n1, e2.y), (*e1, e2.z), (*n2, 0.0), (*triangle.normal, 0.0)]
    return [types.Array4f(*row) for row in rows]


def unpack(rows: list[Any]) -> SkewTriangle:
    """The set-up of a usable triangle from its rows."""
    kind = type(rows[0].xyz)
    edges = (
        (rows[0].xyz, rows[1].xyz),
        (rows[2].xyz, rows[3].xyz),
        (rows[4].xyz, kind(rows[1].w, rows[2].w, rows[3].w)),
    )
    return SkewTriangle(edges, rows[5].xyz, rows[0].w, True)
