"""Rays through one point, the origin of their frame, block by block of pixels: directions alone decide everything."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels import named_ray_triangle as test
from mpcam_kernels.linear_fit import Channel, linear_fit, position
from mpcam_kernels.ray_cones import EVERYWHERE, unit
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import PIXELS

__all__ = ["Cones", "Rays", "Slopes", "block_bounds", "packed", "test"]


@dataclass(frozen=True)
class Rays:
    """Directions in memory, a row each; zero where there is no ray."""

    rows: Rows

    ROWS = 1

    def at(self, types: Any, number: Any, active: Any = True) -> Any:
        """Directions by number."""
        return self.rows.at(types, number, active)[0].xyz

    def run(self, types: Any, first: Any, count: int) -> list[Any]:
        """So many directions from a number on."""
        return [self.at(types, first + k) for k in range(count)]

    def origin_and_direction(self, types: Any, number: Any) -> tuple[Any, Any]:
        """The rays, as most readers want them."""
        return types.Array3f(0), self.at(types, number)


def packed(types: Any, direction: Any, origin: Any) -> list[Any]:
    """The row in which a direction is kept."""
    return [types.Array4f(*direction, 0)]


class Cone(NamedTuple):
    """Directions no farther than `spread` from an axis of unit length; a negative spread: there is none."""

    axis: Any
    spread: Any

    def may_meet(self, ball: Any) -> Any:
        """False only where no ray meets a ball (center and radius; a negative radius: nothing there)."""
        spread = self.spread
        cosine = dr.sqrt(dr.maximum(1.0 - spread * spread, 0.0))
        along = dr.dot(ball.xyz, self.axis)
        across = dr.norm(ball.xyz - along * self.axis)
        # With what rounding can amount to.
        total = dr.fma(ball.w + abs(along) + across, 1e-6, ball.w)
        touched = (dr.fma(across, cosine, -along * spread) <= total) & (dr.fma(along, cosine, across * spread) >= 0)
        around = dr.fma(along, along, across * across) <= total * total
        return (touched | around | (spread > 0.999)) & (spread >= 0) & (ball.w >= 0)


@dataclass(frozen=True)
class Cones:
    """Cones in memory. rows: (axis, spread)."""

    rows: Rows

    ROWS = 1

    @property
    def items(self) -> int:
        """How many there are."""
        return dr.width(self.rows.flat) // 4

    def __call__(self, types: Any, number: Any, active: Any = True) -> Cone:
        """Cones by number."""
        (row,) = self.rows.at(types, number, active)
        return Cone(row.xyz, row.w)

    def joined(self, types: Any, first: Any, count: Any) -> list[Any]:
        """Rows of the cones around runs of cones."""
        zero = types.UInt(0)

        def more(k: Any, *_: Any) -> Any:
            return k < count

        def add(k: Any, n: Any, axis: Any) -> Any:
            cone = self(types, first + k)
            one = dr.select(cone.spread >= 0, types.Float(1), 0)
            return k + 1, n + one, axis + cone.axis * one

        _, n, axis = dr.while_loop((zero, types.Float(0), types.Array3f(0)), more, add)
        axis, known = unit(axis / dr.maximum(n, 1))

        def widen(k: Any, spread: Any) -> Any:
            cone = self(types, first + k)
            wide = dr.maximum(spread, dr.norm(cone.axis - axis) + cone.spread)
            return k + 1, dr.select(cone.spread >= 0, wide, spread)

        _, spread = dr.while_loop((zero, types.Float(-1)), more, widen)
        return [_row(types, axis, known, spread)]


@dataclass(frozen=True)
class Slopes:
    """Directions of blocks as linear functions of the position. Rows: (middle, off), (right, 0), (down, 0)."""

    rows: Rows

    ROWS, CHANNELS = 3, 1

    @staticmethod
    def packed(types: Any, channels: list[Channel], ball: Any) -> list[Any]:
        """The rows of the one channel; there is no ball around origins."""
        (d,) = channels
        return [types.Array4f(*row, last) for row, last in ((d.middle, d.off), (d.right, 0), (d.down, 0))]

    def at(self, types: Any, block: Any) -> tuple[list[Channel], None]:
        """Channels by number."""
        middle, right, down = self.rows.at(types, block)
        return [Channel(middle.xyz, right.xyz, down.xyz, middle.w)], None

    def edges(self, types: Any, shape: Any, block: Any) -> tuple[list[tuple[Any, Any, Any, Any]], Any, Any]:
        """Per edge its value in the middle of a block, its slopes to the right and down, and what it may be off.

        And whether hits are where all are positive, as they always are here, or where all are negative.
        """
        ((middle, right, down, off),), _ = self.at(types, block)
        lines = [(*(dr.dot(x, n) for x in (middle, right, down)), (off + 1e-6) * dr.norm(n)) for n in shape.edges]
        return lines, types.Bool(True), types.Bool(False)


def block_bounds(types: Any, rays: Rays, block: Any) -> tuple[list[Any], list[Any]]:
    """Rows of the cones and of the slopes of blocks by number, from the directions of their pixels."""
    slot = block * PIXELS

    def sample(k: Any) -> tuple[list[Any], Any, Any, Any]:
        d = rays.at(types, slot + k)
        return [d], *position(types, k), dr.squared_norm(d) > 0

    fit = linear_fit(types, sample, PIXELS, 1)
    (mean,), (line,) = fit.means, fit.channels
    axis, known = unit(mean)

    def widest(k: Any, spread: Any, off: Any) -> Any:
        (d,), s, t, valid = sample(k)
        wide, far = dr.norm(d - axis), dr.norm(d - line[0] - s * line[1] - t * line[2])
        pairs = ((spread, wide), (off, far))
        return k + 1, *(dr.select(valid, dr.maximum(most, value), most) for most, value in pairs)

    state = (types.UInt(0), types.Float(-1), types.Float(-1))
    _, spread, off = dr.while_loop(state, lambda k, spread, off: k < PIXELS, widest)
    return [_row(types, axis, known, spread)], Slopes.packed(types, [Channel(*line, off)], None)


def _row(types: Any, axis: Any, known: Any, spread: Any) -> Any:
    """A cone's row, its spread widened by what rounding can amount to."""
    wide = dr.select(known, spread * (1 + 1e-6) + 1e-7, EVERYWHERE)
    return types.Array4f(*axis, dr.select(spread >= 0, wide, -1.0))
