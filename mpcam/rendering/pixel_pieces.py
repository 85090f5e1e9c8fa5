"""The straight pieces of the bent rays of all pixels, in layers of blocks on the device."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends, need
from mpcam.cameras.types import RayPieces
from mpcam.errors import InputError
from mpcam.rendering.block_layout import BlockLayout, layered_layout
from mpcam.rendering.seams import smooth_parts

CHUNK = 1 << 16
"""Pixels at a time."""
FAR = 1e25
"""Pieces that are longer go on for ever; kernels square no lengths, but multiply them by areas."""
SAME = 1e-6
"""How far a piece may start from where the one before it ends, over its length and its distance from the anchor."""
MOST_SPLIT, FEW = 2, 256
"""Blocks, for each one that there would be otherwise, and at least, up to which blocks are split at seams."""
_SAMPLES = 64

Layer = tuple[np.ndarray, np.ndarray]
"""Which pixels have a piece (N,), and what kernels keep of these, (12, N) float32: see `ray_pieces.Rays`."""


@dataclass(frozen=True, eq=False)
class PixelPieces:
    """Pieces in the camera's axes, from an anchor (3,), a point of its frame near which the rays start, scene units.

    layout: a layer for each piece that some ray has. rays: a `mpcam_kernels.ray_pieces.Rays`.
    """

    layout: BlockLayout
    anchor: np.ndarray
    rays: Any


def pixel_pieces(camera: Camera) -> PixelPieces:
    """The pieces of a camera's pixels, worked out in float64.

    Raises InputError where `local_ray_pieces` does not give pieces of so many pixels.
    """
    from mpcam_kernels.ray_pieces import Rays
    from mpcam_kernels.rows import Rows
    from mpcam_kernels.samples import PIXELS

    width, count = camera.width, camera.width * camera.height
    anchor, chunks = _anchor(camera), []
    for first in range(0, count, CHUNK):
        number = np.arange(first, min(first + CHUNK, count))
        pieces = _pieces(camera, np.stack([number % width + 0.5, number // width + 0.5]))
        chunks.append([(number[which], rows) for which, rows in _layers(pieces, anchor)])
    # Layer by layer: the pixels of all chunks, and their rows.
    layers = [
        tuple(np.concatenate(parts, -1) for parts in zip(*layer, strict=True)) for layer in zip(*chunks, strict=True)
    ]
    while layers and layers[-1][0].size == 0:
        layers.pop()
    layout = _layout(width, camera.height, layers)
    table = np.zeros((layout.blocks * PIXELS, 4 * Rays.ROWS), np.float32)
    for number, (which, rows) in enumerate(layers):
        table[layout.slots[number * count + which]] = rows.T
    return PixelPieces(layout, anchor, Rays(Rows(types().Float(aligned(table)) + opaque_zero(), Rays.ROWS)))


def _layout(width: int, height: int, layers: Sequence[Any]) -> BlockLayout:
    """Layers of blocks, from a `Layer` each; rays that do not belong together lie apart, unless too many do not."""
    parts = [smooth_parts(width, height, which, rows[4:7], rows[:3]) for which, rows in layers]
    split = layered_layout(width, height, [(which, part) for (which, _), part in zip(layers, parts, strict=True)])
    if not any(part.any() for part in parts):
        return split
    whole = layered_layout(width, height, [(which, np.zeros_like(which)) for which, _ in layers])
    return split if split.blocks <= MOST_SPLIT * whole.blocks + FEW else whole


def _pieces(camera: Camera, pixel: np.ndarray) -> list[RayPieces]:
    """The pieces of pixels (2, N), float64: origin, direction (3, N), start, end, valid (N,), the camera's frame.

    What is not valid is zero; pieces of no length are not valid.
    """
    local, count = need(camera, Bends, "a frame of bent rays").local_ray_pieces, pixel.shape[1]

    def numbers(values: Any) -> np.ndarray:
        return np.broadcast_to(np.asarray(values, np.float64), count)

    found = []
    with np.errstate(all="ignore"):
        given = local(pixel)
        try:
            for piece in given:
                vectors = [np.stack([numbers(part) for part in parts]) for parts in (piece.origin, piece.direction)]
                start, end = numbers(piece.start), numbers(piece.end)
                valid = np.broadcast_to(np.asarray(piece.valid, bool), count) & np.isfinite(sum(vectors)).all(0)
                valid &= (vectors[1] != 0).any(0) & np.isfinite(start) & (end > start)
                cleared = (np.where(valid, part, 0.0) for part in (*vectors, start, end))
                found.append(RayPieces(*cleared, valid))  # pyright: ignore[reportCallIssue]
        except (TypeError, ValueError, AttributeError) as error:
            raise InputError(
                f"{type(camera).__name__}.local_ray_pieces gives no pieces of rays of {count} pixels ({error}): return "
                "a tuple of mpcam.cameras.types.RayPieces, vectors with their components first"
            ) from None
    return found


def _anchor(camera: Camera) -> np.ndarray:
    """The middle of where the rays of some of the pixels start, (3,), camera frame."""
    u, v = (np.unique(np.linspace(0, side - 1, _SAMPLES).astype(int)) + 0.5 for side in (camera.width, camera.height))
    pieces = _pieces(camera, np.stack([grid.ravel() for grid in np.meshgrid(u, v)]))
    known, starts = np.zeros(len(u) * len(v), bool), []
    for piece in pieces:
        starts.append(piece.origin[:, piece.valid & ~known])
        known |= piece.valid
    found = np.concatenate(starts, -1) if starts else np.zeros((3, 0))
    return 0.5 * found.min(-1) + 0.5 * found.max(-1) if found.size else np.zeros(3)


def _layers(pieces: list[RayPieces], anchor: np.ndarray) -> list[Layer]:
    """Pieces as kernels keep them; which: places in the pieces.

    Pieces end, to the bit, where the next ones start, if that is the same place but for rounding.
    """
    found: list[Layer] = []
    following, known = np.zeros(()), np.zeros((), bool)
    for piece in reversed(pieces):
        origin, direction = piece.origin - anchor[:, None], piece.direction
        with np.errstate(invalid="ignore", over="ignore"):
            length = piece.end - piece.start
            finite = piece.valid & (length < FAR)
            length = np.where(finite, length, 1.0)
            end = origin + length * direction
            near = SAME * (length + np.abs(origin).max(0))
            end = np.where(known & (np.abs(following - end).max(0) <= near), following, end)
        end = np.where(finite, end, direction)
        which = np.flatnonzero(piece.valid)
        rows = np.empty((12, len(which)), np.float32)
        values = (*direction, 1.0 / length, *origin, finite, *end, piece.start)
        for row, value in zip(rows, values, strict=True):
            row[:] = value[which]
        found.append((which, rows))
        following, known = np.where(piece.valid, origin, following), known | piece.valid
    return found[::-1]
