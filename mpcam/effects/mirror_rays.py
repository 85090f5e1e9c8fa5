"""The rays that a camera's pixels send on from a true mirror or lens face."""

from typing import NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.types import Ray
from mpcam.decomposition.ray_error import bent
from mpcam.decomposition.reflector import pixel_hits, reflector_of
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
    found = pixel_hits(camera, reflector_of(mirror.surface))
    ways, passes = bent(found.along, found.normals, mirror.index)
    passes = passes & found.hit
    ways = np.where(passes[:, None], ways, (0.0, 0.0, 1.0))
    return MirrorRays(Ray(found.points, ways, passes), found.distance)
