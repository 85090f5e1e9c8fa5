"""The rays that a camera's pixels send on from a true mirror or lens face, traced by Mitsuba on the surface itself."""

from typing import NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.types import Ray
from mpcam.decomposition.ray_error import bent
from mpcam.decomposition.reflector import reflector_of
from mpcam.geometry.surfaces import Surface
from mpcam.scene.mirror import Mirror


class MirrorRays(NamedTuple):
    """Per pixel, row by row. ray: in the world, origin (N, 3) on the surface, direction (N, 3), valid (N,). distance:
    (N,) from the camera to the surface along the pixel's ray, infinite beside it.
    """

    ray: Ray
    distance: np.ndarray


def mirror_rays(camera: Camera, mirror: Mirror) -> MirrorRays:
    """Where the pixels' rays go on, by the exact points and normals of the surface; float64.

    There is no ray beside the surface, and none where light is totally reflected in front of an interface.
    """
    whole = reflector_of(mirror.surface)
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    ray = camera.ray(np.stack([u.ravel(), v.ravel()], -1))
    face, distance, second, third = whole.trace(ray.origin, ray.direction)
    hit = (face >= 0) & ray.valid
    points, normals = whole.at(np.where(hit, face, 0), second, third)
    if isinstance(mirror.surface, Surface):  # the mesh that was traced lies a little inside or outside of it
        distance = np.where(hit, ((points - ray.origin) * ray.direction).sum(-1), np.inf)
    ways, passes = bent(ray.direction, normals, mirror.index)
    valid = hit & passes
    ways = np.where(valid[:, None], ways, (0.0, 0.0, 1.0))
    return MirrorRays(Ray(points, ways, valid), np.where(hit, distance, np.inf))
