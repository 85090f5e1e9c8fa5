"""Per-pixel samples and the bounds of 8 x 8 blocks of them."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from mpcam_kernels.pipeline import BLOCK, Samples


def pixel_centres(types: Any, width: int, height: int) -> Any:
    """(u, v) of every pixel's centre, row by row; the top left pixel's is (0.5, 0.5)."""
    index = dr.arange(types.UInt, width * height)
    return types.Array2f(types.Float(index % width) + 0.5, types.Float(index // width) + 0.5)


def central_samples(types: Any, ray: Callable[[Any], Any], width: int, height: int) -> Samples:
    """Directions of all pixels' rays; zero, which hits nothing, where a pixel has none."""
    _, direction, valid = ray(pixel_centres(types, width, height))
    pixels = dr.select(valid, types.Array3f(direction), 0.0)
    dr.eval(pixels)
    centres, spreads = _blocks(types, pixels, width, height)
    return Samples(pixels, centres, spreads)


def planar_samples(types: Any, width: int, height: int, valid: Any = None) -> Samples:
    """Pixel centres themselves; infinite, which no triangle covers, where `valid` is False."""
    pixels = pixel_centres(types, width, height)
    if valid is not None:
        pixels = dr.select(valid, pixels, -1e9)
    columns, rows = -(-width // BLOCK), -(-height // BLOCK)
    block = dr.arange(types.UInt, columns * rows)
    corner = types.Array2f(types.Float(block % columns), types.Float(block // columns)) * BLOCK
    centres, spreads = corner + 0.5 * BLOCK, dr.full(types.Float, 0.5 * (BLOCK - 1), columns * rows)
    dr.eval(pixels, centres, spreads)
    return Samples(pixels, centres, spreads)


def _blocks(types: Any, pixels: Any, width: int, height: int) -> tuple[Any, Any]:
    """Mean direction of each block's valid pixels, and the largest difference from it (-1 where none is valid)."""
    columns, rows = -(-width // BLOCK), -(-height // BLOCK)
    block = dr.arange(types.UInt, columns * rows)
    left, top = (block % columns) * BLOCK, (block // columns) * BLOCK

    def gather(k: Any) -> tuple[Any, Any]:
        x, y = left + k % BLOCK, top + k // BLOCK
        inside = (x < width) & (y < height)
        direction = dr.gather(types.Array3f, pixels, y * width + x, inside)
        return direction, inside & (dr.squared_norm(direction) > 0)

    def add(k: Any, total: Any) -> Any:
        direction, _ = gather(k)
        return k + 1, total + direction

    def widen(k: Any, spread: Any) -> Any:
        direction, inside = gather(k)
        return k + 1, dr.select(inside, dr.maximum(spread, dr.norm(direction - centre)), spread)

    zero = dr.zeros(types.UInt, columns * rows)
    count = BLOCK * BLOCK
    _, total = dr.while_loop((zero, dr.zeros(types.Array3f, columns * rows)), lambda k, t: k < count, add)
    length = dr.norm(total)
    centre = dr.select(length > 0, total / dr.maximum(length, 1e-30), types.Array3f(0, 0, 1))
    _, spreads = dr.while_loop((zero, dr.full(types.Float, -1.0, columns * rows)), lambda k, s: k < count, widen)
    dr.eval(centre, spreads)
    return centre, spreads
