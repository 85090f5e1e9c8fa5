"""The double sphere: two unit spheres and a pinhole, with projection and inverse in closed form."""

import dataclasses
import math
from typing import Annotated, Any

from mpcam.cameras.base import Camera
from mpcam.cameras.calibrated import FARTHEST, NEARLY_PI, Calibrated
from mpcam.cameras.fields import Limits, Number, Positive, Share
from mpcam.cameras.unified_omni import denominator, sphere_border, sphere_direction, widest_radius
from mpcam.math import PI, Array, atan2, cos, maximum, minimum, safe_sqrt, sin, sqrt, where


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class DoubleSphere(Calibrated, Camera):
    """r = rho / (alpha d2 + (1 - alpha) (xi d1 + z)), d1 = norm(x, y, z), d2 = norm(x, y, xi d1 + z), rho = norm(x, y).

    Usenko, Demmel and Cremers 2018, equations 40 to 51. A point lands on a unit sphere, from there, seen from a centre
    shifted by xi, on a second one, and from there, seen from a centre shifted by alpha / (1 - alpha), in the image.

    width, height: pixels. fx, fy, cx, cy: pixels, centre of the top left pixel at (0.5, 0.5); at the axis the image has
    fx / (1 + xi) pixels per radian. xi: above -1. alpha: 0 to 1. camera_from_world: 4x4, OpenCV axes. max_angle:
    largest angle between a ray and the axis, radians. The domain ends there, or where r stops increasing, whichever
    comes first: on the second sphere that is z2 = -w1 d2, with w1 = alpha / (1 - alpha) or its inverse, whichever is
    below 1. (Equation 43 puts that border at another angle, by taking the second sphere's point for one of the first:
    for xi = -0.5, alpha = 0.1, it takes in points behind the pinhole.)

    Raises InputError for sizes below 1, focal lengths that are not positive, xi and alpha out of range, numbers that
    are not finite, an angle outside (0, pi], and poses that are not rigid.
    """

    width: int
    height: int
    fx: Positive
    fy: Positive
    cx: Number
    cy: Number
    xi: Annotated[Any, Limits(above=-1)]
    alpha: Share
    camera_from_world: Any = None
    max_angle: Number = PI
    limit: Any = dataclasses.field(default=None, init=False)
    edge: Any = dataclasses.field(default=None, init=False)
    convex: bool = dataclasses.field(default=False, init=False)

    shape_fields = ("xi", "alpha")

    def __post_init__(self) -> None:
        self._check_frame()
        self._check_lens()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A common lens, and one with the second centre outside of the first sphere."""
        frame = (width, height, 0.37 * width, 0.38 * width, 0.52 * width, 0.49 * height)
        return {
            "double_sphere": cls(*frame, -0.2, 0.59, camera_from_world),
            "centre outside": cls(*frame, 1.5, 0.3, camera_from_world, math.radians(115)),
        }

    def _parts(self, theta: Array) -> tuple[Array, Array, Array]:
        """sin theta, d2 and the denominator of r, for a point at distance 1."""
        side, ahead = sin(theta), self.xi + cos(theta)
        second = sqrt(maximum(side * side + ahead * ahead, 1e-30))
        return side, second, denominator(self.alpha, side, side, ahead, second)

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        side, _, below = self._parts(theta)
        return side / below

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        side, second, below = self._parts(theta)
        return (cos(theta) * below + side * side * (self.alpha * self.xi / second + 1 - self.alpha)) / (below * below)

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        return minimum(self._inverse(r), self.angle_limit())

    def _inverse(self, r: Array) -> Array:
        """theta of r: from the image to the second sphere, and along its radius to the first."""
        side, ahead = sphere_direction(self.alpha, minimum(r, widest_radius(self.alpha)))
        square = side * side + ahead * ahead
        far = maximum(self.xi * ahead + safe_sqrt(square - self.xi * self.xi * side * side), 0.0)
        return atan2(far * side, far * ahead - self.xi * square)

    def largest_angle(self) -> Array:
        """Where r is largest, or FARTHEST, radians."""
        xi, (side, ahead) = self.xi, sphere_border(self.alpha)
        far = maximum(xi * ahead + safe_sqrt(1 - xi * xi * side * side), 0.0)
        border = minimum(atan2(far * side, far * ahead - xi), self._inverse(FARTHEST + 0.0 * xi))
        # A centre outside of the first sphere sees it twice.
        border = where(xi > 1, atan2(safe_sqrt(xi * xi - 1), -1.0 + 0.0 * xi), border)
        return minimum(border, NEARLY_PI)
