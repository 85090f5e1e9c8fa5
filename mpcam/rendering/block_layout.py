"""Blocks of pixels and groups of blocks: which slot in device memory belongs to which pixel."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, types
from mpcam.cameras.atlas import Atlas
from mpcam.geometry.order import interleaved
from mpcam_kernels.pixels import PER_THREAD
from mpcam_kernels.ray_blocks import GROUP, SIDE, place_in_group
from mpcam_kernels.samples import HEIGHT, PARTS, PIXELS, WIDTH, in_block


@dataclass(frozen=True, eq=False)
class BlockLayout:
    """Blocks of an image, of layers of it, or of the camera triangles of an atlas one after the other, group by group.

    face (B,): camera triangle or layer of each block, 0 in an image. x, y (B,): first column and row of each block, in
    the image or from corner 1 of its camera triangle. group (B,): the group of each block; no group has blocks of two
    camera triangles, or layers. slots (layers * H * W,): slot of each pixel, layer by layer, -1 for none. pixels: of
    the image, H * W.
    """

    face: np.ndarray
    x: np.ndarray
    y: np.ndarray
    group: np.ndarray
    slots: np.ndarray
    pixels: int

    @property
    def blocks(self) -> int:
        return len(self.face)

    @property
    def groups(self) -> int:
        return int(self.group[-1]) + 1

    @property
    def parts(self) -> np.ndarray:
        """(B,) uint32, the parts of each block that hold pixels, as bits."""
        there = self._held(PIXELS // PARTS).reshape(-1, PARTS)
        return (there << np.arange(PARTS)).sum(axis=1).astype(np.uint32)

    @property
    def runs(self) -> np.ndarray:
        """The runs of `pixels.PER_THREAD` slots that hold pixels, by number; the first one if none does."""
        there = self._held(PER_THREAD)
        there[0] |= not there.any()
        return np.flatnonzero(there)

    def _held(self, size: int) -> np.ndarray:
        """Which runs of `size` slots hold pixels."""
        there = np.zeros(self.blocks * PIXELS // size, bool)
        there[self.slots[self.slots >= 0] // size] = True
        return there

    @functools.cached_property
    def on_device(self) -> dict[str, Any]:
        """What of the layout kernels need: see `mpcam_kernels.ray_blocks.RayBlocks`; slots; and thread indices.

        layers: how many layers and how many pixels there are.
        """
        import drjit as dr

        t = types()
        count = np.bincount(self.group)
        numbers = np.zeros((self.groups, GROUP), np.uint32)
        exist = np.zeros(self.groups, np.uint32)
        place = place_in_group((self.x, self.y))
        numbers[self.group, place] = np.arange(self.blocks)
        np.bitwise_or.at(exist, self.group, np.uint32(1) << place.astype(np.uint32))
        arrays = {
            "face": self.face,
            "x": self.x,
            "y": self.y,
            "first": np.cumsum(count) - count,
            "count": count,
            "numbers": numbers.ravel(),
            "exist": exist,
            "parts": self.parts,
            "runs": self.runs,
        }
        found: dict[str, Any] = {name: t.UInt(aligned(values, np.uint32)) for name, values in arrays.items()}
        found["slots"] = t.Int(aligned(self.slots, np.int32))
        found["layers"] = t.UInt([len(self.slots) // self.pixels]), t.UInt([self.pixels])
        found["pixels"] = dr.arange(t.UInt, self.pixels)
        found["threads"] = [dr.arange(t.UInt, n) for n in (self.blocks * PIXELS, self.blocks, self.groups)]
        dr.make_opaque(found)
        return found


@functools.lru_cache(maxsize=16)
def image_layout(width: int, height: int) -> BlockLayout:
    """The blocks of an image."""
    x, y, group = _blocks_of(width, height)
    grid = np.zeros((-(-height // HEIGHT), -(-width // WIDTH)), np.int32)
    grid[y // HEIGHT, x // WIDTH] = np.arange(len(x))
    column, row = np.arange(width), np.arange(height)[:, None]
    slots = grid[row // HEIGHT, column // WIDTH] * PIXELS + in_block(column % WIDTH, row % HEIGHT)
    return BlockLayout(np.zeros(len(x), np.int32), x, y, group, slots.astype(np.int32).ravel(), width * height)


def layered_layout(width: int, height: int, layers: list[tuple[np.ndarray, np.ndarray]]) -> BlockLayout:
    """The blocks of an image layer by layer, only those that hold pixels; one empty block if no layer has any.

    layers: the pixels of each layer, row by row, and a number for each of them: pixels with different numbers are in
    blocks and groups of their own.
    """
    image = image_layout(width, height)
    faces, places, groups, slots, blocks, before = [], [], [], [], 0, 0
    for number, (pixels, parts) in enumerate(layers):
        at = image.slots[pixels]
        keys, place = np.unique(parts * image.blocks + at // PIXELS, return_inverse=True)
        part, block = np.divmod(keys, image.blocks)
        group = np.unique(part * image.groups + image.group[block], return_inverse=True)[1]
        slots.append(np.full(width * height, -1, np.int32))
        slots[-1][pixels] = (blocks + place) * PIXELS + at % PIXELS
        faces.append(np.full(len(keys), number))
        places.append(block)
        groups.append(before + group)
        blocks, before = blocks + len(keys), before + int(group.max(initial=-1)) + 1
    if blocks == 0:
        nothing = np.zeros(1, np.int64)
        return BlockLayout(nothing, nothing, nothing, nothing, np.full(width * height, -1, np.int32), width * height)
    block = np.concatenate(places)
    return BlockLayout(
        np.concatenate(faces),
        image.x[block],
        image.y[block],
        np.concatenate(groups),
        np.concatenate(slots),
        width * height,
    )


@functools.lru_cache(maxsize=16)
def atlas_layout(atlas: Atlas) -> BlockLayout:
    """The blocks of an atlas of camera triangles."""
    sides = atlas.sides
    shapes = {int(side): _blocks_of(int(side), int(side), triangle=True) for side in np.unique(sides)}
    counts = np.array([len(shapes[int(side)][0]) for side in sides])
    groups = np.array([shapes[int(side)][2][-1] + 1 for side in sides])
    starts, before = np.cumsum(counts) - counts, np.cumsum(groups) - groups
    x, y, group = (np.concatenate([shapes[int(side)][i] for side in sides]).astype(np.int32) for i in range(3))
    face, column, row = atlas.places
    exists = face >= 0
    slots = np.full(len(face), -1, np.int32)
    owner, column, row = face[exists], column[exists], row[exists]
    numbers = np.zeros(len(owner), np.int64)
    for side, (left, top, _) in shapes.items():
        grid = np.zeros((-(-side // HEIGHT), -(-side // WIDTH)), np.int64)
        grid[top // HEIGHT, left // WIDTH] = np.arange(len(left))
        mine = sides[owner] == side
        numbers[mine] = grid[row[mine] // HEIGHT, column[mine] // WIDTH]
    slots[exists] = (starts[owner] + numbers) * PIXELS + in_block(column % WIDTH, row % HEIGHT)
    return BlockLayout(
        np.repeat(np.arange(len(sides), dtype=np.int32), counts),
        x,
        y,
        group + np.repeat(before, counts),
        slots,
        len(slots),
    )


def _blocks_of(width: int, height: int, triangle: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First columns and rows of the blocks, and their groups, neighbors close together.

    triangle: only those that a right triangle along the upper and the left side reaches.
    """
    x, y = np.meshgrid(np.arange(0, width, WIDTH), np.arange(0, height, HEIGHT))
    inside = x + y < width if triangle else np.ones(x.shape, bool)
    x, y = x[inside], y[inside]
    cell = interleaved(np.stack([x // SIDE, y // SIDE], -1))
    order = np.argsort(cell * GROUP + place_in_group((x, y)), kind="stable")
    group = np.unique(cell[order], return_inverse=True)[1]
    return x[order], y[order], group
