"""Least and largest depth in squares of a depth image, and around them: what rays may pass at a distance.

Level 0 has squares of a few pixels, each level four times larger ones. What is kept of a square is the range over it
and its eight neighbors: a stretch of a ray whose middle lies in the square, no longer than twice its side, stays in
there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.depth_patches import unpacked

FACTOR = 4
"""Squares of a level are so many times larger than those of the one before."""
MOST_LEVELS = 6


@dataclass(frozen=True)
class Levels:
    """The squares of an image. side: pixels along those of level 0. counts: columns and rows of each level."""

    side: int
    counts: tuple[tuple[int, int], ...]

    @staticmethod
    def of(width: int, height: int, side: int) -> "Levels":
        """Levels up to one whose square is as large as the image."""
        counts, size = [], side
        while len(counts) < MOST_LEVELS:
            counts.append((-(-width // size), -(-height // size)))
            if size >= max(width, height) or len(counts) == MOST_LEVELS:
                break
            size *= FACTOR
        return Levels(side, tuple(counts))

    @property
    def starts(self) -> list[int]:
        """Number of the first square of each level, and of all."""
        starts = [0]
        for columns, rows in self.counts:
            starts.append(starts[-1] + columns * rows)
        return starts


def of_pixels(
    types: Any, tile: Any, patches: Any, size: tuple[int, int], side: int, point_at: Callable[[Any, Any, Any], Any]
) -> tuple[Any, Any, Any]:
    """Range of the patches of squares of level 0 by number, an Array2f, and the box around their points.

    size: width and height of the image. point_at(pixel, depth, active): where a pixel's ray is at a depth.
    """
    width, height = size
    columns = -(-width // side)
    left, top = (tile % columns) * side, (tile // columns) * side

    def add(k: Any, least: Any, most: Any, low: Any, high: Any) -> Any:
        x, y = left + k % side, top + k // side
        inside = (x < width) & (y < height)
        pixel = y * width + x
        patch = unpacked(types, dr.gather(types.Array4f, patches, pixel, inside))
        near, far = patch.bounds()
        there = inside & dr.isfinite(patch.depth)
        for depth in (near, far):
            point = point_at(pixel, depth, there)
            low = dr.select(there, dr.minimum(low, point - patch.footprint), low)
            high = dr.select(there, dr.maximum(high, point + patch.footprint), high)
        least, most = dr.select(there, dr.minimum(least, near), least), dr.select(there, dr.maximum(most, far), most)
        return k + 1, least, most, low, high

    nothing = types.Array3f(dr.inf), types.Array3f(-dr.inf)
    state = (types.UInt(0), types.Float(dr.inf), types.Float(-dr.inf), *nothing)
    _, least, most, low, high = dr.while_loop(state, lambda k, *_: k < side * side, add)
    return types.Array2f(least, most), low, high


def joined(types: Any, tile: Any, ranges: Any, of: tuple[int, int], columns: int) -> Any:
    """Ranges of squares of the next level, which has so many columns; of: columns and rows of the level of `ranges`."""
    left, top = (tile % columns) * FACTOR, (tile // columns) * FACTOR
    return _around(types, ranges, of, types.Int(left), types.Int(top), FACTOR)


def widened(types: Any, tile: Any, ranges: Any, of: tuple[int, int]) -> Any:
    """Ranges over squares and their neighbors."""
    columns, _ = of
    left, top = types.Int(tile % columns) - 1, types.Int(tile // columns) - 1
    return _around(types, ranges, of, left, top, 3)


def _around(types: Any, ranges: Any, of: tuple[int, int], left: Any, top: Any, side: int) -> Any:
    columns, rows = of
    found = types.Array2f(dr.inf, -dr.inf)
    for j in range(side):
        for i in range(side):
            x, y = left + i, top + j
            inside = (x >= 0) & (y >= 0) & (x < columns) & (y < rows)
            low, high = dr.gather(types.Array2f, ranges, types.UInt(y * columns + x), inside)
            found.x = dr.select(inside, dr.minimum(found.x, low), found.x)
            found.y = dr.select(inside, dr.maximum(found.y, high), found.y)
    return found
