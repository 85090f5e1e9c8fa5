"""Straight pieces of bent rays, block by block of pixels: how they are kept and bounded.

They are general rays with an end. Pieces that follow each other along their rays lie in layers of blocks of their own.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels import general_rays, ray_cones
from mpcam_kernels import plucker_piece as test
from mpcam_kernels.general_rays import Slopes
from mpcam_kernels.plucker_piece import Piece
from mpcam_kernels.ray_cones import Cone
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import PIXELS

__all__ = ["Cones", "Rays", "Slopes", "block_bounds", "first_hit", "reaching", "test"]

ENDLESS = 1e30
"""The radius of a ball around the ends of pieces some of which go on for ever."""


@dataclass(frozen=True)
class Rays:
    """Pieces in memory, three rows each, zero where there is none.

    Rows: direction and inverse length; origin, and 1 for a piece that ends or 0; end, and the length of the bent ray up
    to the origin. A piece that goes on for ever has the inverse length 1, and its direction in place of the end.
    """

    rows: Rows

    ROWS = 3

    def at(self, types: Any, number: Any, active: Any = True) -> Piece:
        """Pieces by number."""
        first, second, third = self.rows.at(types, number, active)
        direction, origin = first.xyz, second.xyz
        return Piece(direction, dr.cross(origin, direction), origin, third.xyz, second.w, first.w)

    def run(self, types: Any, first: Any, count: int) -> list[Piece]:
        """So many pieces from a number on."""
        return [self.at(types, first + k) for k in range(count)]

    def start(self, types: Any, number: Any, active: Any = True) -> Any:
        """Lengths of the bent rays up to the origins of pieces by number."""
        return dr.gather(types.Float, self.rows.flat, number * (4 * self.ROWS) + 11, active)

    def scaled(self, types: Any, number: Any, inverse: Any) -> list[Any]:
        """The rows of pieces by number when lengths are counted in another unit. inverse: of this unit."""
        first, second, third = self.rows.at(types, number)
        ends = second.w > 0
        return [
            types.Array4f(*first.xyz, dr.select(ends, first.w / inverse, first.w)),
            types.Array4f(*(second.xyz * inverse), second.w),
            types.Array4f(*dr.select(ends, third.xyz * inverse, third.xyz), third.w * inverse),
        ]


class CappedCone(NamedTuple):
    """A cone, and a ball that holds all ends of its rays."""

    cone: Cone
    last: Any

    def may_meet(self, ball: Any) -> Any:
        """False only where no piece meets a ball (center and radius; a negative radius: nothing there)."""
        away, total = ball.xyz - self.last.xyz, self.last.w + ball.w
        total = dr.fma(total + abs(away.x) + abs(away.y) + abs(away.z), 1e-6, total)
        # Only where all pieces run forwards along the axis does their farthest point lie at an end.
        before = (dr.dot(away, self.cone.axis) <= total) | (self.cone.spread > 0.999)
        return before & self.cone.may_meet(ball)


@dataclass(frozen=True)
class Cones(ray_cones.Cones):
    """Capped cones in memory. Rows: those of the cone, and the ball around the ends."""

    ROWS = 3

    def __call__(self, types: Any, number: Any, active: Any = True) -> CappedCone:
        """Capped cones by number."""
        return CappedCone(self.cone(types, number, active), self.last(types, number, active))

    def last(self, types: Any, number: Any, active: Any = True) -> Any:
        """The balls around ends by number."""
        return self.rows.at(types, number, active)[2]

    def joined(self, types: Any, first: Any, count: Any) -> list[Any]:
        """Rows of the cones around runs of cones."""

        def one(k: Any) -> tuple[Any, Any]:
            ball = self.last(types, first + k)
            return ball, ball.w >= 0

        return [*super().joined(types, first, count), _ball(types, count, one)]


def block_bounds(types: Any, rays: Rays, block: Any) -> tuple[list[Any], list[Any]]:
    """Rows of the cones and of the slopes of blocks by number, from the pieces of their pixels."""
    cone, slopes = general_rays.block_bounds(types, rays, block)

    def one(k: Any) -> tuple[Any, Any]:
        piece = rays.at(types, block * PIXELS + k)
        radius = dr.select(piece.finite > 0, types.Float(0), ENDLESS)
        return types.Array4f(*piece.end, radius), dr.squared_norm(piece.direction) > 0

    return [*cone, _ball(types, types.UInt(PIXELS), one)], slopes


def _ball(types: Any, count: Any, one: Any) -> Any:
    """A ball around so many balls; one(k) gives each, and whether it is there. The radius is -1 without any."""

    def more(k: Any, *_: Any) -> Any:
        return k < count

    def add(k: Any, n: Any, total: Any) -> Any:
        ball, exists = one(k)
        return k + 1, n + dr.select(exists, types.Float(1), 0), total + dr.select(exists, ball.xyz, 0)

    _, n, total = dr.while_loop((types.UInt(0), types.Float(0), types.Array3f(0)), more, add)
    center = total / dr.maximum(n, 1)

    def widen(k: Any, radius: Any) -> Any:
        ball, exists = one(k)
        return k + 1, dr.select(exists, dr.maximum(radius, dr.norm(ball.xyz - center) + ball.w), radius)

    _, radius = dr.while_loop((types.UInt(0), types.Float(-1)), more, widen)
    return types.Array4f(*center, radius)


def first_hit(types: Any, kind: Any, pixel: Any, slots: Any, layers: Any, pixels: Any, keys: Any) -> Any:
    """Int, for pixels by number, the slot of the first piece that hits something; of the last one if none does.

    slots: of each layer's pieces, -1 where a pixel has none; layers, pixels: how many. The result is -1 without pieces.
    """

    def hits(at: Any) -> Any:
        return dr.gather(kind, keys, types.UInt(dr.maximum(at, 0)), at >= 0) != 0

    return _last(types, pixel, slots, layers, pixels, lambda at, before: types.Bool(True), hits)


def reaching(types: Any, pixel: Any, slots: Any, layers: Any, pixels: Any, rays: Rays, depth: Any) -> Any:
    """Int, for pixels by number, the slot of the last piece that starts before a depth; -1 without pieces."""

    def starts(at: Any, before: Any) -> Any:
        # A depth of zero belongs to the first piece.
        return (rays.start(types, types.UInt(dr.maximum(at, 0)), at >= 0) <= depth) | (before < 0)

    return _last(types, pixel, slots, layers, pixels, starts, lambda at: types.Bool(False))


def _last(types: Any, pixel: Any, slots: Any, layers: Any, pixels: Any, counts: Any, ends: Any) -> Any:
    """The last slot of each pixel that counts, up to the one that ends the search."""

    def more(layer: Any, found: Any, ended: Any) -> Any:
        return (layer < layers) & ~ended

    def next_one(layer: Any, found: Any, ended: Any) -> Any:
        at = dr.gather(types.Int, slots, layer * pixels + pixel)
        taken = (at >= 0) & counts(at, found)
        return layer + 1, dr.select(taken, at, found), (at >= 0) & ends(at)

    return dr.while_loop((types.UInt(0), types.Int(-1), types.Bool(False)), more, next_one)[1]
