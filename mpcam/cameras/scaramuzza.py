"""Scaramuzza's omnidirectional camera: a polynomial of the radius says how far ahead a pixel's ray points."""

import dataclasses
import functools
from typing import Annotated, Any

from mpcam.cameras.base import Camera
from mpcam.cameras.calibrated import Calibrated
from mpcam.cameras.coefficients import coefficients_of
from mpcam.cameras.fields import Number
from mpcam.math import (
    PI,
    Array,
    atan2,
    cos,
    detach,
    first_true,
    library,
    minimum,
    polynomial,
    safe_sqrt,
    sign_changes,
    sin,
    where,
)
from mpcam.math.roots import bracketed_newton

LEAST = 5e-3
"""Radians per focal length at which the domain ends."""

_MOST = 12
_STEPS = 20  # of Newton, from an answer that is near
_LARGEST = 1e6  # of a coefficient; views have less than 1
_WIDEST = 1e3  # focal lengths, where no angle increases as fast as LEAST


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Scaramuzza(Calibrated, Camera):
    """tan(theta) = r / (1 + a2 r^2 + a3 r^3 + ...), pixel = c + f r (cos phi, sin phi).

    Scaramuzza, Martinelli and Siegwart 2006, equation 11, in focal lengths: OCamCalib's cameras without shear. With a2
    alone it is the division model of Fitzgibbon 2001, COLMAP's DIVISION.

    width, height: pixels. fx, fy, cx, cy: focal lengths and principal point, pixels, center of the top left pixel at
    (0.5, 0.5). a: a2, a3, ..., at most 12. camera_from_world: 4x4, OpenCV axes. max_angle: largest angle between a ray
    and the axis, radians. The domain ends there, or where a focal length has less than 1 / 200 radian, whichever comes
    first: short of where the angle turns back, where a direction has no certain pixel.

    Raises InputError for sizes below 1, focal lengths that are not positive, too many coefficients, numbers that are
    not finite, an angle outside (0, pi], and poses that are not rigid.
    """

    a: Annotated[Any, tuple[float, ...]] = ()
    camera_from_world: Any = None
    max_angle: Number = PI

    shape_fields = ("a",)

    def __post_init__(self) -> None:
        self._check_frame()
        object.__setattr__(self, "a", coefficients_of("Scaramuzza", "a", self.a, _MOST, _LARGEST))
        self._check_lens()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A fisheye of 190 degrees, and a division model."""
        frame = (width, height, 0.31 * width, 0.3 * width, 0.52 * width, 0.48 * height)
        return {
            "scaramuzza": cls(*frame, (-0.38, 0.06, -0.14), camera_from_world),
            "division": cls(*frame, (-0.25,), camera_from_world),
        }

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        side, ahead = sin(theta), cos(theta)
        farthest = self._farthest()

        def beyond(r: Array) -> Array:
            return r * ahead - side * self._ahead(r)

        def slope(r: Array) -> Array:
            return ahead - side * polynomial(_derivative(self.a), r)

        # Without a3 and so on, this is the answer; from there Newton needs few steps.
        bend = self.a[0] if self.a else 0.0
        root = safe_sqrt(ahead * ahead - 4.0 * bend * side * side)
        below = ahead + root
        start = where(below > 0, minimum(2.0 * side / where(below > 0, below, 1.0), farthest), farthest)
        low, high = detach(0.0 * start), detach(0.0 * start + 1.0001 * farthest)  # a root at an end is hard to reach
        r = bracketed_newton(
            lambda r: detach(beyond(r)), lambda r: detach(slope(r)), low, high, detach(start), _STEPS, high
        )
        r = detach(where(theta >= self._angle(farthest), farthest, r))
        # Only its derivative, by the implicit function theorem; the step itself is rounding noise.
        rate = detach(slope(r))
        step = beyond(r) / where(rate > 0, rate, 1.0)
        return where(rate > 0, r - (step - detach(step)), r)

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        return 1.0 / self._angle_slope(self.radius_at(theta))

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        return minimum(self._angle(minimum(r, self._farthest())), self.angle_limit())

    def largest_angle(self) -> Array:
        """Where the angle hardly increases with r any more."""
        return self._angle(self._farthest() + (0.0 * sum(self.a) if self.a else 0.0))

    def _angle(self, r: Array) -> Array:
        return atan2(r, self._ahead(r))

    def _ahead(self, r: Array) -> Array:
        """P(r), how far ahead a ray points per r to the side."""
        return polynomial((1.0, 0.0, *self.a), r)

    def _angle_slope(self, r: Array) -> Array:
        ahead = self._ahead(r)
        return polynomial(_turning(self.a), r) / (r * r + ahead * ahead)

    def _farthest(self) -> Array:
        """The r at which the domain ends: the rim, once that is known."""
        if self.rim is not None:
            return self.rim
        kind = library(*self.a) if self.a else "numpy"
        if kind == "jax":
            rising = _rising(tuple(detach(a) for a in self.a))
            # Equal steps of r / (1 + r) are fine where r is small.
            share = first_true(lambda share: polynomial(rising, share / (1.0 - share)) <= 0, 1.0 - 1e-9)
            return share / (1.0 - share)
        return _end(tuple(float(a if kind == "numpy" else detach(a)[0]) for a in self.a))


def _derivative(a: tuple[Array, ...]) -> tuple[Array, ...]:
    """Coefficients of P'."""
    return (0.0, *((power + 2) * value for power, value in enumerate(a))) if a else (0.0, 0.0)


def _turning(a: tuple[Array, ...]) -> tuple[Array, ...]:
    """Coefficients of P - r P' for P = 1 + a2 r^2 + ..., whose sign is that of the angle's slope."""
    return (1.0, 0.0, *(-(power + 1) * value for power, value in enumerate(a)))


def _rising(a: tuple[Array, ...]) -> tuple[Array, ...]:
    """Coefficients of P - r P' - LEAST (r^2 + P^2), which is above 0 as long as the angle's slope is above LEAST."""
    ahead = (1.0, 0.0, *a)
    found: list[Any] = [0.0] * max(2 * len(ahead) - 1, 3)
    for i, value in enumerate(_turning(a)):
        found[i] = found[i] + value
    for i, first in enumerate(ahead):
        for j, second in enumerate(ahead):
            found[i + j] = found[i + j] - LEAST * first * second
    found[2] = found[2] - LEAST
    return tuple(found)


@functools.lru_cache(maxsize=256)
def _end(a: tuple[float, ...]) -> float:
    return sign_changes(_rising(a), 0.0, _WIDEST)[0]
