"""The unified omnidirectional model: one sphere, or ellipsoid, and a pinhole; in closed form both ways."""

import dataclasses
import math
from typing import Annotated, Any, Self

from mpcam.cameras.base import Camera
from mpcam.cameras.calibrated import FARTHEST, NEARLY_PI, Calibrated
from mpcam.cameras.fields import Limits, Number, Positive, Share
from mpcam.cameras.tables import arguments
from mpcam.errors import InputError, KeyProblem
from mpcam.math import PI, Array, atan2, cos, library, maximum, minimum, safe_sqrt, sin, sqrt, where

_ENDLESS = 1e15  # whose square float32 can hold


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class UnifiedOmni(Calibrated, Camera):
    """r = rho / (alpha d + (1 - alpha) z), d = sqrt(beta rho^2 + z^2), rho = norm(x, y).

    The enhanced unified camera model (Khomutenko, Garcia and Martinet 2016, equation 5). With beta = 1 it is the
    unified model of Mei and Rives 2007 without distortion: see `mei`, which takes that form's parameters.

    width, height: pixels. fx, fy, cx, cy: pixels, centre of the top left pixel at (0.5, 0.5). alpha: 0 (a pinhole)
    to 1. beta: above 0. camera_from_world: 4x4, OpenCV axes. max_angle: largest angle between a ray and the axis,
    radians. The domain ends there, or where r stops increasing or is infinite, whichever comes first: z = -w d, with
    w = alpha / (1 - alpha) or its inverse, whichever is below 1.

    Raises InputError for sizes below 1, focal lengths that are not positive, alpha and beta out of range, numbers that
    are not finite, an angle outside (0, pi], and poses that are not rigid.
    """

    width: int
    height: int
    fx: Positive
    fy: Positive
    cx: Number
    cy: Number
    alpha: Share
    beta: Positive = 1.0
    camera_from_world: Any = None
    max_angle: Number = PI
    limit: Any = dataclasses.field(default=None, init=False)
    edge: Any = dataclasses.field(default=None, init=False)
    convex: bool = dataclasses.field(default=False, init=False)

    shape_fields = ("alpha", "beta")

    def __post_init__(self) -> None:
        self._check_frame()
        self._check_lens()

    @classmethod
    def mei(
        cls,
        width: int,
        height: int,
        gamma_x: Any,
        gamma_y: Any,
        cx: Any,
        cy: Any,
        xi: Any,
        camera_from_world: Any = None,
        max_angle: Number = PI,
    ) -> Self:
        """r = rho / (z + xi norm(x, y, z)) in units of gamma_x, gamma_y: Mei and Rives 2007; Kalibr's omni, OpenCV's.

        xi: 0 (a pinhole) or more; up to 1, r is infinite where cos theta = -xi; beyond, it is largest where
        cos theta = -1 / xi. Raises InputError as the class does.
        """
        given = {"gamma_x": gamma_x, "gamma_y": gamma_y, "xi": xi}
        gamma_x, gamma_y, xi = (_at_least_zero(name, value) for name, value in given.items())
        share = 1 / (1 + xi)
        return cls(
            width, height, gamma_x * share, gamma_y * share, cx, cy, xi * share, 1.0, camera_from_world, max_angle
        )

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        alpha: Share | None = None,
        beta: Positive | None = None,
        xi: Annotated[float, Limits(at_least=0)] | None = None,
        **rest: Any,
    ) -> Self:
        """From the keys of a scene file: `alpha`, with `beta` or 1, or Mei's `xi`, which `focal` is then given for."""
        if (alpha is None) == (xi is None):
            raise InputError("give either alpha (and beta) or xi")
        lens = arguments(cls, width, height, rest)
        if xi is None:
            return cls(**lens, alpha=alpha, beta=1.0 if beta is None else beta)
        if beta is not None:
            raise KeyProblem("beta", "give alpha with it, not xi")
        return cls.mei(gamma_x=lens.pop("fx"), gamma_y=lens.pop("fy"), **lens, xi=xi)

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A common lens, and a mirror and pinhole of 210 degrees."""
        frame = (width, height, 0.4 * width, 0.39 * width, 0.51 * width, 0.48 * height)
        return {
            "unified_omni": cls(*frame, 0.45, 1.1, camera_from_world),
            "catadioptric": cls.mei(*frame, 1.2, camera_from_world, math.radians(105)),
        }

    @property
    def xi(self) -> Array:
        """Distance of the pinhole from the sphere's centre, for beta = 1: alpha / (1 - alpha)."""
        return self.alpha / (1 - self.alpha)

    def _parts(self, theta: Array) -> tuple[Array, Array, Array, Array]:
        """sin theta, cos theta, d and the denominator of r, for a point at distance 1."""
        side, ahead = sin(theta), cos(theta)
        across = sqrt(self.beta) * side
        d = sqrt(across * across + ahead * ahead)
        return side, ahead, d, denominator(self.alpha, side, across, ahead, d)

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        side, _, _, below = self._parts(theta)
        return side / below

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        side, ahead, d, below = self._parts(theta)
        falling = 1 - self.alpha + self.alpha * (1 - self.beta) * ahead / d
        return (ahead * below + side * side * falling) / (below * below)

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        return minimum(self._inverse(r), self.angle_limit())

    def _inverse(self, r: Array) -> Array:
        """theta of r: that of the unit sphere, which is the ellipsoid scaled by sqrt(beta) across the axis."""
        scale = sqrt(self.beta)
        side, ahead = sphere_direction(self.alpha, minimum(r * scale, widest_radius(self.alpha)))
        return atan2(side / scale, ahead)

    def largest_angle(self) -> Array:
        """Where r is largest, or FARTHEST, radians."""
        side, ahead = sphere_border(self.alpha)
        border = minimum(atan2(side / sqrt(self.beta), ahead), self._inverse(FARTHEST + 0.0 * self.alpha))
        return minimum(border, NEARLY_PI)


def _at_least_zero(name: str, value: Any) -> Any:
    """A Python number from 0; arrays of other libraries pass."""
    if library(value) != "numpy":
        return value
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = -1.0
    if not 0 <= number < float("inf"):
        raise InputError(f"UnifiedOmni.mei({name}={value!r}): a finite number from 0 is needed")
    return number


def denominator(alpha: Array, side: Array, across: Array, ahead: Array, d: Array) -> Array:
    """alpha d + (1 - alpha) ahead, d = |(across, ahead)|, without cancellation; at least side / (2 FARTHEST)."""
    total = maximum(alpha * d + (1 - alpha) * abs(ahead), 1e-30)
    difference = (alpha * alpha * across * across + (2 * alpha - 1) * ahead * ahead) / total
    return maximum(where(ahead < 0, difference, total), 0.5 / FARTHEST * side)


def sphere_direction(alpha: Array, r: Array) -> tuple[Array, Array]:
    """Point of the unit sphere (distance from the axis, height), unscaled, with r = side / (alpha + (1 - alpha) ahead).

    The larger root of the quadratic equation for the height.
    """
    other = 1 - alpha
    root = safe_sqrt(1 - (2 * alpha - 1) * r * r)
    return r * (alpha + other * root), root - alpha * other * r * r


def widest_radius(alpha: Array) -> Array:
    """Largest r on the unit sphere, 1 / sqrt(2 alpha - 1); a large number where there is none."""
    excess = 2 * alpha - 1
    finite = excess > FARTHEST**-2
    return where(finite, 1 / sqrt(where(finite, excess, 1.0)), _ENDLESS)


def sphere_border(alpha: Array) -> tuple[Array, Array]:
    """Unit vector (side, height) to where r stops increasing, or is infinite, on the unit sphere: height -w."""
    w = minimum(alpha, 1 - alpha) / maximum(alpha, 1 - alpha)
    return safe_sqrt(1 - w * w), -w
