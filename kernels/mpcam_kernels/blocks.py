"""Large triangles and blocks of pixels: which blocks each one may cover, and block by block which triangles.

Coarse squares are looked at first, then the blocks in those that a triangle may cover. A block's list says of each of
its triangles also which parts of the block it may cover.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import regions
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import COARSE, HEIGHT, PART, PARTS, WIDTH, Samples

LANES_WANTED = 1 << 14  # the rows of a triangle's squares are shared among lanes until there are about so many
LEAST_SHARE = 4
BLOCKS = COARSE // HEIGHT  # in a coarse square, above each other


@dataclass(frozen=True)
class Large:
    """Large triangles: per item the region and the triangle's number (see `regions.pack`), per triangle the set-up.

    setups: an array for each of its rows, or `Rows`.
    """

    regions: list[Any]
    setups: Any
    count: Any


@dataclass(frozen=True)
class Squares:
    """Items and the coarse squares that they may cover."""

    items: Any
    squares: Any
    found: Any


@dataclass(frozen=True)
class Pairs:
    """Names of triangles, blocks that they may cover, which parts of these, and the rank in the block's list.

    counts: pairs of each block. found: how many pairs there are, if the arrays have more room.
    """

    names: Any
    blocks: Any
    parts: Any
    ranks: Any
    counts: Any
    found: Any = None


@dataclass(frozen=True)
class Lists:
    """Block by block the names of triangles and the parts of the block, in pairs; where lists start, their lengths."""

    entries: Any
    starts: Any
    counts: Any


def append(types: Any, test: Any, area: regions.Region, shape: Any, triangle: Any, active: Any, large: Large) -> None:
    """Add triangles to the list."""
    slot = dr.scatter_inc(large.count, types.UInt(0), active)
    for target, row in zip(large.regions, regions.pack(types, area, triangle), strict=True):
        dr.scatter(target, row, slot, active)
    for target, row in zip(large.setups, test.pack(types, shape), strict=True):
        dr.scatter(target, row, triangle, active)


def set_up(types: Any, test: Any, large: Large, triangle: Any) -> Any:
    """The set-up of triangles by number."""
    if isinstance(large.setups, Rows):
        return test.unpack(large.setups.at(types, triangle))
    return test.unpack([dr.gather(types.Array4f, row, triangle) for row in large.setups])


def _unpacked(types: Any, test: Any, large: Large, item: Any) -> tuple[regions.Region, Any, Any]:
    """Region, triangle and set-up of items."""
    area, triangle = regions.unpack(types, [dr.gather(types.Array4f, row, item) for row in large.regions])
    return area, triangle, set_up(types, test, large, triangle)


def share(items: int, columns: int, rows: int, most: int) -> int:
    """Lanes for the rows of one triangle's squares, a power of two; one lane finds at most `most` of them."""
    lanes = LEAST_SHARE
    while lanes < rows and (lanes * items < LANES_WANTED or -(-rows // lanes) * columns > most):
        lanes *= 2
    return lanes


def find_squares(
    types: Any, test: Any, lanes: Any, per_item: int, samples: Samples, large: Large, columns: int, most: int
) -> Squares:
    """Coarse squares that may have a hit of an item. Those beyond `most` are counted, but not kept."""
    item, first = lanes // per_item, types.Int(lanes % per_item)
    area, _, shape = _unpacked(types, test, large, item)
    bottom = (area.y1 + (COARSE - 1)) // COARSE
    found = dr.zeros(types.UInt, 1)
    dr.make_opaque(found)
    result = Squares(dr.empty(types.UInt, most), dr.empty(types.UInt, most), found)
    spans = area.spans(types)

    def extent(row: Any) -> tuple[Any, Any]:
        top, last = dr.maximum(row * COARSE, area.y0), dr.minimum(row * COARSE + COARSE, area.y1) - 1
        start, stop = spans(top, last)
        return start // COARSE, dr.select(start < stop, (stop + (COARSE - 1)) // COARSE, 0)

    def body(column: Any, end: Any, row: Any) -> Any:
        square = types.UInt(row * columns + column)
        keep = (column < end) & test.may_hit(shape, *samples.coarse(types, square, column < end))
        slot: Any = dr.scatter_inc(found, types.UInt(0), keep)
        keep &= slot < most
        dr.scatter(result.items, item, slot, keep)
        dr.scatter(result.squares, square, slot, keep)
        ended = column + 1 >= end
        start, stop = extent(row + per_item)
        return dr.select(ended, start, column + 1), dr.select(ended, stop, end), dr.select(ended, row + per_item, row)

    row = area.y0 // COARSE + first
    start, stop = extent(row)
    dr.while_loop((start, stop, row), lambda column, end, row: row < bottom, body)
    return result


def find_pairs(
    types: Any,
    test: Any,
    lanes: Any,
    samples: Samples,
    large: Large,
    grid: tuple[int, int],
    squares: Squares,
    most: int,
    by_item: bool,
) -> Pairs:
    """Blocks that may have a hit: a lane for each square and block in it. `most`: room for one of every lane.

    by_item: name triangles by their item, else by their own number.
    """
    columns, rows = grid
    number, k = lanes // BLOCKS, lanes % BLOCKS
    item, square = (dr.gather(types.UInt, values, number) for values in (squares.items, squares.squares))
    area, triangle, shape = _unpacked(types, test, large, item)
    x, y = square % columns, (square // columns) * BLOCKS + k
    block, exists = y * columns + x, y < rows
    spans, bits = area.spans(types), types.UInt(0)
    for part in range(PARTS):
        left = types.Int(x * WIDTH) + (part % 4) * PART
        top = types.Int(y * HEIGHT) + (part // 4) * PART
        first, last = dr.maximum(top, area.y0), dr.minimum(top + PART, area.y1) - 1
        start, stop = spans(first, last)
        reached = exists & (first <= last) & (start < left + PART) & (stop > left) & (start < stop)
        keep = reached & test.may_hit(shape, *samples.parts(types, block * PARTS + part, exists))
        bits |= dr.select(keep, types.UInt(1 << part), 0)
    counts, found = dr.zeros(types.UInt, columns * rows), dr.zeros(types.UInt, 1)
    dr.make_opaque(counts, found)
    slot: Any = dr.scatter_inc(found, types.UInt(0), bits != 0)
    rank = dr.scatter_inc(counts, block, bits != 0)
    names, numbers, parts, ranks = (dr.empty(types.UInt, most) for _ in range(4))
    columns = ((names, item if by_item else triangle), (numbers, block), (parts, bits), (ranks, rank))
    for target, value in columns:
        dr.scatter(target, value, slot, bits != 0)
    return Pairs(names, numbers, parts, ranks, counts, found)


def list_pairs(types: Any, lanes: Any, pairs: Pairs, lists: Lists) -> Lists:
    """Fill the lists, whose starts and counts are known; there may be more lanes than pairs."""
    active = True if pairs.found is None else lanes < dr.gather(types.UInt, pairs.found, 0)
    columns = (pairs.names, pairs.blocks, pairs.parts, pairs.ranks)
    name, block, parts, rank = (dr.gather(types.UInt, column, lanes, active) for column in columns)
    slot = dr.gather(types.UInt, lists.starts, block, active) + rank
    dr.scatter(lists.entries, types.Array2u(name, parts), slot, active)
    return lists
