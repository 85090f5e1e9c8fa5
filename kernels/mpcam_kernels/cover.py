"""Pairs of a block and a triangle: which slots of the block the triangle may cover, from the block's linear rays.

The side on which a ray passes an edge is linear in what is kept of the ray, which is linear in the position but for a
known rest: so each edge is a line in the block, moved outwards by what the rest can amount to.
"""

from typing import Any

import drjit as dr

from mpcam_kernels import walk
from mpcam_kernels.blocks import Lists
from mpcam_kernels.regions import Region
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import HEIGHT, PARTS, PIXELS, WIDTH, in_block

SMALL = 16  # slots between the lines that one thread walks by itself
WIDE, HIGH = 0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1)


def covered(
    types: Any, test: Any, thread: Any, rays: Any, setups: Rows, pairs: Any, walking: bool, room: int, lists: Lists
) -> tuple[Any, Lists]:
    """Lists of the triangles of pairs by block, and with `walking` which pairs are small enough for a thread to walk.

    rays: `RayBlocks`. room: pairs at a time, of which `thread` has some.
    """
    block, triangle = pairs.at(thread)
    shape = test.unpack(setups.at(types, triangle))
    edges, front, back = rays.slopes.edges(types, shape, block)
    bits, small = _parts(types, edges, front, back) & dr.gather(types.UInt, rays.parts, block), types.Bool(False)
    some = bits != 0
    if walking:
        _, _, slots = _box(types, _lines(types, edges, front))
        small = some & ~(front & back) & (slots <= SMALL)
        some, small = some & ~small, small & (slots > 0)
    lists.add(types, thread % room, block, triangle, bits, some)
    return small, lists


def walk_small(
    types: Any,
    test: Any,
    output: Any,
    number: Any,
    rays: Any,
    slopes: Any,
    setups: Rows,
    pairs: Any,
    buffer: Any,
    count: bool,
) -> tuple[Any, Any]:
    """Raise `buffer` to the keys of small pairs by number; returns tests and hits of each thread."""
    block, triangle = pairs.at(number)
    shape = test.unpack(setups.at(types, triangle))
    edges, front, _ = slopes.edges(types, shape, block)
    lines = _lines(types, edges, front)
    columns, rows, _ = _box(types, lines)
    area = Region(columns[0], rows[0], columns[1], rows[1], lines)

    def slot(x: Any, y: Any) -> Any:
        return block * PIXELS + in_block(x, y)

    return walk.walk(types, test, output, shape, shape.name, area, types.Bool(True), rays, slot, buffer, count)


def _lines(types: Any, edges: list[Any], front: Any) -> tuple[Any, Any, Any]:
    """Lines around the slots that triangles may cover of which rays start on one side only (see `regions`)."""
    sign, lines = dr.select(front, types.Float(1), -1), []
    for middle, right, down, slack in edges:
        a, b = sign * right * (1 / WIDE), sign * down * (1 / HIGH)
        c = sign * middle + slack - a * (0.5 * WIDTH) - b * (0.5 * HEIGHT)
        length = dr.sqrt(a * a + b * b)
        scale = 1.0 / dr.maximum(length, 1e-30)
        lines.append(types.Array3f(a * scale, b * scale, c * scale + 1e-3))
    return lines[0], lines[1], lines[2]


def _box(types: Any, lines: tuple[Any, Any, Any]) -> tuple[tuple[Any, Any], tuple[Any, Any], Any]:
    """Columns and rows between three lines, first and one past the last, and how many slots they have.

    The box is that of the lines' three corners; where two are nearly parallel it is the whole block.
    """
    left, right, top, bottom = types.Float(dr.inf), types.Float(-dr.inf), types.Float(dr.inf), types.Float(-dr.inf)
    one_way, other_way = types.Bool(True), types.Bool(True)
    for i in range(3):
        p, q = lines[i], lines[(i + 1) % 3]
        turn = p.x * q.y - p.y * q.x
        one_way, other_way = one_way & (turn > 1e-3), other_way & (turn < -1e-3)
        inverse = 1.0 / turn
        x, y = (p.y * q.z - q.y * p.z) * inverse, (q.x * p.z - p.x * q.z) * inverse
        left, right, top, bottom = dr.minimum(left, x), dr.maximum(right, x), dr.minimum(top, y), dr.maximum(bottom, y)
    proper = one_way | other_way

    def ends(low: Any, high: Any, side: int) -> tuple[Any, Any]:
        first, last = dr.ceil(dr.maximum(low - 0.51, 0.0)), dr.floor(dr.minimum(high + 0.51, float(side)))
        first, last = dr.select(proper, first, 0.0), dr.select(proper, last, float(side))
        return types.Int(dr.minimum(first, float(side))), types.Int(dr.maximum(last, 0.0))

    columns, rows = ends(left, right, WIDTH), ends(top, bottom, HEIGHT)
    return columns, rows, dr.maximum(columns[1] - columns[0], 0) * dr.maximum(rows[1] - rows[0], 0)


def _parts(types: Any, edges: list[Any], front: Any, back: Any) -> Any:
    """A bit for each part of a block that no edge excludes."""
    bits = types.UInt(0)
    for part in range(PARTS):
        s, t = ((part % 4) * 4 + 1.5 - WIDE) / WIDE, ((part // 4) * 4 + 1.5 - HIGH) / HIGH
        positive, negative = front, back
        for middle, right, down, slack in edges:
            value = dr.fma(right, s, dr.fma(down, t, middle))
            reach = slack + abs(right) * (1.5 / WIDE) + abs(down) * (1.5 / HIGH)
            positive, negative = positive & (value + reach >= 0), negative & (value - reach <= 0)
        bits |= dr.select(positive | negative, types.UInt(1 << part), 0)
    return bits
