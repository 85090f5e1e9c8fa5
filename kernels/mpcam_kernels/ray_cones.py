"""Cones around rays that need no common center, and which balls such rays may meet.

At distance t from the waist, rays of a cone are no farther than reach + |t| spread from center + t axis. Rays that
converge are closest at their waist; others have it at their origins. The bounds come from the rays themselves, so they
hold whatever the camera: directions of mixed signs, folds, mirrors, lenses.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.rows import Rows

EVERYWHERE = 2.0
"""The spread of directions that have no mean worth the name."""


class Cone(NamedTuple):
    """Rays around an axis of unit length; reach is negative where there is no ray. See the top of this file."""

    center: Any
    reach: Any
    axis: Any
    spread: Any
    waist: Any

    def rows(self, types: Any) -> list[Any]:
        """The rows to be kept; the spread is rounded up. The waist must come from `waist`."""
        bits: Any = dr.reinterpret_array(types.UInt, types.Float(dr.maximum(self.spread, 0.0)))
        end: Any = dr.reinterpret_array(types.UInt, types.Float(self.waist))
        both = ((bits + 0xFFFF) & 0xFFFF0000) | (end >> 16)
        packed = dr.reinterpret_array(types.Float, types.UInt(both))
        return [types.Array4f(*self.center, self.reach), types.Array4f(*self.axis, packed)]

    def may_meet(self, ball: Any) -> Any:
        """False only where no ray meets a ball (center and radius; a negative radius: nothing there).

        The balls of radius reach + radius + |t| spread around center + t axis sweep a cone to each side of the waist.
        Its surface is met by what is across the axis, measured there: from far away, differences of squared distances
        would be lost in rounding.
        """
        away, spread = ball.xyz - self.center, self.spread
        total = self.reach + ball.w
        # What rounding can amount to.
        total = dr.fma(total + abs(away.x) + abs(away.y) + abs(away.z), 1e-6, total)
        along = dr.dot(away, self.axis)
        across = dr.norm(away - along * self.axis)
        cosine = dr.sqrt(dr.maximum(1.0 - spread * spread, 0.0))
        # Where the cone touches, counted from the foot of the ball on the axis, and times the cosine.
        touch, foot = across * spread, along * cosine
        near = dr.fma(along, along, across * across) <= total * total
        forward = (across * cosine - along * spread <= total) & (foot + touch >= 0)
        end, past = self.waist, along + self.waist
        limit = dr.fma(end, spread, total)
        backward = (end > 0) & (across * cosine + along * spread <= total) & (touch - foot >= 0)
        reached = touch - foot <= end * cosine * cosine * 1.0001 + 1e-6
        backward &= reached | (dr.fma(past, past, across * across) <= limit * limit)
        return (near | (spread > 0.999) | forward | backward) & (self.reach >= 0) & (ball.w >= 0)


@dataclass(frozen=True)
class Cones:
    """Cones in memory. rows: (center, reach), (axis, spread and waist in one number)."""

    rows: Rows

    ROWS = 2

    @property
    def items(self) -> int:
        """How many there are."""
        return dr.width(self.rows.flat) // (4 * self.rows.count)

    def __call__(self, types: Any, number: Any, active: Any = True) -> Any:
        """Cones by number."""
        return self.cone(types, number, active)

    def cone(self, types: Any, number: Any, active: Any = True) -> Cone:
        """Cones by number, without what others may know of their ends."""
        first, second, *_ = self.rows.at(types, number, active)
        bits: Any = dr.reinterpret_array(types.UInt, second.w)
        spread, waist = (dr.reinterpret_array(types.Float, half) for half in (bits & 0xFFFF0000, bits << 16))
        return Cone(first.xyz, first.w, second.xyz, spread, waist)

    def joined(self, types: Any, first: Any, count: Any) -> list[Any]:
        """Rows of the cones around runs of cones."""
        zero, nothing, none = types.UInt(0), types.Array3f(0), types.Float(0)

        def more(k: Any, *_: Any) -> Any:
            return k < count

        def one(k: Any) -> tuple[Cone, Any, Any]:
            """A cone, where its rays start on the whole, and 1 if there is any."""
            cone = self.cone(types, first + k)
            return cone, cone.center - cone.waist * cone.axis, dr.select(cone.reach >= 0, types.Float(1), 0)

        def add(k: Any, n: Any, start: Any, axis: Any) -> Any:
            cone, origin, some = one(k)
            return k + 1, n + some, start + origin * some, axis + cone.axis * some

        _, n, start, axis = dr.while_loop((zero, none, nothing, nothing), more, add)
        start, mean = start / dr.maximum(n, 1), axis / dr.maximum(n, 1)
        axis, known = unit(mean)

        def vary(k: Any, against: Any, square: Any) -> Any:
            cone, origin, some = one(k)
            away = cone.axis - mean
            return k + 1, against + some * dr.dot(origin - start, away), square + some * dr.squared_norm(away)

        closest = waist(types, n, *dr.while_loop((zero, none, none), more, vary)[1:])
        center = start + closest * mean

        def widen(k: Any, reach: Any, spread: Any) -> Any:
            cone, _, some = one(k)
            on = closest - cone.waist
            far = dr.norm(cone.center + on * cone.axis - center) + cone.reach + abs(on) * cone.spread
            reach = dr.select(some > 0, dr.maximum(reach, far), reach)
            wide = dr.norm(cone.axis - axis) + cone.spread
            return k + 1, reach, dr.select(some > 0, dr.maximum(spread, wide), spread)

        _, reach, spread = dr.while_loop((zero, types.Float(-1), types.Float(-1)), more, widen)
        return Cone(center, reach, axis, dr.select(known, spread, EVERYWHERE), closest).rows(types)


def unit(mean: Any) -> tuple[Any, Any]:
    """A mean of directions at unit length, and whether it is long enough to have a direction."""
    square = dr.squared_norm(mean)
    return mean * dr.rsqrt(dr.maximum(square, 1e-20)), square > 1e-8


def waist(types: Any, count: Any, against: Any, square: Any) -> Any:
    """Where rays are closest, from sums of (origin - mean) . (direction - mean) and of (direction - mean)^2.

    Not before the origins, and there where rays are so nearly parallel that rounding would say where; cut to the 16
    bits that are kept of it.
    """
    where = dr.select(square > 1e-5 * count, -against / dr.maximum(square, 1e-12), 0.0)
    bits: Any = dr.reinterpret_array(types.UInt, types.Float(dr.clip(where, 0.0, 64.0)))
    return dr.reinterpret_array(types.Float, types.UInt(bits & 0xFFFF0000))
