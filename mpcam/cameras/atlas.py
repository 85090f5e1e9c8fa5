"""Where the camera triangles lie in their common image: right triangles, two in each square cell (Hou 2006, 2.3)."""

import functools
from dataclasses import dataclass

import numpy as np

from mpcam.math import Array, isfinite, take, where, whole

GUTTER = 2
"""A cell has so many pixels more along a side than its triangles: empty ones keep all triangles apart."""
TOLERANCE = 1e-3
"""Pixels that a position may lie outside of its triangle."""


@dataclass(frozen=True, eq=False)
class Atlas:
    """Image places of camera triangles.

    sides: (F,) pixels along the two short sides of each; corners 1, 2 and 3 of a camera triangle are centers of pixels,
    so that neighbors share the rays of their common edge. corners: (F, 2) pixel of corner 1. signs: (F,) 1 where
    corner 2 lies to the right and corner 3 below, -1 where they lie to the left and above.
    """

    sides: np.ndarray
    corners: np.ndarray
    signs: np.ndarray
    width: int
    height: int
    cells: np.ndarray
    """(H, W) number of the cell of each pixel, -1 for none."""
    pairs: np.ndarray
    """(C, 2) camera triangles of each cell: at its upper left and at its lower right, -1 for none."""

    def locate(self, u: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        """Camera triangle, weights of its corners 2 and 3, and whether there is one, of pixel positions.

        Where there is none, the triangle is 0 and the weights are 0.
        """
        finite = isfinite(u) & isfinite(v)
        inside = finite & (u >= 0) & (v >= 0) & (u < self.width) & (v < self.height)
        u, v = where(inside, u, 0.5), where(inside, v, 0.5)
        cell = take(self.cells.ravel(), whole(v) * self.width + whole(u))
        inside = inside & (cell >= 0)
        cell = where(cell >= 0, cell, 0)
        first = take(self.pairs[:, 0], cell)
        side = take(self.sides, first)
        x, y = u - 0.5 - take(self.corners[:, 0], first), v - 0.5 - take(self.corners[:, 1], first)
        face = where(x + y > side, take(self.pairs[:, 1], cell), first)
        inside = inside & (face >= 0)
        face = where(face >= 0, face, 0)
        sign, last = take(self.signs, face), take(self.sides, face) - 1
        x = sign * (u - 0.5 - take(self.corners[:, 0], face))
        y = sign * (v - 0.5 - take(self.corners[:, 1], face))
        inside = inside & (x >= -TOLERANCE) & (y >= -TOLERANCE) & (last - x - y >= -TOLERANCE)
        return face, where(inside, x / last, 0.0), where(inside, y / last, 0.0), inside

    def pixel(self, face: Array, second: Array, third: Array) -> tuple[Array, Array]:
        """Pixel position of weights of the corners 2 and 3 of camera triangles."""
        scale = take(self.signs, face) * (take(self.sides, face) - 1)
        return (
            take(self.corners[:, 0], face) + 0.5 + scale * second,
            take(self.corners[:, 1], face) + 0.5 + scale * third,
        )

    @functools.cached_property
    def places(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Camera triangle, column and row (from corner 1) of every pixel, row by row; -1: none."""
        y, x = np.divmod(np.arange(self.width * self.height), self.width)
        face, second, third, inside = self.locate(x + 0.5, y + 0.5)
        last = self.sides[face] - 1
        found = (face, np.rint(second * last), np.rint(third * last))
        return tuple(np.where(inside, values, -1).astype(np.int32) for values in found)  # pyright: ignore[reportReturnType]


@functools.lru_cache(maxsize=64)
def atlas(sides: tuple[int, ...]) -> Atlas:
    """The atlas of camera triangles with so many pixels along their short sides: rows of cells, largest first."""
    count = len(sides)
    order = sorted(range(count), key=lambda face: -sides[face])
    cells: list[tuple[int, ...]] = []
    for face in order:
        if cells and len(cells[-1]) == 1 and sides[cells[-1][0]] == sides[face]:
            cells[-1] = (cells[-1][0], face)
        else:
            cells.append((face,))
    sizes = [sides[cell[0]] + GUTTER for cell in cells]
    # As square as whole cells allow.
    wide = max(sizes[0], int(np.ceil(np.sqrt(sum(size * size for size in sizes)) / sizes[0])) * sizes[0])
    places, x, y, row = [], 0, 0, sizes[0]
    for size in sizes:
        if x + size > wide:
            x, y, row = 0, y + row, size
        places.append((x, y))
        x += size
    width, height = max(x + size for (x, _), size in zip(places, sizes, strict=True)), y + row
    corners, signs = np.zeros((count, 2), np.int32), np.ones(count, np.int32)
    map_, pairs = np.full((height, width), -1, np.int32), np.full((len(cells), 2), -1, np.int32)
    for number, (cell, (x, y), size) in enumerate(zip(cells, places, sizes, strict=True)):
        map_[y : y + size, x : x + size] = number
        corners[cell[0]], pairs[number, 0] = (x, y), cell[0]
        if len(cell) == 2:
            corners[cell[1]], signs[cell[1]], pairs[number, 1] = (x + size - 2, y + size - 2), -1, cell[1]
    return Atlas(np.array(sides, np.int32), corners, signs, width, height, map_, pairs)
