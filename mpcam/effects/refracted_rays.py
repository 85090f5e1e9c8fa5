"""The rays that leave a thing of glass, by rasterizing its first interface and one of several ways to the second."""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.types import Ray
from mpcam.effects.first_interface import Entered, entered
from mpcam.effects.inner_images import inner_cameras, inner_images
from mpcam.effects.refractor_rays import RefractorRays, traced_rays
from mpcam.effects.refractor_solid import Solid
from mpcam.effects.second_interface import Left, by_marching, by_thickness, straight_on
from mpcam.errors import InputError


class Inside(NamedTuple):
    """index, second, inner, fresnel: see `mpcam.Refractor`. cameras: of the depth images of the inner side, None to
    choose them, with `size` pixels along a side. coarse, fine: steps, see `DepthImage.intersect`."""

    index: float
    second: str
    inner: int
    fresnel: bool
    cameras: tuple[Camera, ...] | None
    size: int
    coarse: float | None
    fine: float


def refracted_rays(camera: Camera, solid: Solid, inside: Inside) -> RefractorRays:
    """The rays of a camera's pixels beyond the glass. Raises InputError as `by_thickness` does."""
    if inside.second == "trace":
        return traced_rays(camera, solid, inside.index, inside.inner, inside.fresnel)
    start = entered(camera, solid, inside.index)
    if inside.second == "wyman":
        left = by_thickness(start, camera, solid, inside.index)
    elif inside.second == "march":
        cameras = inside.cameras or inner_cameras(solid, inside.size)
        images = inner_images(solid, cameras)
        if not images:
            raise InputError("inside: none of the cameras sees the glass: give others, or leave them out")
        left = by_marching(start, images, inside.index, inside.inner, inside.coarse, inside.fine)
    else:
        left = straight_on(start)
    return _on_host(start, left, inside.fresnel)


def _on_host(start: Entered, left: Left, fresnel: bool) -> RefractorRays:
    def vectors(value: Any) -> np.ndarray:
        return np.stack([numbers(part) for part in value], -1)

    def numbers(value: Any) -> np.ndarray:
        return np.asarray(value.numpy()).astype(np.float64)

    hit, passes = (np.asarray(value.numpy()) for value in (start.hit, left.left))
    ways = np.where(passes[:, None], _unit(vectors(left.along)), (0.0, 0.0, 1.0))
    ray = Ray(vectors(left.origin) + start.anchor, ways, passes)
    part = np.where(hit, numbers(start.part), 0.0) if fresnel else np.zeros(len(hit))
    share = (1 - part) * numbers(left.share) if fresnel else np.ones(len(hit))
    reflected = None
    if fresnel:
        back = np.where(hit[:, None], _unit(vectors(start.reflected)), (0.0, 0.0, 1.0))
        reflected = Ray(np.where(hit[:, None], vectors(start.origin) + start.anchor, 0.0), back, hit)
    distance = np.where(hit, numbers(start.depth), np.inf)
    return RefractorRays(ray, distance, share, reflected, part, np.asarray(left.missing.numpy()))


def _unit(ways: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    return ways / np.where(length > 0, length, 1.0)
