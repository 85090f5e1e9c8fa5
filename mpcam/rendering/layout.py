"""Blocks of pixels over camera triangles, and groups of blocks: which place in device memory is which pixel."""

import functools
from dataclasses import dataclass

import numpy as np

from mpcam.cameras.atlas import Atlas
from mpcam.geometry.order import interleaved
from mpcam_kernels.bundles import GROUP
from mpcam_kernels.samples import HEIGHT, PIXELS, WIDTH, in_block


@dataclass(frozen=True, eq=False)
class Layout:
    """Blocks of camera triangles, one triangle after the other.

    face (B,): camera triangle of each block; x, y (B,): its first column and row, counted from corner 1. first, count
    (G,): blocks of each group; no group has blocks of two triangles. places (H * W,): place of each pixel, -1 for none.
    """

    face: np.ndarray
    x: np.ndarray
    y: np.ndarray
    first: np.ndarray
    count: np.ndarray
    places: np.ndarray

    @property
    def blocks(self) -> int:
        return len(self.face)


@functools.lru_cache(maxsize=16)
def layout(atlas: Atlas) -> Layout:
    """The blocks of an atlas."""
    sides = atlas.sides
    shapes = {int(side): _blocks_of(int(side)) for side in np.unique(sides)}
    counts = np.array([len(shapes[int(side)][0]) for side in sides])
    starts = np.cumsum(counts) - counts
    x, y = (np.concatenate([shapes[int(side)][i] for side in sides]).astype(np.int32) for i in range(2))
    first, count = [], []
    for start, many in zip(starts, counts, strict=True):
        edges = np.linspace(0, many, -(-many // GROUP) + 1).astype(int)
        first += list(start + edges[:-1])
        count += list(np.diff(edges))
    face, column, row = atlas.places
    exists = face >= 0
    places = np.full(len(face), -1, np.int32)
    owner, column, row = face[exists], column[exists], row[exists]
    numbers = np.zeros(len(owner), np.int64)
    for side, (left, top) in shapes.items():
        grid = np.zeros((-(-side // HEIGHT), -(-side // WIDTH)), np.int64)
        grid[top // HEIGHT, left // WIDTH] = np.arange(len(left))
        mine = sides[owner] == side
        numbers[mine] = grid[row[mine] // HEIGHT, column[mine] // WIDTH]
    places[exists] = (starts[owner] + numbers) * PIXELS + in_block(column % WIDTH, row % HEIGHT)
    return Layout(
        np.repeat(np.arange(len(sides), dtype=np.int32), counts),
        x,
        y,
        np.array(first, np.uint32),
        np.array(count, np.uint32),
        places,
    )


def _blocks_of(side: int) -> tuple[np.ndarray, np.ndarray]:
    """First columns and rows of the blocks that a right triangle reaches, neighbours close together."""
    x, y = np.meshgrid(np.arange(0, side, WIDTH), np.arange(0, side, HEIGHT))
    x, y = x[x + y < side], y[x + y < side]
    order = np.argsort(interleaved(np.stack([x // WIDTH, y // WIDTH], -1)) * 2 + (y // HEIGHT) % 2, kind="stable")
    return x[order], y[order]
