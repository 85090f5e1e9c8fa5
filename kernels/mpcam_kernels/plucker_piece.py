"""Which straight pieces of bent rays hit a triangle: Plücker coordinates, and ends on both sides of its plane.

The end of a piece is, to the bit, the start of the next one, so that the side of a plane on which it lies is the same
for both: whatever the rounding, a ray that passes from one side to the other does so in one of its pieces.
"""

from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels import plucker
from mpcam_kernels.plucker import ROWS, PluckerTriangle, pack, setup, unpack, weights

__all__ = ["ROWS", "OneSided", "Piece", "hit", "inside", "pack", "setup", "unpack", "weights"]

Float = Any
Vector = Any


class Piece(NamedTuple):
    """Unit direction, moment (origin x direction) and origin, where the piece starts; all zero where there is none.

    end: the point where it ends; finite: 1, and inverse_length that of its length. Of a piece that goes on for ever:
    its direction, 0 and 1.
    """

    direction: Vector
    moment: Vector
    origin: Vector
    end: Vector
    finite: Float
    inverse_length: Float


def hit(triangle: PluckerTriangle, piece: Piece) -> tuple[Any, Float]:
    """Whether pieces run between the three edges and through the plane, and the inverse of the distance along them.

    Pieces hit where both hold: through the triangle, and an inverse distance above zero. One that starts in the plane
    does not run through it, one that ends there does.
    """
    before = triangle.offset - dr.dot(piece.origin, triangle.normal)
    after = piece.finite * triangle.offset - dr.dot(piece.end, triangle.normal)
    through = (before != 0) & (dr.mulsign(after, before) <= 0)
    nearness = (piece.finite * before - after) * piece.inverse_length / before
    return plucker.between(triangle, piece) & through, nearness


def inside(triangle: PluckerTriangle, piece: Piece) -> Any:
    """Whether pieces hit."""
    covered, nearness = hit(triangle, piece)
    return covered & (nearness > 0)


class OneSided(plucker.OneSided):
    """The same test for triangles of which one side is not shown."""

    whole = staticmethod(hit)
