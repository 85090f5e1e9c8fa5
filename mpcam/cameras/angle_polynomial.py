"""Fisheyes whose radius is any polynomial of the angle."""

import dataclasses
import functools
from typing import Annotated, Any

from mpcam.cameras.base import Camera
from mpcam.cameras.calibrated import Calibrated
from mpcam.cameras.coefficients import coefficients_of
from mpcam.cameras.fields import Number
from mpcam.math import PI, Array, detach, first_true, invert_increasing, library, polynomial, sign_changes

_MOST = 16
_LARGEST = 1e6  # of a coefficient; views have less than 1


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AnglePolynomial(Calibrated, Camera):
    """r = theta (1 + k1 theta + k2 theta^2 + ...), pixel = c + f r (cos phi, sin phi).

    WoodScape's radial_poly, with its first coefficient absorbed by fx and fy; with zeros for every other k, Kannala
    and Brandt's lens with any number of coefficients, as Project Aria's fisheye has them.

    width, height: pixels. fx, fy, cx, cy: focal lengths and principal point, pixels, center of the top left pixel at
    (0.5, 0.5). k: k1, k2, ..., at most 16. camera_from_world: 4x4, OpenCV axes. max_angle: largest angle between a ray
    and the axis, radians. The domain ends there, or where r stops increasing with theta, whichever comes first.

    Raises InputError for sizes below 1, focal lengths that are not positive, too many coefficients, numbers that are
    not finite, an angle outside (0, pi], and poses that are not rigid.
    """

    k: Annotated[Any, tuple[float, ...]] = ()
    camera_from_world: Any = None
    max_angle: Number = PI

    shape_fields = ("k",)

    def __post_init__(self) -> None:
        self._check_frame()
        object.__setattr__(self, "k", coefficients_of("AnglePolynomial", "k", self.k, _MOST, _LARGEST))
        self._check_lens()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A lens as cars have it."""
        frame = (width, height, 0.27 * width, 0.28 * width, 0.49 * width, 0.52 * height)
        return {"angle_polynomial": cls(*frame, (-0.094, 0.142, -0.021), camera_from_world)}

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        return theta * polynomial((1.0, *self.k), theta)

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        return polynomial(_derivative(self.k), theta)

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        return invert_increasing(self.radius_at, self.slope_at, r, 0.0, self.angle_limit())

    def largest_angle(self) -> Array:
        """The first angle at which f' vanishes; pi if there is none before."""
        kind = library(*self.k)
        if kind == "jax":
            derivative = _derivative(tuple(detach(k) for k in self.k))
            return first_true(lambda theta: polynomial(derivative, theta) <= 0, PI)
        return _turn(tuple(float(k if kind == "numpy" else detach(k)[0]) for k in self.k))


def _derivative(k: tuple[Array, ...]) -> tuple[Array, ...]:
    """Coefficients of f' in powers of theta."""
    return (1.0, *((power + 2) * value for power, value in enumerate(k)))


@functools.lru_cache(maxsize=256)
def _turn(k: tuple[float, ...]) -> float:
    angles = sign_changes(_derivative(k), 0.0, PI)
    return angles[0] if angles else PI
