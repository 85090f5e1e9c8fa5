"""Per-pixel samples, kept block by block, and bounds of the blocks.

Blocks of 8 x 8 pixels follow each other row by row, and so do the pixels in a block: the pixels that one triangle
covers lie close together in memory. Blocks at the right and lower border may hold places without a pixel.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

BLOCK = 8
NOWHERE = -1e9  # image coordinate that no triangle covers


@dataclass(frozen=True)
class Samples:
    """One sample per place (ray directions or pixel centres), and per block its centre and the spread around it.

    spread is negative for blocks without a valid pixel.
    """

    pixels: Any
    centres: Any
    spreads: Any


def blocks(width: int, height: int) -> tuple[int, int]:
    """Columns and rows of blocks in an image."""
    return -(-width // BLOCK), -(-height // BLOCK)


def place(x: Any, y: Any, width: int) -> Any:
    """Place of a pixel in block order."""
    block = (y // BLOCK) * (-(-width // BLOCK)) + x // BLOCK
    return block * (BLOCK * BLOCK) + (y % BLOCK) * BLOCK + x % BLOCK


def places(types: Any, width: int, height: int) -> Any:
    """Place of every pixel, row by row."""
    pixel = dr.arange(types.UInt, width * height)
    return place(pixel % width, pixel // width, width)


def pixel_of(types: Any, index: Any, width: int, height: int) -> tuple[Any, Any, Any]:
    """Column and row of a place, and whether there is a pixel."""
    columns, _ = blocks(width, height)
    block, within = index // (BLOCK * BLOCK), index % (BLOCK * BLOCK)
    x, y = (block % columns) * BLOCK + within % BLOCK, (block // columns) * BLOCK + within // BLOCK
    return x, y, (x < width) & (y < height)


def pixel_centres(types: Any, width: int, height: int) -> Any:
    """(u, v) of every pixel's centre, row by row; the top left pixel's is (0.5, 0.5)."""
    pixel = dr.arange(types.UInt, width * height)
    return types.Array2f(types.Float(pixel % width) + 0.5, types.Float(pixel // width) + 0.5)


def central_samples(types: Any, direction: Any, valid: Any, width: int, height: int) -> Samples:
    """Directions of rays, given row by row; zero, which hits nothing, where a pixel has none."""
    columns, rows = blocks(width, height)
    index = dr.arange(types.UInt, columns * rows * BLOCK * BLOCK)
    x, y, exists = pixel_of(types, index, width, height)
    known = dr.select(valid, types.Array3f(direction), 0.0)
    pixels = dr.gather(types.Array3f, known, y * width + x, exists)
    dr.eval(pixels)
    centres, spreads = _block_bounds(types, pixels, columns * rows)
    return Samples(pixels, centres, spreads)


def planar_samples(types: Any, valid: Any, width: int, height: int) -> Samples:
    """Pixel centres themselves; NOWHERE where a pixel (given row by row) is not valid."""
    columns, rows = blocks(width, height)
    index = dr.arange(types.UInt, columns * rows * BLOCK * BLOCK)
    x, y, exists = pixel_of(types, index, width, height)
    usable = dr.gather(types.Bool, valid, y * width + x, exists)
    pixels = dr.select(usable, types.Array2f(types.Float(x), types.Float(y)) + 0.5, NOWHERE)
    block = dr.arange(types.UInt, columns * rows)
    centres = (types.Array2f(types.Float(block % columns), types.Float(block // columns)) + 0.5) * BLOCK
    spreads = dr.full(types.Float, 0.5 * (BLOCK - 1), columns * rows)
    dr.eval(pixels, centres, spreads)
    return Samples(pixels, centres, spreads)


def _block_bounds(types: Any, pixels: Any, count: int) -> tuple[Any, Any]:
    """Mean direction of each block's valid pixels, and the largest difference from it (-1 where none is valid)."""
    block = dr.arange(types.UInt, count)
    zero, size = dr.zeros(types.UInt, count), BLOCK * BLOCK

    def direction(k: Any) -> Any:
        return dr.gather(types.Array3f, pixels, block * size + k)

    def add(k: Any, total: Any) -> Any:
        return k + 1, total + direction(k)

    def widen(k: Any, spread: Any) -> Any:
        d = direction(k)
        return k + 1, dr.select(dr.squared_norm(d) > 0, dr.maximum(spread, dr.norm(d - centre)), spread)

    _, total = dr.while_loop((zero, dr.zeros(types.Array3f, count)), lambda k, t: k < size, add)
    length = dr.norm(total)
    centre = dr.select(length > 0, total / dr.maximum(length, 1e-30), types.Array3f(0, 0, 1))
    _, spreads = dr.while_loop((zero, dr.full(types.Float, -1.0, count)), lambda k, s: k < size, widen)
    dr.eval(centre, spreads)
    return centre, spreads
