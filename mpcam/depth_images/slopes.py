"""How the surfaces that a camera sees go on from pixel to pixel, by the planes of their triangles."""

import functools
from typing import Any

import numpy as np

from mpcam.backend import opaque_numbers, types
from mpcam.depth_images import bent
from mpcam.depth_images.surface import spread_of
from mpcam.rendering.device import device_mesh
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.hits import Hits


def plane_slopes(hits: Hits) -> Any:
    """Derivatives of the depth to the right and downwards at each pixel, two numbers each; NaN where nothing is."""
    from mpcam_kernels.threads import threads

    known, mesh = device_camera(hits.camera), device_mesh(hits.mesh)
    (width, height), rotation = known.size, np.asarray(hits.camera.camera_from_world, np.float64)[:3, :3]
    kernel = _frozen_slopes((width, height), known.central)
    ray = known.ray
    rays = ray.direction, None if known.central else ray.origin, ray.valid
    seen = hits.device_triangle, hits.device_depth, mesh.faces, mesh.vertices
    fixed = bent.piece_rows(hits.camera), spread_of(known)[0], rays, opaque_numbers([*rotation.ravel()])
    return kernel(threads(types(), 0, width * height), seen, fixed)


@functools.lru_cache(maxsize=64)
def _frozen_slopes(size: tuple[int, int], central: bool) -> Any:
    import drjit as dr

    from mpcam_kernels.depth_slopes import STEEPEST, slope_of_plane
    from mpcam_kernels.frozen import frozen

    @frozen
    def slopes(pixel: Any, seen: tuple[Any, ...], fixed: tuple[Any, ...]) -> Any:
        t = types()
        triangle, depth, faces, vertices = seen
        pieces, spread, rays, rotation = fixed
        hit = triangle >= 0
        corners = dr.gather(t.Array3u, faces, t.UInt(dr.maximum(triangle, 0)), hit)
        a, b, c = (dr.gather(t.Array3f, vertices, corner, hit) for corner in corners)
        normal = dr.cross(b - a, c - a)
        normal = t.Array3f(*(sum(rotation[3 * i + j] * normal[j] for j in range(3)) for i in range(3)))
        if pieces is None:
            base, growth = dr.gather(t.Array2f, spread, pixel)
            found = slope_of_plane(t, size, pixel, depth, normal, base + growth * depth, rays)
        else:
            found = bent.plane_slopes(pieces, pixel, size, dr.select(hit, depth, 1.0), normal, STEEPEST)
        return dr.ravel(t.Array2f(*(dr.select(hit, part, dr.nan) for part in found)))

    return slopes
