"""The rays that leave a thing of glass, and the true ones, traced from interface to interface in double precision."""

from typing import NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.types import Ray
from mpcam.decomposition.ray_error import bent
from mpcam.decomposition.reflector import pixel_hits
from mpcam.effects.refractor_solid import Solid
from mpcam.math.optics import fresnel as reflected_part


class RefractorRays(NamedTuple):
    """Per pixel of the eye, row by row.

    ray: in the world, where light leaves the glass: origin (N, 3), direction (N, 3), valid (N,), which is False beside
    the glass and where no light gets out. distance: (N,) from the eye to the glass, infinite beside it. share: (N,)
    part of the light that passes both interfaces, 1 without Fresnel's equations. reflected: rays that the outer surface
    reflects, None without Fresnel's equations; part: (N,) what it reflects. missing: (N,) where no second interface was
    found, and rays run on as the first has bent them.
    """

    ray: Ray
    distance: np.ndarray
    share: np.ndarray
    reflected: Ray | None
    part: np.ndarray
    missing: np.ndarray


def traced_rays(camera: Camera, solid: Solid, index: float, inner: int, fresnel: bool) -> RefractorRays:
    """The true rays: the exact points and normals of the surface at each interface, Snell's law, float64.

    inner: how many total reflections inside are followed; what is still inside after them gets no light.
    """
    found = pixel_hits(camera, solid.reflector)
    normals = np.where(found.hit[:, None], found.normals, (0.0, 0.0, -1.0))
    along, passes = bent(found.along, normals, index)
    going = found.hit & passes
    origin, share, part = found.points.copy(), np.ones(len(going)), np.zeros(len(going))
    reflected = None
    if fresnel:
        part = np.where(found.hit, reflected_part(found.along.T, normals.T, index), 0.0)
        ways, _ = bent(found.along, normals, None)
        reflected = Ray(found.points, np.where(found.hit[:, None], ways, (0.0, 0.0, 1.0)), found.hit)
        share = 1.0 - part
    left, missing = np.zeros(len(going), bool), np.zeros(len(going), bool)
    for _ in range(inner + 1):
        rows = np.flatnonzero(going)
        if len(rows) == 0:
            break
        start, way = origin[rows], along[rows]
        second = solid.reflector.first_hits(start + solid.off * way, way)
        lost = ~second.hit  # through an edge, by rounding
        normals = np.where(lost[:, None], way, second.normals)
        out, passes = bent(way, normals, 1.0 / index)
        back, _ = bent(way, normals, None)
        if fresnel:
            share[rows] *= np.where(passes & ~lost, 1.0 - reflected_part(way.T, normals.T, 1.0 / index), 1.0)
        origin[rows] = np.where(lost[:, None], start, second.points)
        along[rows] = np.where(lost[:, None], way, np.where(passes[:, None], out, back))
        missing[rows] = lost
        left[rows] = passes | lost
        going[rows] = ~(passes | lost)
    along = np.where(left[:, None], along, (0.0, 0.0, 1.0))
    return RefractorRays(Ray(origin, along, left), found.distance, share, reflected, part, missing)
