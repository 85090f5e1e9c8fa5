"""From a depth image to the surface that rays are followed over: patches, ranges of depth, and the box around it all.

Made anew with each frame, on the device; what depends on the camera alone is kept with it.
"""

import functools
from typing import Any

import numpy as np

from mpcam.backend import opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.depth_images import bent
from mpcam.rendering.device_camera import DeviceCamera, device_camera

CURVED = {"central": 1.0, "parallel": 0.0, "general": 2.0}
"""How much depths along straight lines bend, in terms of distances from a point."""


def device_surface(camera: Camera, depth: Any, side: int, slopes: Any = None) -> Any:
    """The surface of a depth image on the device, a `mpcam_kernels.marching.Surface` in the camera's frame.

    depth: Float, one per pixel, row by row, infinite where nothing is. side: pixels along the smallest squares whose
    ranges of depth are kept. slopes: those of the surfaces, from `plane_slopes`, where they are known.
    """
    import drjit as dr

    from mpcam_kernels.depth_tiles import Levels
    from mpcam_kernels.marching import Surface
    from mpcam_kernels.threads import threads

    t, known, size = types(), device_camera(camera), (camera.width, camera.height)
    levels = Levels.of(*size, side)
    spread, anchor = spread_of(known)
    ray, pieces = known.ray, bent.piece_rows(camera)
    origin = None if known.central else ray.origin
    count, squares = size[0] * size[1], levels.starts
    numbers = [threads(t, 0, count), *(threads(t, 0, columns * rows) for columns, rows in levels.counts)]
    targets = dr.empty(t.Float, 4 * count), dr.empty(t.Float, 2 * squares[-1])
    build = _frozen_build(size, side, known.central)
    fixed = pieces, spread, origin, ray.direction, anchor
    patches, ranges, low, high = build(numbers, targets, depth, slopes, fixed)
    box = [end for low_or_high in (low, high) for end in low_or_high]
    return Surface(patches, ranges, box, size, levels, CURVED[camera.ray_geometry])


def spread_of(camera: DeviceCamera) -> tuple[Any, list[Any]]:
    """Two numbers per pixel, by which the distance to the neighboring rays grows: at depth d it is base + d growth.

    And the point from which the rays' origins count.
    """
    import drjit as dr

    from mpcam_kernels.samples import pixel_centers

    known = camera.kept.get("spread")
    if known is not None:
        return known
    t, (width, height), ray = types(), camera.size, camera.ray
    u, v = pixel_centers(t, width, height)
    column, row = t.UInt(u), t.UInt(v)
    here = row * width + column
    base, growth = t.Float(0), t.Float(0)
    for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        x, y = t.Int(column) + i, t.Int(row) + j
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height) & ray.valid
        there = t.UInt(dr.select(inside, y * width + x, t.Int(here)))
        inside &= dr.gather(t.Bool, ray.valid, there, inside)
        apart = dr.norm(dr.gather(t.Array3f, ray.direction, there, inside) - ray.direction)
        growth = dr.select(inside, dr.maximum(growth, apart), growth)
        if not camera.central:
            apart = dr.norm(dr.gather(t.Array3f, ray.origin, there, inside) - ray.origin)
            base = dr.select(inside, dr.maximum(base, apart), base)
    if width * height == 1:  # no neighbor: the rays half a pixel to both sides
        model: Any = camera.on_device
        sides = [model.local_ray(t.Array2f(side, 0.5)) for side in (0.25, 0.75)]
        growth = growth + 2 * dr.norm(t.Array3f(*sides[1].direction) - t.Array3f(*sides[0].direction))
        base = base + 2 * dr.norm(t.Array3f(*sides[1].origin) - t.Array3f(*sides[0].origin))
    spread = dr.ravel(t.Array2f(base, growth))
    anchor = opaque_numbers([float(x) for x in np.asarray(camera.anchor)])
    dr.eval(spread)
    known = camera.kept["spread"] = (spread, anchor)
    return known


@functools.lru_cache(maxsize=64)
def _frozen_build(size: tuple[int, int], side: int, central: bool) -> Any:
    """Kernels that make patches, ranges of squares and the box of a depth image."""
    import drjit as dr

    from mpcam_kernels import depth_patches, depth_tiles
    from mpcam_kernels.depth_tiles import Levels
    from mpcam_kernels.frozen import frozen

    width, height = size
    levels = Levels.of(*size, side)

    @frozen
    def build(
        numbers: list[Any], targets: tuple[Any, Any], depth: Any, slopes: Any, fixed: tuple[Any, ...]
    ) -> tuple[Any, ...]:
        pieces, spread, origin, direction, anchor = fixed
        t = types()
        pixel, *squares = numbers
        patches, ranges = targets
        column, row = t.Int(pixel % width), t.Int(pixel // width)

        def read(
            i: int, j: int, values: Any = depth, stride: int = 1, offset: int = 0, otherwise: float = dr.inf
        ) -> Any:
            inside = True
            if i:
                inside = (column + i >= 0) & (column + i < width)
            if j:
                inside = (row + j >= 0) & (row + j < height)
            there = t.UInt(t.Int(pixel) + (j * width + i))
            return dr.select(inside, dr.gather(t.Float, values, there * stride + offset, inside), otherwise)

        def slope(axis: int) -> Any:
            return lambda i, j: read(i, j, slopes, 2, axis, dr.nan)

        center = read(0, 0)
        length = dr.select(dr.isfinite(center), center, 0.0)
        if pieces is None:
            base, growth = dr.gather(t.Array2f, spread, pixel)
            footprint = base + growth * length
        else:
            footprint = bent.footprint(pieces, pixel, size, length)
        known = None if slopes is None else (slope(0), slope(1))
        patch = depth_patches.patch_of(t, read, footprint, known)
        dr.scatter(patches, depth_patches.packed(t, patch), pixel)

        def point_at(pixel: Any, depth: Any, active: Any) -> Any:
            if pieces is not None:
                return bent.Pieces(pieces, pixel, active).point(depth)
            point = dr.gather(t.Array3f, direction, pixel, active) * depth
            return point if central else point + dr.gather(t.Array3f, origin, pixel, active)

        found, low, high = depth_tiles.of_pixels(t, squares[0], patches, size, side, point_at)
        flat = dr.ravel(found)
        dr.eval(flat, low, high)
        for number, (count, start) in enumerate(zip(levels.counts, levels.starts, strict=False)):
            if number:
                flat = dr.ravel(depth_tiles.joined(t, squares[number], flat, levels.counts[number - 1], count[0]))
            wide = depth_tiles.widened(t, squares[number], flat, count)
            dr.scatter(ranges, wide, squares[number] + start)
        shifts = anchor if pieces is None else [0.0, 0.0, 0.0]  # bent rays are not brought near to their middle
        corners = [
            t.Array3f(*(reduced(end) + shift for end, shift in zip(corner, shifts, strict=True)))
            for corner, reduced in ((low, dr.min), (high, dr.max))
        ]
        return patches, ranges, *corners

    return build
