"""Where light leaves a thing of glass: met in depth images of its inner side, or guessed from its thickness."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mpcam.backend import aligned, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.types import PosedRays, Ray
from mpcam.depth_images.depth_image import DepthImage, check_camera
from mpcam.depth_images.several import intersect
from mpcam.effects.first_interface import Entered
from mpcam.effects.refractor_solid import Solid
from mpcam.math import acos
from mpcam.math.optics import fresnel, reflect, refract
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import attributes, shade_device
from mpcam.scene.scene import Scene


class Left(NamedTuple):
    """One entry for each pixel, on the device: where light leaves, from the anchor, its direction, and whether it does;
    share: part of the light inside that passes. missing: where no interface was found, and light runs on as it did."""

    origin: Any
    along: Any
    left: Any
    share: Any
    missing: Any


def straight_on(start: Entered) -> Left:
    """As if there were no second interface."""
    import drjit as dr

    one = dr.full(types().Float, 1.0, dr.width(start.depth))
    return Left(start.origin, start.along, start.goes, one, dr.zeros(types().Bool, dr.width(start.depth)))


def by_marching(
    start: Entered, images: Sequence[DepthImage], index: float, inner: int, coarse: float | None, fine: float
) -> Left:
    """Rays inside are met with depth images of the inner side, and are reflected there where they cannot leave."""
    import drjit as dr

    t, pose = types(), np.eye(4)
    pose[:3, 3] = -start.anchor
    count, number = dr.width(start.depth), opaque_numbers([index])
    no = dr.zeros(t.Bool, count)
    state = start.origin, start.along, start.goes, no, dr.full(t.Float, 1.0, count), dr.zeros(t.Bool, count)
    for _ in range(inner + 1):
        rays = PosedRays(pose, Ray(state[0], state[1], state[2]))
        found = intersect(images, rays, coarse=coarse, fine=fine)
        state = _met()((found.device_hit, found.device_distance, found.device_normal), state, number)
    origin, along, _, left, share, missing = state
    return Left(origin, along, left, share, missing)


@functools.cache
def _met() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(found: tuple[Any, Any, Any], state: tuple[Any, ...], number: list[Any]) -> Any:
        t = types()
        hit, distance, normal = found
        origin, along, going, left, share, missing = state
        hit = going & hit & (dr.squared_norm(normal) > 0)
        normal, index = dr.select(hit, normal, along), 1.0 / number[0]
        out, passes = refract(along, normal, index)
        passes = hit & passes
        back = t.Array3f(reflect(along, normal))
        share = dr.select(passes, share * (1 - fresnel(along, normal, index)), share)
        origin = dr.select(hit, origin + along * distance, origin)
        along = dr.select(passes, t.Array3f(out), dr.select(hit, back, along))
        lost = going & ~hit
        return origin, along, going & hit & ~passes, left | passes | lost, share, missing | lost

    return kernel


def by_thickness(start: Entered, camera: Camera, solid: Solid, index: float) -> Left:
    """The second interface without a search (Wyman 2005): a thickness, and the normal that the eye sees there.

    The thickness is that along the pixel's ray, up to the nearest inner side, mixed with that along the normal by the
    angles before and after. The point so far along the ray inside is projected into the eye's image of the inner side,
    for its normal. Beside that image the normal is across the eye's ray, as along the outline; where light would be
    totally reflected, it leaves along the surface. Raises InputError for a camera without one image for each point.
    """
    check_camera(camera)
    behind = prepare(camera, solid.mesh, cull="front").frame()
    normals = shade_device(behind, Scene.of(solid.mesh), "normal")
    pose = np.asarray(camera.camera_from_world, np.float64)
    shift = pose[:3, :3] @ start.anchor + pose[:3, 3]
    numbers = opaque_numbers([*pose[:3, :3].ravel(), *shift, index])
    static = tuple(getattr(camera, name) for name in camera.static_fields)
    table = types().Float(aligned(solid.thickness)) + opaque_zero()
    faces = attributes(solid.mesh).faces, start.hits.device_triangle, start.hits.device_weights
    seen = start.depth, start.origin, start.view, start.normal, start.along, start.goes
    kernel = _frozen_thickness(type(camera), static, (camera.width, camera.height))
    return Left(*kernel(device_camera(camera).on_device, seen, (behind.device_depth, normals), faces, table, numbers))


@functools.lru_cache(maxsize=64)
def _frozen_thickness(model: type[Camera], static: tuple[Any, ...], size: tuple[int, int]) -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.poses import placed

    @frozen
    def kernel(camera: Any, seen: Any, behind: Any, mesh: Any, table: Any, numbers: list[Any]) -> Any:
        t = types()
        depth, origin, view, normal, along, goes = seen
        faces, triangle, weights = mesh
        far, encoded = behind
        hit = triangle >= 0
        corners = dr.gather(t.Array3u, faces, t.UInt(dr.maximum(triangle, 0)), hit)
        mix = 1 - weights[0] - weights[1], weights[0], weights[1]
        inward = sum(dr.gather(t.Float, table, corners[i], hit) * mix[i] for i in range(3))
        across = dr.select(hit & dr.isfinite(far), dr.maximum(far - depth, 0), inward)
        before, after = (acos(dr.clip(abs(dr.dot(way, normal)), 0, 1)) for way in (view, along))
        ratio = dr.select(before > 1e-3, after / dr.maximum(before, 1e-3), 1 / numbers[12])
        length = ratio * across + (1 - ratio) * inward
        point = origin + along * dr.maximum(length, 0)
        (u, v), _, there = camera.local_project(placed(t, numbers[:12], point))[0]
        # Beside the picture the nearest pixel of its border serves.
        column = t.Int(dr.clip(dr.floor(dr.select(there, u, 0)), 0, size[0] - 1))
        row = t.Int(dr.clip(dr.floor(dr.select(there, v, 0)), 0, size[1] - 1))
        pixel = t.UInt(row * size[0] + column)
        there &= dr.isfinite(dr.gather(t.Float, far, pixel, there))
        found = 2 * dr.gather(t.Array3f, encoded, pixel, there) - 1
        outline = along - view * dr.dot(view, along)
        second = dr.select(there, found, outline)
        sure = goes & (dr.squared_norm(second) > 1e-12)
        second = dr.select(sure, second, along)
        out, passes = refract(along, second, 1.0 / numbers[12])
        out = t.Array3f(out)
        out *= dr.rsqrt(dr.maximum(dr.squared_norm(out), 1e-30))
        share = dr.select(passes, 1 - fresnel(along, second, 1.0 / numbers[12]), 1.0)
        return point, dr.select(sure, out, along), goes, share, goes & ~there

    return kernel
