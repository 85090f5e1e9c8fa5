"""Large triangles and blocks of pixels: which blocks each one may cover, and block by block which triangles.

Coarse squares are looked at first, then the blocks in those that a triangle may cover. A block's list says of each of
its triangles also which parts of the block it may cover. Lists are chains, so that the pass that finds their entries
can link them too: nothing is counted, sorted or moved.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import regions
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import COARSE, HEIGHT, PART, PARTS, WIDTH, Samples

THREADS_WANTED = 1 << 14  # the rows of a triangle's squares are shared among threads until there are about so many
LEAST_SHARE = 4
LINK = 1 << PARTS
MOST = (1 << 32) // LINK - 1  # entries that can be numbered
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
class Lists:
    """Which triangles each block may hold, as chains of entries: one pass builds them, in any order.

    entries: two numbers each: the name of a triangle, and LINK * the number of the block's next entry + the parts of
    the block, as bits. heads: the number of each block's first entry. Numbers count from 1; 0 ends a chain.
    """

    entries: Any
    heads: Any

    def add(self, types: Any, number: Any, block: Any, name: Any, parts: Any, active: Any) -> None:
        """Make the entries of these numbers, from 0 to MOST - 1, the first of their blocks."""
        following: Any = dr.scatter_exch(self.heads, number + 1, block, active)
        dr.scatter(self.entries, types.Array2u(name, following * LINK + parts), number, active)

    def first(self, types: Any, block: Any) -> Any:
        """Number of the first entry of blocks; 0: none."""
        return dr.gather(types.UInt, self.heads, block)

    def name(self, types: Any, number: Any) -> Any:
        """Name of the triangle of an entry."""
        return dr.gather(types.UInt, self.entries, 2 * number - 2)

    def link(self, types: Any, number: Any) -> Any:
        """The entry's second number; 0 beyond the end."""
        return dr.gather(types.UInt, self.entries, 2 * number - 1, number > 0)


def room(types: Any, entries: int, blocks: int) -> Lists:
    """Empty lists of so many blocks."""
    heads = dr.zeros(types.UInt, blocks)
    dr.make_opaque(heads)
    return Lists(dr.empty(types.UInt, 2 * entries), heads)


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
    """Threads for the rows of one triangle's squares, a power of two; one thread finds at most `most` of them."""
    threads = LEAST_SHARE
    while threads < rows and (threads * items < THREADS_WANTED or -(-rows // threads) * columns > most):
        threads *= 2
    return threads


def find_squares(
    types: Any, test: Any, threads: Any, per_item: int, samples: Samples, large: Large, columns: int, most: int
) -> Squares:
    """Coarse squares that may have a hit of an item. Those beyond `most` are counted, but not kept."""
    item, first = threads // per_item, types.Int(threads % per_item)
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


def list_blocks(
    types: Any,
    test: Any,
    threads: Any,
    samples: Samples,
    large: Large,
    grid: tuple[int, int],
    squares: Squares,
    lists: Lists,
    by_item: bool,
) -> Lists:
    """Lists of the blocks that may have a hit: a thread for each square and block in it.

    by_item: name triangles by their item, else by their own number.
    """
    columns, rows = grid
    number, k = threads // BLOCKS, threads % BLOCKS
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
    lists.add(types, threads, block, item if by_item else triangle, bits, bits != 0)
    return lists
