"""Depth images of cameras whose rays bend: where a pixel's ray is at a length, and how planes run across pixels."""

from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends, need
from mpcam.rendering.device_camera import device_camera

CHUNK = 1 << 16
"""Pixels at a time."""


def piece_rows(camera: Camera) -> tuple[Any, ...] | None:
    """The pieces of all pixels' rays on the device, kept with the camera; None for a camera whose rays are straight.

    Two Floats for each piece, four numbers per pixel: origin and start; direction and 1 where there is such a piece. In
    the camera's frame, worked out in float64.
    """
    if not isinstance(camera, Bends):
        return None
    kept = device_camera(camera).kept
    if "pieces" not in kept:
        kept["pieces"] = tuple(types().Float(aligned(rows)) + opaque_zero() for rows in _rows(camera))
    return kept["pieces"]


def _rows(camera: Camera) -> list[np.ndarray]:
    local, count, width = (
        need(camera, Bends, "a depth image").local_ray_pieces,
        camera.width * camera.height,
        camera.width,
    )
    found: list[np.ndarray] = []
    for first in range(0, count, CHUNK):
        number = np.arange(first, min(first + CHUNK, count))
        with np.errstate(all="ignore"):
            pieces = local(np.stack([number % width + 0.5, number // width + 0.5]))
        for place, piece in enumerate(pieces):
            if len(found) <= 2 * place:
                found += [np.zeros((count, 4), np.float32), np.zeros((count, 4), np.float32)]
            for row, (vector, last) in enumerate(((piece.origin, piece.start), (piece.direction, piece.valid))):
                parts = [np.broadcast_to(np.asarray(part, np.float64), len(number)) for part in (*vector, last)]
                found[2 * place + row][number] = np.where(piece.valid, np.stack(parts), 0.0).T
    return found


class Pieces:
    """The pieces of the rays of pixels by number, for kernels."""

    def __init__(self, rows: tuple[Any, ...], pixel: Any, active: Any = True):
        import drjit as dr

        gathered = [dr.gather(types().Array4f, row, pixel, active) for row in rows]
        self.all = [(a.xyz, b.xyz, a.w, b.w > 0) for a, b in zip(gathered[::2], gathered[1::2], strict=True)]

    def number(self, length: Any) -> Any:
        """Which piece a length lies in."""
        import drjit as dr

        found = types().UInt(0)
        for k, (_, _, start, valid) in enumerate(self.all[1:], 1):
            found = dr.select(valid & (length >= start), k, found)
        return found

    def point(self, length: Any) -> Any:
        """Array3f, where the ray is at a length."""
        import drjit as dr

        number, result = self.number(length), types().Array3f(0)
        for k, (origin, direction, start, _) in enumerate(self.all):
            result = dr.select(number == k, origin + (length - start) * direction, result)
        return result

    def meets(self, number: Any, normal: Any, level: Any) -> Any:
        """Length at which a piece, produced, meets the plane of points with normal . point = level; NaN: no piece."""
        import drjit as dr

        result = types().Float(dr.nan)
        for k, (origin, direction, start, valid) in enumerate(self.all):
            toward = dr.dot(normal, direction)
            met = start + (level - dr.dot(normal, origin)) / dr.select(toward != 0, toward, 1e-30)
            result = dr.select(valid & (number == k), met, result)
        return result


def neighbors(pixel: Any, size: tuple[int, int]) -> list[tuple[Any, Any]]:
    """Numbers of the pixels beside and below, or before and above at the border, with the sign of the way."""
    import drjit as dr

    (width, height), found = size, []
    for at, count, stride in ((pixel % width, width, 1), (pixel // width, height, width)):
        forward = (at + 1 < count) | (count == 1)
        there = dr.select(forward, pixel + stride, pixel - stride) if count > 1 else pixel
        found.append((there, dr.select(forward, 1.0, -1.0)))
    return found


def footprint(rows: tuple[Any, ...], pixel: Any, size: tuple[int, int], length: Any) -> Any:
    """Distance to the rays of the pixels beside and below, at a length."""
    import drjit as dr

    here = Pieces(rows, pixel).point(length)
    sides = [dr.norm(Pieces(rows, there).point(length) - here) for there, _ in neighbors(pixel, size)]
    return dr.maximum(*sides)


def plane_slopes(
    rows: tuple[Any, ...], pixel: Any, size: tuple[int, int], depth: Any, normal: Any, steepest: float
) -> list[Any]:
    """Derivatives of the depth to the right and downwards, of planes with these normals through what pixels see.

    By where the plane meets the same piece of the ray a pixel beside. steepest: footprints, the most that comes back.
    """
    import drjit as dr

    own = Pieces(rows, pixel)
    level, number = dr.dot(normal, own.point(depth)), own.number(depth)
    limit, found = steepest * footprint(rows, pixel, size, depth), []
    for there, sign in neighbors(pixel, size):
        slope = sign * (Pieces(rows, there).meets(number, normal, level) - depth)
        found.append(dr.select(dr.isfinite(slope), dr.clip(slope, -limit, limit), 0.0))
    return found
