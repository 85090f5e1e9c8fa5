"""What bends rays in a scene: a curved mirror, or the face of a lens or of water."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import is_number, shown
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface


@dataclass(frozen=True, eq=False)
class Mirror:
    """A smooth surface in which the rest of a scene is seen.

    surface: a Mesh (smooth unless it has facets' normals) or a Surface. index: None for a mirror; else the refractive
    index behind the surface over that on the camera's side, and the scene is seen through it. color: linear RGB, what
    is seen is multiplied by it. triangles, resolution: the camera triangles that stand for it, and pixels along the
    short sides of each. mode: how rays run between their vertices, see `mpcam.decompose`. depth_images: settings of
    method "depth_image" (size, aside, images, coarse, fine). bounces, reflectance, own: how often light is reflected,
    and by what, for the methods that can, "depth_image" and "raytrace"; for all these see `mpcam.Reflection`.
    camera_triangles: CameraTriangles, or what `mpcam.fit` returned, made for the eye of the scene's camera; they are
    taken wherever no other number of triangles is asked for. Raises InputError for a field of the wrong kind.
    """

    surface: Any
    index: float | None = None
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    triangles: int = 104
    resolution: int = 64
    mode: str = "normals"
    depth_images: Any = None
    bounces: int = 1
    reflectance: Any = 0.0
    own: bool = False
    camera_triangles: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.surface, (Mesh, Surface)):
            raise InputError(
                f"mirror surface is a {type(self.surface).__name__}: give a Mesh or a Surface, e.g. Surface.sphere()"
            )
        given = getattr(self.camera_triangles, "camera", self.camera_triangles)
        if given is not None and not isinstance(given, CameraTriangles):
            raise InputError(
                f"mirror camera_triangles is a {type(given).__name__}: give CameraTriangles, or what mpcam.fit returned"
            )
        object.__setattr__(self, "camera_triangles", given)
        if self.index is not None:
            if not is_number(self.index) or self.index <= 0:
                raise InputError(
                    f"mirror index={shown(self.index)}: give a finite number above 0, or None for a mirror"
                )
        object.__setattr__(self, "color", tint_of("mirror", self.color))


def tint_of(what: str, color: Any) -> tuple[float, float, float]:
    """A color that something multiplies light by, as three numbers; raises InputError for anything else."""
    found = np.asarray(color, np.float64) if np.shape(color) == (3,) else np.full(3, np.nan)
    if not np.isfinite(found).all() or (found < 0).any():
        raise InputError(f"{what} color={shown(color)}: give 3 finite linear RGB numbers, none negative")
    return float(found[0]), float(found[1]), float(found[2])
