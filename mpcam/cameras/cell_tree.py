"""Which cells of a ray map may see a point: bounds of blocks of cells, from the whole map down to each cell. NumPy.

A cell lies between the centers of four pixels; along the border of the image, halves of pixels are cells of their own,
where the rays of the nearest cell go on.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mpcam.math import cross, dot, normalize

PAIRS = 1 << 18
"""Pairs of a point and a block that are looked at in one go."""
_QUAD = [(j, i) for j in (0, 1) for i in (0, 1)]
"""Row and column of the parts of a block, and of the corners of a cell."""


class Bounds(NamedTuple):
    """Bounds of the rays of blocks: a ball around the origins and a cone around the directions.

    center (3, ...), radius (...): below zero for a block without rays. axis (3, ...), angle (...): unit, and radians up
    to pi.
    """

    center: np.ndarray
    radius: np.ndarray
    axis: np.ndarray
    angle: np.ndarray

    def at(self, block: np.ndarray) -> "Bounds":
        """Those of blocks by number."""
        flat = (values.reshape(*values.shape[:-2], -1) for values in self)
        return Bounds(*(np.take(values, block, axis=-1) for values in flat))

    def may_see(self, points: np.ndarray) -> np.ndarray:
        """Whether points (3, ...), one for each block, may lie on a ray of the block, on the far side of its origin."""
        away = points - self.center
        distance = _length(away)
        turned = np.arctan2(_length(cross(away, self.axis)), dot(away, self.axis))
        beyond = distance > self.radius
        sideways = np.where(beyond, distance, 1.0)
        ball = np.arcsin(np.where(beyond, self.radius, 0.0) / sideways)
        rounding = 1e-14 * (_length(points) + _length(self.center))
        slack = 1e-14 + rounding / np.maximum(sideways, rounding + 1e-300)
        near = distance <= self.radius + rounding
        return (self.radius >= 0) & (near | (turned <= self.angle + ball + slack))


class CellTree:
    """The cells of a map and the bounds of 1, 2 x 2, 4 x 4, ... of them.

    origins, directions: (H, W, 3), finite; the direction is zero where a pixel has no ray. exists (H + 1, W + 1): cells
    with rays, those between four pixels that have one and their continuations; there is no cell in a map of one row or
    column. x (W + 2,), y (H + 2,): borders of the cells, pixels; places, along (3, H + 2, W + 2): origins and
    directions there.
    """

    def __init__(self, origins: np.ndarray, directions: np.ndarray):
        height, width = origins.shape[:2]
        if min(height, width) < 2:
            self.exists = np.zeros((0, 0), bool)
            return
        self.x, self.y = (np.array([0.0, *(np.arange(count) + 0.5), count]) for count in (width, height))
        pixels = (directions != 0).any(-1)
        between = pixels[:-1, :-1] & pixels[1:, :-1] & pixels[:-1, 1:] & pixels[1:, 1:]
        self.exists = np.pad(between, 1, mode="edge")
        self.places, self.along = (_to_the_border(np.moveaxis(table, -1, 0)) for table in (origins, directions))
        self.levels = [_of_cells(self.places, self.along, self.exists)]
        while self.levels[-1].radius.size > 1:
            self.levels.append(_joined(self.levels[-1]))

    def candidates(self, points: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Pairs of a point and a cell that may see it, as two arrays of numbers, some at a time. points: (3, N)."""
        if not self.exists.any():
            return
        start = np.arange(points.shape[1])
        waiting = [(len(self.levels) - 1, start[i : i + PAIRS], 0 * start[i : i + PAIRS]) for i in start[::PAIRS]]
        while waiting:
            level, point, block = waiting.pop()
            kept = self.levels[level].at(block).may_see(np.take(points, point, axis=1))
            point, block = point[kept], block[kept]
            if level == 0:
                yield point, block
                continue
            shapes = [self.levels[k].radius.shape for k in (level, level - 1)]
            number, block = _children(block, shapes[0][1], shapes[1])
            point = point[number]
            waiting += [(level - 1, point[i : i + PAIRS], block[i : i + PAIRS]) for i in range(0, len(point), PAIRS)]

    def corners(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins and directions at the corners of cells, (4, 3, M) each: first the upper left and right."""
        row, column = np.divmod(cell, len(self.x) - 1)
        at = [(row + j) * len(self.x) + column + i for j, i in _QUAD]
        flat = (table.reshape(3, -1) for table in (self.places, self.along))
        return tuple(np.stack([np.take(table, number, axis=1) for number in at]) for table in flat)  # pyright: ignore[reportReturnType]

    def box(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Upper left corners of cells and their sizes, pixels, (2, M) each."""
        row, column = np.divmod(cell, len(self.x) - 1)
        low = np.stack([self.x[column], self.y[row]])
        return low, np.stack([self.x[column + 1], self.y[row + 1]]) - low


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(dot(vectors, vectors))


def _between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between unit vectors."""
    return np.arctan2(_length(cross(a, b)), dot(a, b))


def _to_the_border(table: np.ndarray) -> np.ndarray:
    """A table (3, H, W) with a row and a column more on each side, those at the border of the image."""
    for axis in (1, 2):
        rows = np.moveaxis(table, axis, 0)
        first, last = rows[0] + 0.5 * (rows[0] - rows[1]), rows[-1] + 0.5 * (rows[-1] - rows[-2])
        table = np.moveaxis(np.concatenate([first[None], rows, last[None]]), 0, axis)
    return np.ascontiguousarray(table)


def _of_cells(places: np.ndarray, along: np.ndarray, exists: np.ndarray) -> Bounds:
    """Bounds of single cells, (h, w): rays of a cell lie between those of its corners, unless these are 90 degrees and
    more from their mean.
    """
    height, width = exists.shape
    quad = [(slice(None), slice(j, j + height), slice(i, i + width)) for j, i in _QUAD]
    corners, rays = [places[part] for part in quad], [normalize(along[part]) for part in quad]
    center, axis = np.mean(corners, axis=0), normalize(sum(rays))
    radius = np.max([_length(corner - center) for corner in corners], axis=0) * (1 + 1e-14)
    angle = np.max([_between(axis, ray) for ray in rays], axis=0)
    # At the border a direction may be extrapolated to zero, and four may cancel.
    lost = np.any([(part == 0).all(0) for part in (*rays, axis)], axis=0)
    return Bounds(center, np.where(exists, radius, -1.0), axis, np.where(lost | (angle > 1.57), np.pi, angle))


def _joined(inner: Bounds) -> Bounds:
    """Bounds of blocks of 2 x 2."""
    height, width = inner.radius.shape
    spare = ((0, height % 2), (0, width % 2))
    center, axis = (np.pad(values, ((0, 0), *spare)) for values in (inner.center, inner.axis))
    radius, angle = np.pad(inner.radius, spare, constant_values=-1.0), np.pad(inner.angle, spare)
    parts = [(..., slice(j, None, 2), slice(i, None, 2)) for j, i in _QUAD]
    exists = [radius[part] >= 0 for part in parts]
    pairs = list(zip(exists, parts, strict=True))
    middle = sum(there * center[part] for there, part in pairs) / np.maximum(sum(exists), 1)
    mean = normalize(sum(there * axis[part] for there, part in pairs))
    reach = [np.where(there, _length(center[part] - middle) + radius[part], -1.0) for there, part in pairs]
    turn = [np.where(there, _between(mean, axis[part]) + angle[part], 0.0) for there, part in pairs]
    turn = np.where((mean == 0).all(0), np.pi, np.minimum(np.max(turn, axis=0), np.pi))
    return Bounds(middle, np.max(reach, axis=0) * (1 + 1e-14), mean, turn)


def _children(block: np.ndarray, columns: int, inner: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Number in `block` and number on the finer level, of shape `inner`, of all parts of blocks."""
    row, column = np.divmod(block, columns)
    parts = [(2 * row + j, 2 * column + i) for j, i in _QUAD]
    inside = np.stack([(j < inner[0]) & (i < inner[1]) for j, i in parts])
    number = np.broadcast_to(np.arange(len(block)), inside.shape)[inside]
    return number, np.stack([j * inner[1] + i for j, i in parts])[inside]
