"""Which rays hit a triangle, for rays with any origin and direction: Plücker coordinates.

A ray from o along d passes the edge from a to b on the side that the sign of d . (a x b) + (o x d) . (b - a) tells. It
hits where the signs of the three edges agree.
"""

from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.ray_triangle import follows

Float = Any
Vector = Any


class Ray(NamedTuple):
    """Unit direction, moment (origin x direction) and origin; all zero where there is no ray."""

    direction: Vector
    moment: Vector
    origin: Vector


class PluckerTriangle(NamedTuple):
    """Per edge a x b and b - a; the normal, not of unit length, its inner product with a corner, and the number."""

    edges: tuple[tuple[Vector, Vector], ...]
    normal: Vector
    offset: Float
    usable: Any
    name: Any = None


def _edge(p: Vector, q: Vector) -> tuple[Vector, Vector]:
    """p x q and q - p, to the bit the negatives of those of the edge from q to p, so that neighbors leave no gap."""
    swap = follows(p, q)
    low, high = dr.select(swap, q, p), dr.select(swap, p, q)
    along = high - low
    across = dr.cross(low, along)
    return dr.select(swap, -across, across), dr.select(swap, -along, along)


def setup(a: Vector, b: Vector, c: Vector) -> PluckerTriangle:
    """Edges and plane of triangles with corners a, b, c; unusable where they have no area."""
    normal = dr.cross(b - a, c - a)
    squared = dr.squared_norm(normal)
    return PluckerTriangle(
        (_edge(b, c), _edge(c, a), _edge(a, b)), normal, dr.dot(normal, a), (squared > 0) & dr.isfinite(squared)
    )


def _sides(triangle: PluckerTriangle, ray: Any) -> list[Float]:
    d, m = ray.direction, ray.moment
    return [
        dr.fma(d.x, n.x, dr.fma(d.y, n.y, dr.fma(d.z, n.z, dr.fma(m.x, e.x, dr.fma(m.y, e.y, m.z * e.z)))))
        for n, e in triangle.edges
    ]


def between(triangle: PluckerTriangle, ray: Any) -> Any:
    """Whether lines run between the three edges."""
    a, b, c = _sides(triangle, ray)
    return ((a >= 0) & (b >= 0) & (c >= 0)) | ((a <= 0) & (b <= 0) & (c <= 0))


def hit(triangle: PluckerTriangle, ray: Ray) -> tuple[Any, Float]:
    """Whether lines run between the three edges, and the inverse of the distance along the ray.

    Rays hit where both hold: between the edges, and an inverse distance above zero.
    """
    covered = between(triangle, ray)
    away = triangle.offset - dr.dot(ray.origin, triangle.normal)
    # A ray that starts in the triangle's plane is at no distance from it: no hit, as for a tracer.
    return covered & (away != 0), dr.dot(ray.direction, triangle.normal) / away


def inside(triangle: PluckerTriangle, ray: Ray) -> Any:
    """Whether rays hit."""
    covered, nearness = hit(triangle, ray)
    return covered & (nearness > 0)


def weights(triangle: PluckerTriangle, ray: Any) -> tuple[Float, Float]:
    """Barycentric weights of corners b and c at the point that a ray hits."""
    e0, e1, e2 = _sides(triangle, ray)
    scale = 1.0 / (e0 + e1 + e2)
    return e1 * scale, e2 * scale


ROWS = 6  # rows of four numbers that a set-up packs into


def pack(types: Any, triangle: PluckerTriangle, name: Any) -> list[Any]:
    """The set-up and the number of the triangle, in rows of four numbers."""
    (n0, e0), (n1, e1), (n2, e2) = triangle.edges
    number = dr.reinterpret_array(types.Float, types.UInt(name))
    rows = [(*n0, triangle.offset), (*e0, e2.x), (*n1, e2.y), (*e1, e2.z), (*n2, number), (*triangle.normal, 0.0)]
    return [types.Array4f(*row) for row in rows]


def unpack(rows: list[Any]) -> PluckerTriangle:
    """The set-up of a usable triangle from its rows."""
    first, second, third, fourth, fifth, last = rows
    e2 = type(first.xyz)(second.w, third.w, fourth.w)
    edges = ((first.xyz, second.xyz), (third.xyz, fourth.xyz), (fifth.xyz, e2))
    name = dr.reinterpret_array(dr.uint32_array_t(type(fifth.w)), fifth.w)
    return PluckerTriangle(edges, last.xyz, first.w, True, name)


class OneSided:
    """The same test for triangles of which one side is not shown: "back" or "front".

    Corners run counter-clockwise seen from the front. Rays that come from there run against the normal, and pass all
    edges on the negative side.
    """

    ROWS = ROWS
    setup, pack = staticmethod(setup), staticmethod(pack)
    unpack, weights = staticmethod(unpack), staticmethod(weights)
    whole = staticmethod(hit)  # of both sides

    def __init__(self, cull: str):
        self.sign = {"back": -1.0, "front": 1.0}[cull]

    def hit(self, triangle: PluckerTriangle, ray: Any) -> tuple[Any, Float]:
        """As `hit`, where the side is shown."""
        covered, nearness = self.whole(triangle, ray)
        return covered & (self.sign * dr.dot(ray.direction, triangle.normal) > 0), nearness

    def inside(self, triangle: PluckerTriangle, ray: Any) -> Any:
        """As `inside`, where the side is shown."""
        covered, nearness = self.hit(triangle, ray)
        return covered & (nearness > 0)
