"""Light along rays that meet depth images and are sent on by the stored normals (Rosen et al. 2011, section 6.1)."""

import functools
from dataclasses import dataclass
from typing import Any

from mpcam.backend import types
from mpcam.cameras.types import PosedRays, Ray
from mpcam.depth_images.intersections import Intersections
from mpcam.math.optics import reflect

MIRROR = 2.0
"""In place of a reflectance: what is met is the mirror itself, which has no color of its own."""


@dataclass(frozen=True)
class Surroundings:
    """On the device. reflectance: Float, one for each depth image, or MIRROR. tint: the mirror's color, and
    background: three numbers each. environment: of the scene, or None.
    """

    reflectance: Any
    tint: list[Any]
    background: list[Any]
    environment: Any


def after_meeting(
    found: Intersections, rays: PosedRays, light: Any, through: Any, around: Surroundings, sends: bool, last: bool
) -> tuple[Any, Any, PosedRays]:
    """Light so far, what rays let through, and the rays that go on from where others met depth images.

    rays: in a frame with the world's axes. sends: whether rays may go on from what they meet; last: not this time.
    """
    state = (found.device_hit, found.device_distance, found.device_image, found.device_color)
    normal = found.device_normal if sends else None
    light, through, ray = _frozen_meeting(last)(state, normal, tuple(rays.ray), light, through, around)
    return light, through, PosedRays(rays.pose, Ray(*ray))


@functools.cache
def _frozen_meeting(last: bool) -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(state: Any, normal: Any, rays: Any, light: Any, through: Any, around: Surroundings) -> Any:
        t = types()
        hit, distance, image, color = state
        origin, direction, valid = rays
        along = direction * dr.rsqrt(dr.maximum(dr.squared_norm(direction), 1e-30))

        def beyond(way: Any) -> Any:
            return t.Array3f(*around.background) if around.environment is None else around.environment.lookup(way)

        if normal is None:
            light = light + through * dr.select(hit, color, beyond(along))
            return light, through, rays
        part = dr.gather(t.Float, around.reflectance, t.UInt(dr.maximum(image, 0)), hit)
        mirror = hit & (part >= MIRROR)
        away = t.Array3f(*reflect(along, normal))
        share = t.Float(0) if last else dr.select(hit & ~mirror, part, 0.0)
        missed = dr.select(mirror, away, along) if last else along
        seen = dr.select(hit & ~mirror, color * (1 - share), beyond(missed))
        tint = t.Array3f(*around.tint)
        if last:
            seen = dr.select(mirror, seen * tint, seen)
        else:
            seen = dr.select(mirror, 0.0, seen)
        light = light + through * seen
        through = through * dr.select(mirror, tint, share)
        goes = valid & hit & (mirror | (share > 0)) & (dr.squared_norm(normal) > 0)
        start = origin + along * dr.select(hit, distance, 0.0)
        return light, through, (dr.select(goes, start, 0.0), dr.select(goes, away, along), goes)

    return kernel
