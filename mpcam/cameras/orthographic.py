"""The orthographic camera: all rays are parallel."""

import dataclasses
from typing import Any, ClassVar

from mpcam.cameras.base import Camera
from mpcam.cameras.fields import Number, Positive
from mpcam.cameras.types import Box, Domain, Projection, Ray, RayGeometry
from mpcam.math import Array, Vector, isfinite, maximum, minimum, vector, where


@dataclasses.dataclass(frozen=True, eq=False)
class Orthographic(Camera):
    """Parallel projection along +z: pixel = (cx + scale x, cy + scale y) for points with z >= 0.

    width, height: pixels. scale: pixels per scene unit (defaults to half the smaller side: [-1, 1] fills the image).
    cx, cy: pixel of the axis (defaults to the image center). camera_from_world: 4x4, OpenCV axes. Depth is z.
    Raises InputError for sizes below 1, a scale that is not positive, and poses that are not rigid.
    """

    width: int
    height: int
    scale: Positive = None
    cx: Number = None
    cy: Number = None
    camera_from_world: Any = None

    ray_geometry: ClassVar[RayGeometry] = "parallel"

    def __post_init__(self) -> None:
        self._check_frame()
        defaults = {"scale": 0.5 * min(self.width, self.height), "cx": 0.5 * self.width, "cy": 0.5 * self.height}
        for name, default in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, default)
        self._check_numbers()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A little more than [-1, 1] across."""
        return {"orthographic": cls(width, height, 0.4 * width, camera_from_world=camera_from_world)}

    @property
    def domain(self) -> Domain:
        """No largest angle and no image circle: the whole half-space in front of the camera plane is seen."""
        return Domain(None, None)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame: origin on the camera plane, direction +z."""
        u, v = pixel
        valid = isfinite(u) & isfinite(v)
        x, y = (where(valid, u, 0.0) - self.cx) / self.scale, (where(valid, v, 0.0) - self.cy) / self.scale
        zero = 0.0 * x
        return Ray(vector(x, y, zero), vector(zero, zero, zero + 1.0), valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Image of a point in the camera frame; valid from the camera plane on, where its pixel is finite."""
        x, y, z = point
        u, v = self.local_image(point)[0]
        valid = (z >= 0) & isfinite(u) & isfinite(v) & isfinite(z)
        return (Projection(vector(where(valid, u, self.cx), where(valid, v, self.cy)), where(valid, z, 0.0), valid),)

    def local_image(self, point: Vector) -> tuple[Vector, Array]:
        """Pixel of a point, also behind the camera plane, and whether it lies in front."""
        return vector(self.cx + self.scale * point[0], self.cy + self.scale * point[1]), point[2] >= 0

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Box of the three corners; exact unless the triangle crosses the camera plane."""
        finite = isfinite(sum(corner[i] for corner in (a, b, c) for i in range(3)))
        a, b, c = (vector(*(where(finite, corner[i], 0.0) for i in range(3))) for corner in (a, b, c))
        low, high = [], []
        for i, center in enumerate((self.cx, self.cy)):
            low.append(center + self.scale * minimum(minimum(a[i], b[i]), c[i]))
            high.append(center + self.scale * maximum(maximum(a[i], b[i]), c[i]))
        valid = finite & ((a[2] >= 0) | (b[2] >= 0) | (c[2] >= 0))
        return Box(vector(*low), vector(*high), valid)
