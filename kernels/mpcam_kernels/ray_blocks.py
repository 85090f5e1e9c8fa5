"""The rays of a camera's pixels: blocks of pixels, groups of blocks, and what bounds the rays in each.

A group is a square of 4 x 8 blocks, 64 pixels along a side, some of which may hold no pixel. It is bounded as one large
block: so one thread can tell, for a triangle, which blocks of the group it may cover.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.linear_fit import Channel
from mpcam_kernels.samples import HEIGHT, WIDTH

COLUMNS, ROWS = 4, 8  # blocks of a group
GROUP = COLUMNS * ROWS
SIDE = COLUMNS * WIDTH  # pixels along the sides of a group
_HALF = 0.5 * (SIDE - 1)


@dataclass(frozen=True)
class RayBlocks:
    """The rays of a camera's pixels by slot, and what bounds them.

    rays: zero where a slot has no pixel. cones, slopes: of each block. group_cones, group_slopes: of each group. first,
    count: blocks of each group. numbers: GROUP numbers a group, of the block at each of its places (column + COLUMNS
    row). exist: which of these places have a block, as bits. parts: which parts of each block hold pixels, as bits.
    runs: runs of `pixels.PER_THREAD` slots that hold pixels, by number. corners: first column and row of each block.
    planes: what bounds images there (see `planes.Planes`), or None.

    Rays, cones and slopes are those of `general_rays`, of `central_rays` or of `ray_pieces`.
    """

    rays: Any
    cones: Any
    slopes: Any
    group_cones: Any
    group_slopes: Any
    first: Any
    count: Any
    numbers: Any
    exist: Any
    parts: Any
    runs: Any
    corners: tuple[Any, Any]
    planes: Any


def place_in_group(corners: tuple[Any, Any]) -> Any:
    """The place of blocks in their group, from the first column and row of each, counted from the group's."""
    x, y = corners
    return (y % SIDE) // HEIGHT * COLUMNS + (x % SIDE) // WIDTH


def _middle(types: Any, place: Any) -> tuple[Any, Any]:
    """Where the middle of a block lies in its group, from -1 to 1 along both sides."""
    x, y = types.Float(place % COLUMNS) * WIDTH, types.Float(place // COLUMNS) * HEIGHT
    return (x + 0.5 * (WIDTH - 1) - _HALF) / _HALF, (y + 0.5 * (HEIGHT - 1) - _HALF) / _HALF


_WIDE, _HIGH = 0.5 * (WIDTH - 1) / _HALF, 0.5 * (HEIGHT - 1) / _HALF  # a block's half sides in those of its group


def group_bounds(types: Any, slopes: Any, corners: tuple[Any, Any], first: Any, count: Any) -> list[Any]:
    """Rows of the slopes of groups, from those of their blocks: slopes are means, the middles fit them."""
    zero, empty = types.UInt(0), types.Array3f(0)

    def more(k: Any, *_: Any) -> Any:
        return k < count

    def one(k: Any) -> tuple[list[Channel], Any, Any, Any, Any]:
        """Channels and ball of a block, where its middle is, and whether it has rays."""
        number = first + k
        x, y = (dr.gather(types.UInt, values, number) for values in corners)
        channels, ball = slopes.at(types, number)
        return channels, ball, *_middle(types, place_in_group((x, y))), channels[0].off >= 0

    def add(k: Any, n: Any, right: list[Any], down: list[Any], center: Any) -> Any:
        channels, ball, _, _, exists = one(k)
        some = dr.select(exists, types.Float(1), 0)
        right = [a + c.right * (some / _WIDE) for a, c in zip(right, channels, strict=True)]
        down = [a + c.down * (some / _HIGH) for a, c in zip(down, channels, strict=True)]
        return k + 1, n + some, right, down, center if ball is None else center + ball[0] * some

    many = type(slopes).CHANNELS
    state = (zero, types.Float(0), [empty] * many, [empty] * many, empty)
    _, n, right, down, center = dr.while_loop(state, more, add)
    inverse = 1.0 / dr.maximum(n, 1)
    right, down, center = [a * inverse for a in right], [a * inverse for a in down], center * inverse

    def fit(k: Any, middle: list[Any]) -> Any:
        channels, _, s, t, exists = one(k)
        lines = zip(middle, channels, right, down, strict=True)
        return k + 1, [m + dr.select(exists, c.middle - s * a - t * b, 0) for m, c, a, b in lines]

    middle = [m * inverse for m in dr.while_loop((zero, [empty] * many), more, fit)[1]]

    def widen(k: Any, off: list[Any], radius: Any) -> Any:
        channels, ball, s, t, exists = one(k)
        wider = []
        for most, c, m, a, b in zip(off, channels, middle, right, down, strict=True):
            far = dr.norm(c.middle - m - s * a - t * b) + dr.norm(c.right - a * _WIDE) + dr.norm(c.down - b * _HIGH)
            wider.append(dr.select(exists, dr.maximum(most, (far + c.off) * (1 + 1e-6) + 1e-7), most))
        if ball is not None:
            radius = dr.select(exists, dr.maximum(radius, dr.norm(ball[0] - center) + ball[1]), radius)
        return k + 1, wider, radius

    _, off, radius = dr.while_loop((zero, [types.Float(-1)] * many, types.Float(-1)), more, widen)
    channels = [Channel(*row) for row in zip(middle, right, down, off, strict=True)]
    return slopes.packed(types, channels, (center, radius))


def blocks_covered(types: Any, shape: Any, slopes: Any, group: Any) -> Any:
    """Which blocks of groups triangles may cover, as bits by place."""
    edges, front, back = slopes.edges(types, shape, group)
    # One number per edge tells how far a block reaches beyond its middle.
    reach = [slack + abs(right) * _WIDE + abs(down) * _HIGH for _, right, down, slack in edges]
    bits = types.UInt(0)
    for place in range(GROUP):
        s = ((place % COLUMNS) * WIDTH + 0.5 * (WIDTH - 1) - _HALF) / _HALF
        t = ((place // COLUMNS) * HEIGHT + 0.5 * (HEIGHT - 1) - _HALF) / _HALF
        positive, negative = front, back
        for (middle, right, down, _), far in zip(edges, reach, strict=True):
            value = dr.fma(right, s, dr.fma(down, t, middle))
            positive, negative = positive & (value + far >= 0), negative & (value - far <= 0)
        bits |= dr.select(positive | negative, types.UInt(1 << place), 0)
    return bits
