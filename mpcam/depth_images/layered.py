"""Layered depth images: behind each surface the next one, as many as there are layers (Shade et al. 1998).

The baseline for cameras that reach around what they look at: it keeps the camera's rays and sees through the surfaces.
Layers are peeled by tracing on from the layer before, on the host; a frame takes as many of these as there are layers.
"""

from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends
from mpcam.cameras.types import Ray
from mpcam.checks import whole_number
from mpcam.depth_images.depth_image import DepthImage, check_camera
from mpcam.depth_images.intersections import Intersections
from mpcam.depth_images.several import intersect
from mpcam.errors import InputError
from mpcam.rendering.raytrace import RayTraced
from mpcam.rendering.shade import check_shading, shade
from mpcam.scene.scene import Scene

LEAST, MOST = 1, 8
STEP = 1e-5  # of the mesh's longest side: where the next layer may begin


class LayeredDepthImage:
    """Several surfaces along each pixel's ray, one `DepthImage` for each layer, the nearest first."""

    def __init__(self, layers: Any):
        self.layers = tuple(layers)
        if not self.layers or not all(isinstance(layer, DepthImage) for layer in self.layers):
            raise InputError("layers: give a list of mpcam.DepthImage, at least one")

    @classmethod
    def render(
        cls,
        camera: Camera,
        scene: Any,
        layers: int = 4,
        *,
        color: bool = True,
        normals: bool = False,
        shading: str = "light",
    ) -> "LayeredDepthImage":
        """The first so many surfaces along each pixel's ray, front sides and back sides alike.

        camera: any that a depth image may have, with straight rays. layers: 1 to 8. color, normals, shading:
        see `DepthImage.render`; shading is that of the camera's view. Surfaces closer behind each other than 1e-5 of
        the mesh's longest side are taken for one. Raises InputError.
        """
        check_camera(camera)
        check_shading(shading)
        layers = whole_number("layers", layers, LEAST, MOST)
        if isinstance(camera, Bends):
            raise InputError(f"layers are peeled along straight rays, and those of a {type(camera).__name__} are bent")
        whole = Scene.of(scene)
        mesh, size = whole.mesh, (camera.height, camera.width)
        centers = np.stack(np.meshgrid(np.arange(size[1]) + 0.5, np.arange(size[0]) + 0.5), -1).reshape(-1, 2)
        ray = camera.ray(centers)
        step = STEP * float(np.ptp(mesh.bounds, axis=0).max()) if mesh.triangle_count else 0.0
        reached, going, found = np.zeros(len(centers)), ray.valid, []
        for _ in range(layers):
            origin = np.where(going[:, None], ray.origin + reached[:, None] * ray.direction, 0.0)
            hits = RayTraced(camera, mesh, Ray(origin, ray.direction, going)).frame()
            depth = reached + hits.depth.ravel()
            colors = shade(hits, whole, shading) if color else None
            facing = 2.0 * shade(hits, whole, "normal") - 1.0 if normals else None
            found.append(DepthImage(camera, depth.reshape(size), color=colors, normals=facing))
            going = going & np.isfinite(depth)
            reached = np.where(going, depth + step, 0.0)
        return cls(found)

    def intersect(self, origins: Any, directions: Any = None, **settings: Any) -> Intersections:
        """Where rays first meet any layer; `image` of the result is the layer. settings: see `mpcam.intersect`."""
        return intersect(self.layers, origins, directions, **settings)

    def __repr__(self) -> str:
        return f"LayeredDepthImage({len(self.layers)} x {self.layers[0]})"
