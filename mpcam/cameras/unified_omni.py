"""The unified omnidirectional model: one sphere, or ellipsoid, and a pinhole; in closed form both ways."""

import dataclasses
import math
from typing import Annotated, Any, Self

from mpcam.cameras.base import Camera
from mpcam.cameras.fields import Limits, Number, Positive, Share
from mpcam.cameras.spheres import Spheres
from mpcam.cameras.tables import arguments
from mpcam.errors import InputError, KeyProblem
from mpcam.math import PI, Array, library, sqrt

_ENDLESS = 1e15  # whose square float32 can hold


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class UnifiedOmni(Spheres, Camera):
    """r = rho / (alpha d + (1 - alpha) z), d = sqrt(beta rho^2 + z^2), rho = norm(x, y).

    The enhanced unified camera model (Khomutenko, Garcia and Martinet 2016, equation 5). With beta = 1 it is the
    unified model of Mei and Rives 2007 without distortion: see `mei`, which takes that form's parameters.

    width, height: pixels. fx, fy, cx, cy: pixels, center of the top left pixel at (0.5, 0.5). alpha: 0 (a pinhole)
    to 1. beta: above 0. camera_from_world: 4x4, OpenCV axes. max_angle: largest angle between a ray and the axis,
    radians. The domain ends there, or where r stops increasing or is infinite, whichever comes first: z = -w d, with
    w = alpha / (1 - alpha) or its inverse, whichever is below 1.

    Raises InputError for sizes below 1, focal lengths that are not positive, alpha and beta out of range, numbers that
    are not finite, an angle outside (0, pi], and poses that are not rigid.
    """

    alpha: Share
    beta: Positive = 1.0
    camera_from_world: Any = None
    max_angle: Number = PI
    excess: Any = dataclasses.field(default=None, init=False)

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
        """Distance of the pinhole from the sphere's center, for beta = 1: alpha / (1 - alpha)."""
        return self.alpha / (1 - self.alpha)

    def stretch(self) -> Array:
        """across / side."""
        return sqrt(self.beta)

    def elevation(self, side: Array, ahead: Array) -> Array:
        """Height of a unit direction over the last sphere's center, which is where the direction starts."""
        return ahead

    def turning(self, side: Array, ahead: Array) -> Array:
        """ahead height + side^2 of a unit direction."""
        return 1.0

    def seen_at(self, across: Array, height: Array) -> tuple[Array, Array]:
        """The unit direction to (across, height) of the unit sphere, which is the ellipsoid stretched."""
        side = across / sqrt(self.beta)
        length = sqrt(side * side + height * height)
        return side / length, height / length


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
