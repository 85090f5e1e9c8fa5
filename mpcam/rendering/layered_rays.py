"""Bent rays on the device: their pieces in layers of blocks, and which piece of each ray counts."""

import functools
from typing import Any

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.cameras.types import PosedRays, Ray
from mpcam.rendering.device_camera import DeviceCamera, around, device_camera
from mpcam.rendering.pixel_pieces import PixelPieces
from mpcam.rendering.ray_blocks import DeviceRays, bounded, rows_for


def layered_rays(camera: DeviceCamera, scale: float) -> DeviceRays:
    """The pieces of a bent camera's rays, in a unit; made once for all poses of the camera."""
    known = camera.kept.get(("bent", scale))
    if known is None:
        pieces = camera.pieces
        layout, inverse = pieces.layout, opaque_numbers([1.0 / scale])[0]
        slots = layout.on_device["threads"][0]
        rays = _frozen_scaled()(slots, pieces.rays, inverse, rows_for("bent", "Rays", layout, 0))
        blocks = bounded("bent", rays, layout)
        known = camera.kept["bent", scale] = DeviceRays(layout, "bent", pieces.anchor, blocks, lambda: _last(pieces))
    return known


@exclusive
def bent_view(camera: Camera, depth: Any) -> PosedRays:
    """The piece of each pixel's ray that a depth lies on, as a ray that is at that depth after as much of its length.

    depth: scene units, row by row, on the device; infinite for the last piece.
    """
    pieces = device_camera(camera).pieces
    return PosedRays(around(camera, pieces.anchor), _at(pieces, depth))


def _last(pieces: PixelPieces) -> Ray:
    """The last pieces, along which a ray leaves the scene where it hits nothing."""
    import drjit as dr

    depth = dr.full(types().Float, dr.inf, pieces.layout.pixels)
    dr.make_opaque(depth)
    return _at(pieces, depth)


def _at(pieces: PixelPieces, depth: Any) -> Ray:
    fixed = pieces.layout.on_device
    found = _frozen_at()(fixed["pixels"], fixed["slots"], fixed["layers"], pieces.rays, depth)
    return Ray(*found)


@functools.cache
def _frozen_scaled() -> Any:
    """Kernel that brings pieces into the unit of a mesh."""
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.ray_pieces import Rays

    @frozen
    def scaled(slot: Any, rays: Any, inverse: Any, target: Any) -> Any:
        target.store(rays.scaled(types(), slot, inverse), slot)
        return Rays(target)

    return scaled


@functools.cache
def _frozen_at() -> Any:
    """Kernel that finds the piece at a depth: origin, direction and whether there is any."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.ray_pieces import reaching

    @frozen
    def at(pixel: Any, slots: Any, layers: tuple[Any, Any], rays: Any, depth: Any) -> tuple[Any, Any, Any]:
        t = types()
        found = reaching(t, pixel, slots, *layers, rays, depth)
        valid, slot = found >= 0, t.UInt(dr.maximum(found, 0))
        piece, start = rays.at(t, slot, valid), rays.start(t, slot, valid)
        direction = dr.select(valid, piece.direction, t.Array3f(0, 0, 1))
        return dr.fma(direction, -start, piece.origin), direction, valid

    return at
