"""Which points a depth image holds, and which rays of a mirror lack theirs (Rosen et al. 2011, section 7.1)."""

import functools
from typing import Any, NamedTuple

import numpy as np

from mpcam.backend import opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.types import Ray
from mpcam.depth_images.depth_image import DepthImage
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.raytrace import RayTraced
from mpcam.scene.scene import Scene


class TrueHits(NamedTuple):
    """What rays hit first, of those that hit the meshes asked for. number (N,): of the ray. points (N, 3): world."""

    number: np.ndarray
    points: np.ndarray


def true_hits(scene: Scene, camera: Camera, ray: Ray, meshes: tuple[int, ...]) -> TrueHits:
    """First hits on a scene, by Mitsuba, of rays (N, 3), one for each pixel of a camera; those on some meshes alone."""
    hits = RayTraced(camera, scene.mesh, ray).frame()
    ends = np.cumsum([0] + [len(mesh.faces) for mesh in scene.meshes])
    triangle, depth = hits.triangle.ravel(), hits.depth.ravel().astype(np.float64)
    wanted = np.logical_or.reduce([(triangle >= ends[i]) & (triangle < ends[i + 1]) for i in meshes])
    number = np.flatnonzero(wanted)
    return TrueHits(number, np.asarray(ray.origin)[number] + depth[number, None] * np.asarray(ray.direction)[number])


def on_device(points: np.ndarray) -> tuple[Any, np.ndarray]:
    """World points (N, 3) as an Array3f around their middle, which is (3,)."""
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    return types().Array3f(np.ascontiguousarray((points - middle).T, np.float32)) + opaque_zero(), middle


def held(image: DepthImage, points: Any, middle: np.ndarray, tolerance: float) -> Any:
    """Bool on the device: whether the image's surface passes through points, to a tolerance in depth.

    points, middle: of `on_device`. tolerance: scene units; where the surface is seen at a slant, its patch counts.
    """
    camera, surface = image.camera, image.any_surface()
    pose = np.asarray(camera.camera_from_world, np.float64)
    shift = pose[:3, :3] @ middle + pose[:3, 3]
    numbers = opaque_numbers([*pose[:3, :3].ravel(), *shift, tolerance])
    static = tuple(getattr(camera, name) for name in camera.static_fields)
    kernel = _frozen_held(type(camera), static, surface.size)
    return kernel(device_camera(camera).on_device, surface.patches, points, numbers)


@functools.lru_cache(maxsize=64)
def _frozen_held(model: type[Camera], static: tuple[Any, ...], size: tuple[int, int]) -> Any:
    import drjit as dr

    from mpcam_kernels.depth_tiles import Levels
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.marching import Surface
    from mpcam_kernels.poses import placed

    @frozen
    def kernel(camera: Any, patches: Any, points: Any, numbers: list[Any]) -> Any:
        t = types()
        ((u, v), depth, seen) = camera.local_project(placed(t, numbers[:12], points))[0]
        surface = Surface(patches, patches, [], size, Levels.of(*size, 4), 0.0)
        patch, column, row, _ = surface.patch(t, u, v, seen)
        there = patch.at(u - column - 0.5, v - row - 0.5)
        return seen & dr.isfinite(patch.depth) & (abs(depth - there) <= numbers[12])

    return kernel
