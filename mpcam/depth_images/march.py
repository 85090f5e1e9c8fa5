"""Rays against a depth image: from rays in the world to what the kernel takes, and what it gives."""

import functools
from typing import Any

import numpy as np

from mpcam.backend import opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Images
from mpcam.cameras.types import PosedRays
from mpcam.rendering.device_camera import device_camera


def marched(
    camera: Camera,
    surface: Any,
    rays: PosedRays,
    coarse: float,
    fine: float,
    far: Any,
    straightened: np.ndarray | None = None,
    planes: np.ndarray | None = None,
    leaving: bool = True,
) -> Any:
    """First hits of rays on the device, a `mpcam_kernels.marching.Found`, evaluated.

    far: a Float, lengths beyond which nothing counts. straightened: 4x4, affine, to the frame of the surface from the
    world; by default the camera's pose. planes (m, 4): world, (n, o); what is not where n . x + o <= 0 is not met.
    leaving: whether rays may start on the surface, which they do not hit there.
    """
    import drjit as dr

    if dr.width(rays.ray.valid) == 0:
        t = types()
        return t.Bool(), t.Float(), t.Float(), t.Float(), t.UInt(), t.Bool(), t.UInt()
    world = np.linalg.inv(rays.pose)
    pose = np.asarray(camera.camera_from_world if straightened is None else straightened, np.float64) @ world
    numbers = opaque_numbers([*pose[:3, :3].ravel(), *pose[:3, 3], coarse, fine, float(leaving)])
    limits = [] if planes is None else opaque_numbers([*(planes @ world).ravel()])
    model = type(camera)
    static = tuple(getattr(camera, name) for name in camera.static_fields)
    kernel = _frozen_march(model, static, surface.size, surface.levels.side, surface.curved)
    most = opaque_most(surface.size, fine)
    data = surface.patches, surface.ranges, surface.box
    return kernel(device_camera(camera).on_device, data, tuple(rays.ray), numbers, limits, far, most)


def opaque_most(size: tuple[int, int], fine: float) -> Any:
    """Steps after which a ray is given up, on the device: as many as it takes to go around the image eight times."""
    import drjit as dr

    return dr.opaque(types().UInt, int(min(16 * sum(size) / fine + 1000, 1e6)))


@functools.lru_cache(maxsize=64)
def _frozen_march(model: type[Camera], static: tuple[Any, ...], size: tuple[int, int], side: int, curved: float) -> Any:
    import drjit as dr

    from mpcam_kernels.depth_tiles import Levels
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.marching import Surface, between, march
    from mpcam_kernels.poses import placed

    levels = Levels.of(*size, side)

    @frozen
    def kernel(
        camera: Any,
        data: tuple[Any, ...],
        rays: tuple[Any, ...],
        numbers: list[Any],
        limits: list[Any],
        far: Any,
        most: Any,
    ) -> tuple[Any, ...]:
        t = types()
        origin, direction, valid = rays

        direction = direction * dr.rsqrt(dr.squared_norm(direction))
        entry, leaves = between(t, limits, origin, direction, far)
        start = placed(t, numbers[:12], origin)
        along = t.Array3f(*(sum(numbers[3 * i + j] * direction[j] for j in range(3)) for i in range(3)))
        usable = valid & dr.isfinite(sum(start)) & dr.isfinite(sum(along))
        start, along = dr.select(usable, start, 0.0), dr.select(usable, along, t.Array3f(0, 0, 1))
        patches, ranges, box = data
        surface = Surface(patches, ranges, box, size, levels, curved)
        (coarse, fine), leaving = numbers[12:14], numbers[14] > 0
        project = projection(camera)
        return tuple(march(t, project, surface, start, along, usable, coarse, fine, entry, leaves, most, leaving))

    return kernel


def projection(camera: Any) -> Any:
    """Images of points in the frame of a camera, for kernels, a `mpcam_kernels.marching.Project`."""
    import drjit as dr

    from mpcam_kernels.depth_crossings import Point

    kind = type(camera).ray_geometry

    def project(point: Any) -> Point:
        if kind == "general" or not isinstance(camera, Images):
            ((u, v), depth, seen) = camera.local_project(point)[0]
        else:
            (u, v), seen = camera.local_image(point)
            depth = dr.norm(point) if kind == "central" else point.z
            seen = seen & dr.isfinite(u + v)
        return Point(u, v, depth, seen)

    return project
