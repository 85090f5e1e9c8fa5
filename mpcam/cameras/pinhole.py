"""The pinhole camera: straight lines stay straight."""

import dataclasses
import math
from typing import Annotated, Any, ClassVar, Self

from mpcam.cameras.base import Camera
from mpcam.cameras.fields import Limits, Number, Positive
from mpcam.cameras.outline import HIDDEN, NEAR, UNSURE, Outline, VertexView, small_outline
from mpcam.cameras.types import Box, Domain, Projection, Ray, RayGeometry
from mpcam.errors import InputError, KeyProblem
from mpcam.math import PI, Array, Vector, epsilon, isfinite, maximum, minimum, norm, normalize, tan, vector, where

FAR = 1e9
"""Pixels that stand for infinity in boxes, so that no arithmetic on boxes makes NaN."""


@dataclasses.dataclass(frozen=True, eq=False)
class Pinhole(Camera):
    """Central perspective: pixel = (cx + fx x / z, cy + fy y / z) for points with z > 0.

    width, height: pixels. fx, fy: focal lengths, pixels (fy defaults to fx, fx to width / 2: 90 degrees across).
    cx, cy: principal point, pixels, center of the top left pixel at (0.5, 0.5) (defaults to the image center).
    camera_from_world: 4x4, OpenCV axes. Raises InputError for sizes below 1, focal lengths that are not positive,
    numbers that are not finite, and poses that are not rigid.
    """

    width: int
    height: int
    fx: Positive = None
    fy: Positive = None
    cx: Number = None
    cy: Number = None
    camera_from_world: Any = None

    ray_geometry: ClassVar[RayGeometry] = "central"

    def __post_init__(self) -> None:
        self._check_frame()
        defaults = {"fx": 0.5 * self.width, "fy": self.fx, "cx": 0.5 * self.width, "cy": 0.5 * self.height}
        for name, default in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, self.fx if name == "fy" else default)
        self._check_numbers()

    @classmethod
    def from_fov(cls, width: int, height: int, fov_x: float, camera_from_world: Any = None) -> Self:
        """Square pixels, centered, `fov_x` radians across the width; raises InputError outside (0, pi)."""
        if not 0 < fov_x < PI:
            raise InputError(f"Pinhole.from_fov(fov_x={fov_x!r}): radians between 0 and pi are needed")
        return cls(width, height, 0.5 * width / tan(0.5 * fov_x), camera_from_world=camera_from_world)

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        fov: Annotated[float, Limits(above=0, below=180)] | None = None,
        focal: tuple[Positive, Positive] | None = None,
        center: tuple[float, float] | None = None,
    ) -> Self:
        """From the keys of a scene file: `fov` is the angle across the width, degrees, 60 if there is no `focal`."""
        if focal is None:
            if center is not None:
                raise KeyProblem("center", "give camera.focal too, or leave center out")
            return cls.from_fov(width, height, math.radians(60.0 if fov is None else fov))
        if fov is not None:
            raise KeyProblem("fov", "give fov or focal, not both")
        return cls(width, height, *focal, *(center or (0.5 * width, 0.5 * height)))

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """Some 80 degrees across, off center."""
        frame = (0.6 * width, 0.55 * width, 0.47 * width, 0.52 * height)
        return {"pinhole": cls(width, height, *frame, camera_from_world)}

    @property
    def domain(self) -> Domain:
        """Rays up to (not including) 90 degrees from the axis; the image is not a disc."""
        return Domain(0.5 * PI, None)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame."""
        u, v = pixel
        valid = isfinite(u) & isfinite(v)
        x, y = (where(valid, u, 0.0) - self.cx) / self.fx, (where(valid, v, 0.0) - self.cy) / self.fy
        zero = 0.0 * x
        return Ray(vector(zero, zero, zero), normalize(vector(x, y, zero + 1.0)), valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Image of a point in the camera frame; valid in front of the camera plane, where its pixel is finite."""
        x, y, z = point
        valid = (z > 0) & isfinite(x) & isfinite(y) & isfinite(z)
        x, y, z = where(valid, x, 0.0), where(valid, y, 0.0), where(valid, z, 1.0)
        u, v = self.local_image(vector(x, y, z))[0]
        finite = isfinite(u) & isfinite(v)
        pixel = vector(where(finite, u, self.cx), where(finite, v, self.cy))
        return (Projection(pixel, norm(vector(x, y, z)), valid & finite),)

    def local_image(self, point: Vector) -> tuple[Vector, Array]:
        """Pixel of a point, and whether it lies in front of the camera plane; the pixel means nothing elsewhere."""
        x, y, z = point
        front = z > 0
        depth = where(front, z, 1.0)
        return vector(self.cx + self.fx * (x / depth), self.cy + self.fy * (y / depth)), front

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Exact box of the part in front of the camera plane; unbounded sides are at +-1e9 pixels."""
        return perspective_box((self.fx, self.fy), (self.cx, self.cy), a, b, c)

    def local_vertex_view(self, point: Vector) -> VertexView:
        """What a vertex knows of the projection around it, for `local_outline`."""
        z, size = point[2], norm(point)
        near = z > 1e-3 * size  # farther out, rounding in the image is no longer small against pixels
        inverse = 1.0 / where(near, z, 1.0)
        place = where(near, NEAR, where(z > -1e-6 * size, UNSURE, HIDDEN))
        return VertexView(inverse, 0.0 * z, inverse * inverse, where(size > 0, place, UNSURE))

    def local_outline(self, points: list[Vector], views: list[VertexView]) -> tuple[Outline, Array]:
        """Box and three lines around a small triangle, and whether they hold."""
        return small_outline((self.cx, self.cy), (self.fx, self.fy), points, views)

    def local_bound_rough(self, a: Vector, b: Vector, c: Vector) -> Box:
        """The box for triangles of which `local_outline` is not sure."""
        return self.local_bound(a, b, c)


def perspective_box(focal: tuple[Array, Array], center: tuple[Array, Array], a: Vector, b: Vector, c: Vector) -> Box:
    """Exact box of the part of a triangle in front of the camera plane; unbounded sides are at +-1e9 pixels.

    An edge that crosses the camera plane at (x, y, 0) runs to infinity along (x, y).
    """
    finite = isfinite(sum(corner[i] for corner in (a, b, c) for i in range(3)))
    a, b, c = (vector(*(where(finite, corner[i], 1.0) for i in range(3))) for corner in (a, b, c))
    low, high = [FAR, FAR], [-FAR, -FAR]
    for corner in (a, b, c):
        front = corner[2] > 0
        depth = where(front, corner[2], 1.0)
        for i in range(2):
            image = maximum(minimum(center[i] + focal[i] * (corner[i] / depth), FAR), -FAR)
            low[i] = minimum(low[i], where(front, image, FAR))
            high[i] = maximum(high[i], where(front, image, -FAR))
    for p, q in ((a, b), (b, c), (c, a)):
        crosses = (p[2] > 0) != (q[2] > 0)
        for i in range(2):
            toward = p[i] * q[2] - q[i] * p[2]  # sign of the crossing point's coordinate, times that of q[2] - p[2]
            toward = where(q[2] > p[2], toward, -toward)
            slack = 4 * epsilon(toward) * (abs(p[i] * q[2]) + abs(q[i] * p[2]))
            low[i] = where(crosses & (toward <= slack), -FAR, low[i])
            high[i] = where(crosses & (toward >= -slack), FAR, high[i])
    valid = finite & ((a[2] > 0) | (b[2] > 0) | (c[2] > 0))
    return Box(vector(*low), vector(*high), valid)
