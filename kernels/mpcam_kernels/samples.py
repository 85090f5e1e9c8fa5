"""Per-pixel samples, kept block by block, and bounds of the blocks.

Blocks of 16 x 8 pixels follow each other row by row. Within a block come its eight parts of 4 x 4, and there the pixels
row by row: the pixels that one triangle covers lie close together in memory. Blocks at the right and lower border may
hold slots without a pixel.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

WIDTH, HEIGHT = 16, 8  # pixels of a block
PART = 4  # pixels along a side of the parts of a block
PARTS = WIDTH * HEIGHT // (PART * PART)
COARSE = 16  # pixels along a side of the squares that are looked at first
PIXELS = WIDTH * HEIGHT
NOWHERE = -1e9  # image coordinate that no triangle covers


@dataclass(frozen=True)
class Samples:
    """One sample per slot (ray directions or pixel centers), and bounds of the samples of squares of pixels.

    coarse: bounds of squares of COARSE pixels, row by row; parts: of the parts of the blocks, in the order of slots.
    """

    pixels: Any
    coarse: "Bounds"
    parts: "Bounds"

    def at(self, types: Any, slot: Any, active: Any = True) -> Any:
        """Samples by slot."""
        return dr.gather(type(self.pixels), self.pixels, slot, active)

    def run(self, types: Any, first: Any, count: int) -> list[Any]:
        """Samples of `count` slots, a multiple of four, from a multiple of four on."""
        fours = [first // 4 + k for k in range(count // 4)]
        groups = [[dr.gather(types.Array4f, component, at) for component in self.pixels] for at in fours]
        return [type(self.pixels)(*(component[k] for component in group)) for group in groups for k in range(4)]


@dataclass(frozen=True)
class Bounds:
    """Samples of squares: center + s right + t down, s and t from -1 to 1, and no more than `spread` off.

    rows: arrays of four numbers a square: center and spread; right; down. Without the last two, they are zero. The
    spread is negative where no pixel is valid.
    """

    rows: list[Any]

    def __call__(self, types: Any, number: Any, active: Any = True) -> tuple[Any, Any, Any, Any]:
        """Center, right, down and spread of squares by number."""
        first, *tilt = (dr.gather(types.Array4f, row, number, active) for row in self.rows)
        right, down = (row.xyz for row in tilt) if tilt else (types.Array3f(0), types.Array3f(0))
        return first.xyz, right, down, first.w


def blocks(width: int, height: int) -> tuple[int, int]:
    """Columns and rows of blocks in an image."""
    return -(-width // WIDTH), -(-height // HEIGHT)


def in_block(x: Any, y: Any) -> Any:
    """Slot within its block of a column and a row of it."""
    return (y >> 2) << 6 | (x >> 2) << 4 | (y & 3) << 2 | (x & 3)


def of_block(slot: Any) -> tuple[Any, Any]:
    """Column and row, within its block, of a slot."""
    return ((slot >> 4) & 3) * 4 + (slot & 3), ((slot >> 6) & 1) * 4 + ((slot >> 2) & 3)


def slot_of(x: Any, y: Any, width: int) -> Any:
    """Slot of a pixel in block order."""
    block = (y // HEIGHT) * (-(-width // WIDTH)) + x // WIDTH
    part = ((y >> 2) & 1) * 4 + ((x >> 2) & 3)
    return block * PIXELS + (part << 4) + ((y & 3) << 2) + (x & 3)


def slots_of(pixel: Any, width: int) -> Any:
    """Slots of pixels that are numbered row by row."""
    return slot_of(pixel % width, pixel // width, width)


def pixel_of(types: Any, index: Any, width: int, height: int) -> tuple[Any, Any, Any]:
    """Column and row of a slot, and whether there is a pixel."""
    columns, _ = blocks(width, height)
    block, part = index // PIXELS, (index >> 4) & 7
    x = (block % columns) * WIDTH + ((part & 3) << 2) + (index & 3)
    y = (block // columns) * HEIGHT + ((part >> 2) << 2) + ((index >> 2) & 3)
    return x, y, (x < width) & (y < height)


def pixel_centers(types: Any, width: int, height: int) -> Any:
    """(u, v) of every pixel's center, row by row; the top left pixel's is (0.5, 0.5)."""
    pixel = dr.arange(types.UInt, width * height)
    return types.Array2f(types.Float(pixel % width) + 0.5, types.Float(pixel // width) + 0.5)


def central_samples(types: Any, direction: Any, valid: Any, width: int, height: int) -> Samples:
    """Directions of rays, given row by row; zero, which hits nothing, where a pixel has none."""
    columns, rows = blocks(width, height)
    index = dr.arange(types.UInt, columns * rows * PIXELS)
    x, y, exists = pixel_of(types, index, width, height)
    known = dr.select(valid, types.Array3f(direction), 0.0)
    pixels = dr.gather(types.Array3f, known, y * width + x, exists)
    dr.eval(pixels)
    return Samples(pixels, *(_bounds(types, pixels, *square) for square in _squares(types, width, height)))


def planar_samples(types: Any, valid: Any, width: int, height: int) -> Samples:
    """Pixel centers themselves; NOWHERE where a pixel (given row by row) is not valid."""
    columns, rows = blocks(width, height)
    index = dr.arange(types.UInt, columns * rows * PIXELS)
    x, y, exists = pixel_of(types, index, width, height)
    usable = dr.gather(types.Bool, valid, y * width + x, exists)
    pixels = dr.select(usable, types.Array2f(types.Float(x), types.Float(y)) + 0.5, NOWHERE)
    dr.eval(pixels)
    squares = []
    for x, y, side, _ in _squares(types, width, height):
        half = 0.5 * (side - 1)
        center = types.Array4f(types.Float(x) + 0.5 * side, types.Float(y) + 0.5 * side, 0, 0)
        squares.append(_flat(center, types.Array4f(half, 0, 0, 0), types.Array4f(0, half, 0, 0)))
    return Samples(pixels, *squares)


def _squares(types: Any, width: int, height: int) -> list[tuple[Any, Any, int, int]]:
    """Left and upper pixel of the coarse squares and of the parts, their side, and the width of the image."""
    columns, rows = -(-width // COARSE), -(-height // COARSE)
    coarse = dr.arange(types.UInt, columns * rows)
    count = blocks(width, height)[0] * blocks(width, height)[1] * PIXELS // (PART * PART)
    x, y, _ = pixel_of(types, dr.arange(types.UInt, count) * (PART * PART), width, height)
    return [((coarse % columns) * COARSE, (coarse // columns) * COARSE, COARSE, width), (x, y, PART, width)]


def _flat(*rows: Any) -> Bounds:
    """Bounds from rows of four numbers."""
    empty = 0 * rows[0]
    flat = [dr.ravel(row + empty) for row in rows]
    dr.eval(flat)
    return Bounds(flat)


def _bounds(types: Any, pixels: Any, left: Any, top: Any, side: int, width: int) -> Bounds:
    """Bounds of the valid pixels of squares, by the mean and, for small ones, the slopes of a plane through them."""
    tilted = side <= PART  # the larger ones only choose among the small
    count, zero = dr.width(left), dr.zeros(types.UInt, dr.width(left))
    last, half, many = dr.width(pixels) - 1, 0.5 * (side - 1), side * side

    def sample(k: Any) -> tuple[Any, Any, Any, Any]:
        x, y = left + k % side, top + k // side
        within = (x < -(-width // WIDTH) * WIDTH) & (slot_of(x, y, width) <= last)
        s, t = (types.Float(k % side) - half) / half, (types.Float(k // side) - half) / half
        d = dr.gather(types.Array3f, pixels, slot_of(x, y, width), within)
        return d, s, t, dr.squared_norm(d) > 0

    def add(k: Any, total: Any, found: Any) -> Any:
        d, _, _, valid = sample(k)
        return k + 1, total + d, found + dr.select(valid, types.Float(1), 0)

    def tilt(k: Any, right: Any, down: Any) -> Any:
        d, s, t, valid = sample(k)
        away = dr.select(valid, d - center, 0)
        return k + 1, right + s * away, down + t * away

    def widen(k: Any, spread: Any) -> Any:
        d, s, t, valid = sample(k)
        return k + 1, dr.select(valid, dr.maximum(spread, dr.norm(d - center - s * right - t * down)), spread)

    def all_samples(k: Any, *_: Any) -> Any:
        return k < many

    nothing = dr.zeros(types.Array3f, count)
    _, total, found = dr.while_loop((zero, nothing, types.Float(0)), all_samples, add)
    center = total / dr.maximum(found, 1)
    right, down = nothing, nothing
    if tilted:
        _, right, down = dr.while_loop((zero, nothing, nothing), all_samples, tilt)
        squares = sum((k % side - half) ** 2 for k in range(many)) / half**2
        right, down = right / squares, down / squares
    _, spread = dr.while_loop((zero, dr.full(types.Float, -1.0, count)), all_samples, widen)
    rows = [types.Array4f(*row, w) for row, w in ((center, spread), (right, 0), (down, 0))]
    return _flat(*(rows if tilted else rows[:1]))
