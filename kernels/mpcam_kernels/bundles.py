"""Bundles of rays that need no common centre: blocks of pixels, groups of blocks, and bounds of the rays in each.

The bounds come from the rays of the pixels themselves, so they hold whatever the camera: directions of mixed signs,
folds, mirrors, lenses.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import HEIGHT, PIXELS, WIDTH
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
    """Bounds of bundles: origins no farther than `reach` from a centre, unit directions no farther than `spread` from
    an axis. rows: (centre, reach), (axis, spread); reach is negative where there is no ray.
    """

    rows: Rows

    @property
    def items(self) -> int:
        """How many there are."""
        return dr.width(self.rows.flat) // (4 * self.rows.count)

    def __call__(self, types: Any, number: Any, active: Any = True) -> tuple[Any, Any]:
        """The two rows of cones by number."""
        first, second = self.rows.at(types, number, active)
        return first, second


def may_meet(cone: tuple[Any, Any], ball: Any) -> Any:
    """False only where no ray of a cone meets a ball (centre and radius; a negative radius: nothing there).

    A point q = o + t d of the ball has |q - centre - t axis| <= reach + t spread, so that some t >= 0 must have
    |ball - centre - t axis| <= reach + radius + t spread: a quadratic inequality.
    """
    first, second = cone
    away, axis, spread = ball.xyz - first.xyz, second.xyz, second.w
    total = first.w + ball.w
    # What rounding can amount to.
    total = dr.fma(total + abs(away.x) + abs(away.y) + abs(away.z), 1e-5, total)
    a = 1.0 - spread * spread
    b = dr.dot(away, axis) + total * spread
    c = dr.squared_norm(away) - total * total
    possible = (c <= 0) | (a <= 1e-3) | ((b > 0) & (b * b >= a * c))
    return possible & (first.w >= 0) & (ball.w >= 0)


def bounds(types: Any, pixels: Rays, block: Any) -> list[Any]:
    """Two rows of the cones and six of the slopes of blocks by number.

    Slopes: direction and moment are centre + s right + t down, s and t from -1 to 1 over the places of the block, and
    no more than a spread off. Rows: (d centre, d spread), (m centre, m spread), (d right, 0), (m right, 0), (d down,
    0), (m down, 0).
    """
    zero, nothing = types.UInt(0), types.Float(0)
    start = block * PIXELS

    def sample(k: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        d, m, o = pixels.at(types, start + k)
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

    def covariances(k: Any, ss: Any, st: Any, tt: Any, ds: Any, dt: Any, ms: Any, mt: Any) -> Any:
        dk, mk, _, sk, tk, valid = sample(k)
        x, y = dr.select(valid, sk - s, 0), dr.select(valid, tk - t, 0)
        away, turn = dk - d, mk - m
        return k + 1, ss + x * x, st + x * y, tt + y * y, ds + away * x, dt + away * y, ms + turn * x, mt + turn * y

    state = (zero, nothing, nothing, nothing, empty, empty, empty, empty)
    _, ss, st, tt, ds, dt, ms, mt = dr.while_loop(state, below, covariances)
    # Least squares, held back where the places of the block lie on a line.
    ss, tt = ss + 1e-3, tt + 1e-3
    solve = 1.0 / (ss * tt - st * st)
    d_right, d_down = (ds * tt - dt * st) * solve, (dt * ss - ds * st) * solve
    m_right, m_down = (ms * tt - mt * st) * solve, (mt * ss - ms * st) * solve
    d_middle, m_middle = d - d_right * s - d_down * t, m - m_right * s - m_down * t
    axis = d * dr.rsqrt(dr.maximum(dr.squared_norm(d), 1e-20))

    def widest(k: Any, reach: Any, spread: Any, d_off: Any, m_off: Any) -> Any:
        dk, mk, ok, sk, tk, valid = sample(k)
        off = dk - d_middle - sk * d_right - tk * d_down
        turn = mk - m_middle - sk * m_right - tk * m_down
        return (
            k + 1,
            dr.select(valid, dr.maximum(reach, dr.norm(ok - o)), reach),
            dr.select(valid, dr.maximum(spread, dr.norm(dk - axis)), spread),
            dr.select(valid, dr.maximum(d_off, dr.norm(off)), d_off),
            dr.select(valid, dr.maximum(m_off, dr.norm(turn)), m_off),
        )

    none = types.Float(-1)
    _, reach, spread, d_off, m_off = dr.while_loop((zero, none, none, none, none), below, widest)
    cones = [types.Array4f(*o, reach), types.Array4f(*axis, spread)]
    slopes = [(d_middle, d_off), (m_middle, m_off), (d_right, 0), (m_right, 0), (d_down, 0), (m_down, 0)]
    return [*cones, *(types.Array4f(*row, last) for row, last in slopes)]


def position(types: Any, place: Any) -> tuple[Any, Any]:
    """Where a place lies in its block, from -1 to 1 along both sides."""
    x = ((place >> 4) & 3) * 4 + (place & 3)
    y = ((place >> 6) & 1) * 4 + ((place >> 2) & 3)
    return (types.Float(x) - 0.5 * (WIDTH - 1)) * (2.0 / (WIDTH - 1)), (types.Float(y) - 0.5 * (HEIGHT - 1)) * (
        2.0 / (HEIGHT - 1)
    )


def joined(types: Any, cones: Cones, first: Any, count: Any) -> list[Any]:
    """Rows of the cones around runs of cones."""
    zero, nothing = types.UInt(0), types.Array3f(0)

    def more(k: Any, *_: Any) -> Any:
        return k < count

    def add(k: Any, n: Any, centre: Any, axis: Any) -> Any:
        a, b = cones(types, first + k)
        one = dr.select(a.w >= 0, types.Float(1), 0)
        return k + 1, n + one, centre + a.xyz * one, axis + b.xyz * one

    _, n, centre, axis = dr.while_loop((zero, types.Float(0), nothing, nothing), more, add)
    centre = centre / dr.maximum(n, 1)
    axis = axis * dr.rsqrt(dr.maximum(dr.squared_norm(axis), 1e-20))

    def widen(k: Any, reach: Any, spread: Any) -> Any:
        a, b = cones(types, first + k)
        some = a.w >= 0
        reach = dr.select(some, dr.maximum(reach, dr.norm(a.xyz - centre) + a.w), reach)
        return k + 1, reach, dr.select(some, dr.maximum(spread, dr.norm(b.xyz - axis) + b.w), spread)

    _, reach, spread = dr.while_loop((zero, types.Float(-1), types.Float(-1)), more, widen)
    return [types.Array4f(*centre, reach), types.Array4f(*axis, spread)]
