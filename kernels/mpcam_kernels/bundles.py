"""Bundles of rays that need no common centre: blocks of pixels, groups of blocks, and bounds of the rays in each.

The bounds come from the rays of the pixels themselves, so they hold whatever the camera: directions of mixed signs,
folds, mirrors, lenses.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import HEIGHT, PIXELS, WIDTH, of_block
from mpcam_kernels.skew import Rays

GROUP = 32  # most blocks in a group


@dataclass(frozen=True)
class Bundle:
    """The rays of a camera's pixels by place, and what bounds them.

    pixels: rays, zero where a place has no pixel. blocks: rows of four numbers for each block of WIDTH x HEIGHT places:
    the cone (see `Cones`), then direction and moment as linear functions of the place in the block. groups: the cones
    of groups of blocks. first, count: blocks of each group. corners: first column and row of each block within its
    camera triangle. planes: what bounds images there (see `planes.Planes`), or None.
    """

    pixels: Rays
    cones: "Cones"
    slopes: Rows
    groups: "Cones"
    first: Any
    count: Any
    corners: tuple[Any, Any]
    planes: Any


@dataclass(frozen=True)
class Cones:
    """Bounds of bundles: at distance t, rays are no farther than reach + |t - waist| spread from centre + (t - waist)
    axis. Rays that converge are closest at their waist, others at their origins, where t is 0.

    rows: (centre, reach), (axis, spread and waist in one number); reach is negative where there is no ray.
    """

    rows: Rows

    @property
    def items(self) -> int:
        """How many there are."""
        return dr.width(self.rows.flat) // (4 * self.rows.count)

    def __call__(self, types: Any, number: Any, active: Any = True) -> "Cone":
        """Cones by number."""
        first, second = self.rows.at(types, number, active)
        bits: Any = dr.reinterpret_array(types.UInt, second.w)
        spread, waist = (dr.reinterpret_array(types.Float, half) for half in (bits & 0xFFFF0000, bits << 16))
        return Cone(first.xyz, first.w, second.xyz, spread, waist)


class Cone(NamedTuple):
    """One of `Cones`."""

    centre: Any
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
        return [types.Array4f(*self.centre, self.reach), types.Array4f(*self.axis, packed)]


def waist(types: Any, count: Any, against: Any, square: Any) -> Any:
    """Where rays are closest, from sums of (origin - mean) . (direction - mean) and of (direction - mean)^2.

    Not before the origins, and there where rays are so nearly parallel that rounding would say where; cut to the 16
    bits that are kept of it.
    """
    where = dr.select(square > 1e-5 * count, -against / dr.maximum(square, 1e-12), 0.0)
    bits: Any = dr.reinterpret_array(types.UInt, types.Float(dr.clip(where, 0.0, 64.0)))
    return dr.reinterpret_array(types.Float, types.UInt(bits & 0xFFFF0000))


def may_meet(cone: Cone, ball: Any) -> Any:
    """False only where no ray of a cone meets a ball (centre and radius; a negative radius: nothing there).

    With t counted from the waist, a ball that is met has |ball - centre - t axis| <= reach + radius + |t| spread, for
    some t from -waist on: a quadratic inequality to each side.
    """
    away, spread = ball.xyz - cone.centre, cone.spread
    total = cone.reach + ball.w
    # What rounding can amount to.
    total = dr.fma(total + abs(away.x) + abs(away.y) + abs(away.z), 1e-5, total)
    along, more = dr.dot(away, cone.axis), total * spread
    a, c = 1.0 - spread * spread, dr.squared_norm(away) - total * total
    ahead, behind, end = along + more, more - along, cone.waist
    forward = (ahead > 0) & (ahead * ahead >= a * c)
    backward = (end > 0) & (behind > 0) & (behind * behind >= a * c)
    backward &= (a * end >= behind) | (dr.fma(dr.fma(a, end, -2.0 * behind), end, c) <= 0)
    return ((c <= 0) | (a <= 1e-3) | forward | backward) & (cone.reach >= 0) & (ball.w >= 0)


def bounds(types: Any, pixels: Rays, block: Any) -> list[Any]:
    """Two rows of the cones and six of the slopes of blocks by number.

    Slopes: direction and moment are centre + s right + t down, s and t from -1 to 1 over the places of the block, and
    no more than a spread off; origins lie within a ball. Rows: (d centre, d spread), (m centre, m spread), (d right,
    ball x), (m right, ball y), (d down, ball z), (m down, ball radius).
    """
    zero, nothing = types.UInt(0), types.Float(0)
    place = block * PIXELS

    def sample(k: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        d, m, o = pixels.at(types, place + k)
        s, t = position(types, k)
        return d, m, o, s, t, dr.squared_norm(d) > 0

    def below(k: Any, *_: Any) -> Any:
        return k < PIXELS

    def moments(k: Any, n: Any, d: Any, m: Any, o: Any, s: Any, t: Any) -> Any:
        dk, mk, ok, sk, tk, valid = sample(k)
        one = dr.select(valid, types.Float(1), 0)
        return k + 1, n + one, d + dk * one, m + mk * one, o + ok * one, s + sk * one, t + tk * one

    empty = types.Array3f(0)
    _, n, d, m, o, s, t = dr.while_loop((zero, nothing, empty, empty, empty, nothing, nothing), below, moments)
    inverse = 1.0 / dr.maximum(n, 1)
    d, m, o, s, t = d * inverse, m * inverse, o * inverse, s * inverse, t * inverse

    def covariances(
        k: Any, ss: Any, st: Any, tt: Any, ds: Any, dt: Any, ms: Any, mt: Any, against: Any, square: Any
    ) -> Any:
        dk, mk, ok, sk, tk, valid = sample(k)
        x, y = dr.select(valid, sk - s, 0), dr.select(valid, tk - t, 0)
        away, turn = dk - d, mk - m
        # Not in place: the loop would take what is the same object for unchanged.
        against = against + dr.select(valid, dr.dot(ok - o, away), 0)
        square = square + dr.select(valid, dr.squared_norm(away), 0)
        lines = ss + x * x, st + x * y, tt + y * y, ds + away * x, dt + away * y, ms + turn * x, mt + turn * y
        return (k + 1, *lines, against, square)

    state = (zero, nothing, nothing, nothing, empty, empty, empty, empty, nothing, nothing)
    _, ss, st, tt, ds, dt, ms, mt, against, square = dr.while_loop(state, below, covariances)
    closest = waist(types, n, against, square)
    # Least squares, held back where the places of the block lie on a line.
    ss, tt = ss + 1e-3, tt + 1e-3
    solve = 1.0 / (ss * tt - st * st)
    d_right, d_down = (ds * tt - dt * st) * solve, (dt * ss - ds * st) * solve
    m_right, m_down = (ms * tt - mt * st) * solve, (mt * ss - ms * st) * solve
    d_middle, m_middle = d - d_right * s - d_down * t, m - m_right * s - m_down * t
    axis = d * dr.rsqrt(dr.maximum(dr.squared_norm(d), 1e-20))

    middle = o + closest * d

    def widest(k: Any, start: Any, reach: Any, spread: Any, d_off: Any, m_off: Any) -> Any:
        dk, mk, ok, sk, tk, valid = sample(k)
        off = dk - d_middle - sk * d_right - tk * d_down
        turn = mk - m_middle - sk * m_right - tk * m_down
        return (
            k + 1,
            dr.select(valid, dr.maximum(start, dr.norm(ok - o)), start),
            dr.select(valid, dr.maximum(reach, dr.norm(ok + closest * dk - middle)), reach),
            dr.select(valid, dr.maximum(spread, dr.norm(dk - axis)), spread),
            dr.select(valid, dr.maximum(d_off, dr.norm(off)), d_off),
            dr.select(valid, dr.maximum(m_off, dr.norm(turn)), m_off),
        )

    none = types.Float(-1)
    _, start, reach, spread, d_off, m_off = dr.while_loop((zero, none, none, none, none, none), below, widest)
    cone = Cone(middle, reach, axis, spread, closest)
    slopes = [(d_middle, d_off), (m_middle, m_off), (d_right, o.x), (m_right, o.y), (d_down, o.z), (m_down, start)]
    return [*cone.rows(types), *(types.Array4f(*row, last) for row, last in slopes)]


def position(types: Any, place: Any) -> tuple[Any, Any]:
    """Where a place lies in its block, from -1 to 1 along both sides."""
    x, y = of_block(place)
    return (types.Float(x) - 0.5 * (WIDTH - 1)) * (2.0 / (WIDTH - 1)), (types.Float(y) - 0.5 * (HEIGHT - 1)) * (
        2.0 / (HEIGHT - 1)
    )


def joined(types: Any, cones: Cones, first: Any, count: Any) -> list[Any]:
    """Rows of the cones around runs of cones."""
    zero, nothing, none = types.UInt(0), types.Array3f(0), types.Float(0)

    def more(k: Any, *_: Any) -> Any:
        return k < count

    def one(k: Any) -> tuple[Cone, Any, Any]:
        """A cone, where its rays start on the whole, and 1 if there is any."""
        cone = cones(types, first + k)
        return cone, cone.centre - cone.waist * cone.axis, dr.select(cone.reach >= 0, types.Float(1), 0)

    def add(k: Any, n: Any, start: Any, axis: Any) -> Any:
        cone, origin, some = one(k)
        return k + 1, n + some, start + origin * some, axis + cone.axis * some

    _, n, start, axis = dr.while_loop((zero, none, nothing, nothing), more, add)
    start, mean = start / dr.maximum(n, 1), axis / dr.maximum(n, 1)
    axis = axis * dr.rsqrt(dr.maximum(dr.squared_norm(axis), 1e-20))

    def vary(k: Any, against: Any, square: Any) -> Any:
        cone, origin, some = one(k)
        away = cone.axis - mean
        return k + 1, against + some * dr.dot(origin - start, away), square + some * dr.squared_norm(away)

    closest = waist(types, n, *dr.while_loop((zero, none, none), more, vary)[1:])
    centre = start + closest * mean

    def widen(k: Any, reach: Any, spread: Any) -> Any:
        cone, _, some = one(k)
        on = closest - cone.waist
        far = dr.norm(cone.centre + on * cone.axis - centre) + cone.reach + abs(on) * cone.spread
        reach = dr.select(some > 0, dr.maximum(reach, far), reach)
        return k + 1, reach, dr.select(some > 0, dr.maximum(spread, dr.norm(cone.axis - axis) + cone.spread), spread)

    _, reach, spread = dr.while_loop((zero, types.Float(-1), types.Float(-1)), more, widen)
    return Cone(centre, reach, axis, spread, closest).rows(types)
