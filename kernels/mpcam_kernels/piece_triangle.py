"""Straight-edged triangles of one part of the image: corners and samples carry the number of the part they are in."""

from typing import Any, NamedTuple

from mpcam_kernels import pixel_triangle, screen_triangle
from mpcam_kernels.pixel_triangle import ROWS as ROWS
from mpcam_kernels.pixel_triangle import may_hit as may_hit
from mpcam_kernels.pixel_triangle import turn as turn
from mpcam_kernels.pixel_triangle import weights as weights


class PieceTriangle(NamedTuple):
    """A `pixel_triangle.PixelTriangle` and the number of its part of the image."""

    starts: tuple[Any, Any, Any]
    steps: tuple[Any, Any, Any]
    depths: Any
    usable: Any
    piece: Any


def corner(row: Any) -> Any:
    """Pixel, depth and part of a vertex."""
    return row


def setup(a: Any, b: Any, c: Any) -> PieceTriangle:
    """Edge functions; x, y of the corners are pixels, |z| their depths, w their part."""
    return PieceTriangle(*screen_triangle.setup(a.xyz, b.xyz, c.xyz), a.w)


def hit(triangle: PieceTriangle, sample: Any) -> tuple[Any, Any]:
    """Whether samples of the same part are covered at a depth above zero, and the inverse of that depth."""
    covered, nearness = pixel_triangle.hit(triangle, sample)  # pyright: ignore[reportArgumentType]
    return covered & (sample.z == triangle.piece), nearness


def inside(triangle: PieceTriangle, sample: Any) -> Any:
    """Whether samples of the same part are covered, at a depth above zero."""
    return hit(triangle, sample)[0]


def pack(types: Any, triangle: PieceTriangle) -> list[Any]:
    """The set-up in rows of four numbers."""
    *edges, last = pixel_triangle.pack(types, triangle)  # pyright: ignore[reportArgumentType]
    return [*edges, types.Array4f(last.x, last.y, last.z, triangle.piece)]


def unpack(rows: list[Any]) -> PieceTriangle:
    """The set-up of a usable triangle from its rows."""
    return PieceTriangle(*pixel_triangle.unpack(rows), rows[3].w)
