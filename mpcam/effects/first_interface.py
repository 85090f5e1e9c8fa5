"""Where light from the eye enters a thing of glass: first hits and normals by the rasterizer, Snell's law per pixel."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.effects.refractor_solid import Solid
from mpcam.math.optics import fresnel as reflected_part
from mpcam.math.optics import reflect, refract
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import shade_device
from mpcam.scene.scene import Scene


@dataclass(frozen=True)
class Entered:
    """One entry for each pixel, on the device; vectors have the world's axes, and points are taken from `anchor` (3,).

    hit: whether the glass is seen. depth: how far away it is. origin: where; view: the ray's direction before, normal:
    of the surface towards the eye, along: the direction inside, goes: whether there is one. part: what is reflected,
    reflected: whereto. hits: of the eye's camera on the solid's mesh.
    """

    hits: Hits
    anchor: np.ndarray
    hit: Any
    depth: Any
    origin: Any
    view: Any
    normal: Any
    along: Any
    goes: Any
    part: Any
    reflected: Any


def entered(camera: Camera, solid: Solid, index: float) -> Entered:
    """What a camera outside sees of the glass, and how light goes on inside."""
    hits = prepare(camera, solid.mesh, cull="back").frame()
    normal = shade_device(hits, Scene.of(solid.mesh), "normal")
    anchor, pose = solid.reflector.center, np.asarray(hits.view.pose, np.float64)
    shift = -pose[:3, :3].T @ pose[:3, 3] - anchor
    numbers = opaque_numbers([*pose[:3, :3].T.ravel(), *shift, index])
    ray = hits.view.ray
    found = _kernel()(hits.device_depth, (ray.origin, ray.direction, ray.valid), normal, numbers)
    return Entered(hits, anchor, *found)


@functools.cache
def _kernel() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.poses import placed

    @frozen
    def kernel(depth: Any, ray: tuple[Any, Any, Any], encoded: Any, numbers: list[Any]) -> Any:
        t = types()
        origin, direction, valid = ray
        hit = valid & dr.isfinite(depth)
        normal = dr.select(hit, 2 * encoded - 1, t.Array3f(0, 0, 1))
        point = placed(t, numbers[:12], origin + direction * dr.select(hit, depth, 0.0))
        view = placed(t, [*numbers[:9], 0.0, 0.0, 0.0], direction)
        along, passes = refract(view, normal, numbers[12])
        part = reflected_part(view, normal, numbers[12])
        return hit, depth, point, view, normal, t.Array3f(along), hit & passes, part, t.Array3f(reflect(view, normal))

    return kernel
