"""Brown and Conrady's lens: a pinhole with radial and tangential distortion, the commonest calibrated camera."""

import dataclasses
from typing import Annotated, Any, ClassVar, Self

from mpcam.cameras import folds
from mpcam.cameras.base import Camera
from mpcam.cameras.calibrated import FARTHEST, described
from mpcam.cameras.coefficients import coefficients_of
from mpcam.cameras.distortion import Distortion, Reach
from mpcam.cameras.fields import Limits, Number, Positive
from mpcam.cameras.symmetric import finite_pixel, project_centered
from mpcam.cameras.types import Domain, Projection, Ray, RayGeometry
from mpcam.math import PI, Array, Vector, absolute, atan, epsilon, library, maximum, normalize, safe_sqrt, vector, where

_LARGEST = 1e30  # of a coefficient; those of telephoto lenses grow with the power of the focal length


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BrownConrady(Camera):
    """Pixel = (cx + fx x', cy + fy y') of a point with x = X / Z, y = Y / Z, s = x^2 + y^2, in OpenCV's form:

        R  = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
        x' = x R + 2 p1 x y + p2 (s + 2 x^2),    y' = y R + p1 (s + 2 y^2) + 2 p2 x y

    Conrady 1919 and Brown 1966, with the rational radial term of OpenCV. It is COLMAP's SIMPLE_RADIAL, RADIAL, OPENCV
    and FULL_OPENCV, Kalibr's radtan, and plumb_bob and rational_polynomial of ROS.

    width, height: pixels. fx, fy, cx, cy: focal lengths and principal point, pixels, center of the top left pixel at
    (0.5, 0.5). k: up to six numbers k1 to k6, k1 to k3 in the numerator, missing ones 0. (OpenCV's own list is k1, k2,
    p1, p2, k3, ...) p: p1 and p2. camera_from_world: 4x4, OpenCV axes. max_angle: largest angle between a ray and the
    axis, radians; rays reach less than 90 degrees in any case.

    The map folds: past some radius, points come back towards the center. The domain is the part around the axis where
    it has not, found from the coefficients (see `folds`); points and pixels beyond are invalid, and the inverse is
    bracketed there, so it never gives the other side of a fold. Derived, where all parameters are plain numbers: reach.

    Raises InputError for sizes below 1, focal lengths that are not positive, too many coefficients, numbers that are
    not finite, an angle outside (0, pi / 2], and poses that are not rigid.
    """

    width: int
    height: int
    fx: Positive
    fy: Positive
    cx: Number
    cy: Number
    k: Annotated[Any, tuple[float, ...]] = ()
    p: Annotated[Any, tuple[float, ...]] = ()
    camera_from_world: Any = None
    max_angle: Annotated[Any, Limits(above=0, at_most=0.5 * PI)] = 0.5 * PI
    reach: Any = dataclasses.field(default=None, init=False)

    ray_geometry: ClassVar[RayGeometry] = "central"

    def __post_init__(self) -> None:
        self._check_frame()
        self._check_numbers()
        for name, count in (("k", 6), ("p", 2)):
            given = coefficients_of("BrownConrady", name, getattr(self, name), count, _LARGEST)
            object.__setattr__(self, name, given + (0.0,) * (count - len(given)))
        numbers = (self.fx, self.fy, self.cx, self.cy, self.max_angle, *self.k, *self.p)
        found = folds.reach(self.distortion, self.max_angle) if library(*numbers) == "numpy" else None
        object.__setattr__(self, "reach", found)

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Self]:
        """Barrel distortion as webcams have it, a wide rational lens, and one that folds within the image."""

        def lens(focal: float, k: tuple[float, ...], p: tuple[float, ...]) -> Self:
            f = focal * min(width, height)
            return cls(width, height, f, 0.99 * f, 0.49 * width, 0.52 * height, k, p, camera_from_world)

        return {
            "webcam": lens(0.9, (-0.28, 0.09, -0.01), (8e-4, -6e-4)),
            "wide": lens(0.35, (9.1, 5.2, 0.19, 9.4, 8.1, 1.1), (1e-4, -2e-4)),
            "folds": lens(1.0, (-0.3, -0.02), (0.004, -0.003)),
        }

    @property
    def distortion(self) -> Distortion:
        """The map from the plane z = 1 to the image, in focal lengths."""
        return Distortion(self.k, (self.p[1], self.p[0]))

    @property
    def domain(self) -> Domain:
        """The largest angle, and the largest radius in pixels, both at the side towards (p2, p1).

        The radius is None where the image goes to infinity.
        """
        reach = self._reach()
        radius = maximum(self.fx, self.fy) * reach.rim
        endless = library(radius) == "numpy" and (reach.rim > 0.9 * FARTHEST or reach.outer > 0.9 * folds.WIDEST)
        return Domain(atan(reach.outer), None if endless else radius)

    @property
    def inner_angle(self) -> float:
        """All rays up to this angle from the axis are valid, radians."""
        return atan(self._reach()[0])

    def _reach(self) -> Reach:
        return folds.reach(self.distortion, self.max_angle) if self.reach is None else Reach(*self.reach)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame; valid in the image of the domain."""
        u, v, valid = finite_pixel(pixel)
        u, v = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        reach = self._reach()
        valid = valid & (maximum(absolute(u), absolute(v)) < 2.0 * FARTHEST)
        u, v = where(valid, u, 0.0), where(valid, v, 0.0)
        valid = valid & (u * u + v * v <= reach.rim * reach.rim * (1.0 + 16.0 * epsilon(u)))
        # The pixel is a sum with the principal point, and rounded as that.
        sizes = [2.0 * absolute(c) / f + absolute(a) for c, f, a in ((self.cx, self.fx, u), (self.cy, self.fy, v))]
        x, y, found = self.distortion.undistorted(reach, u, v, epsilon(u) * maximum(*sizes))
        valid = valid & found
        zero = 0.0 * x
        x, y = where(valid, x, 0.0), where(valid, y, 0.0)
        return Ray(vector(zero, zero, zero), normalize(vector(x, y, zero + 1.0)), valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Image of a point in the camera frame; valid in the domain, not at the camera's center."""
        return (project_centered(self, point),)

    def local_image(self, point: Vector) -> tuple[Vector, Array]:
        """Pixel of a point, and whether it lies in the domain.

        The pixel of a point beyond is that of a point at the same azimuth, on the largest circle within the domain.
        """
        x, y, z = point
        reach, distortion = self._reach(), self.distortion
        rho = safe_sqrt(x * x + y * y)
        ahead = (z > 0) & (rho <= reach.outer * (1.0 + 4.0 * epsilon(rho)) * z)
        depth = where(ahead, z, 1.0)
        near_x, near_y = where(ahead, x / depth, 0.0), where(ahead, y / depth, 0.0)
        inside = ahead & distortion.holds(reach, near_x, near_y)
        off_axis = rho > 0
        shrink = reach.inner / where(off_axis, rho, 1.0)
        # Straight behind the camera, the point to the right stands for the whole circle.
        right = where(off_axis | ahead, 0.0, reach.inner)
        x = where(inside, near_x, x * shrink + right)
        y = where(inside, near_y, y * shrink)
        u, v = distortion.image(x, y)
        return vector(self.cx + self.fx * u, self.cy + self.fy * v), inside

    def __repr__(self) -> str:
        return described(self, ("fx", "fy", "cx", "cy", "k", "p"), 0.5 * PI)
