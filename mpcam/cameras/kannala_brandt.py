"""Kannala and Brandt's fisheye: the radius is an odd polynomial of the angle."""

import dataclasses
import functools
import math
from typing import Annotated, Any

from mpcam.cameras.base import Camera
from mpcam.cameras.calibrated import Calibrated
from mpcam.cameras.fields import Number
from mpcam.errors import InputError
from mpcam.math import PI, Array, detach, first_true, invert_increasing, library, polynomial, sign_changes

_LARGEST = 1e6  # of a coefficient; views have less than 1


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class KannalaBrandt(Calibrated, Camera):
    """r = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), pixel = c + f r (cos phi, sin phi).

    Kannala and Brandt 2006, equation 6, with the first coefficient absorbed by fx and fy, as in OpenCV's fisheye,
    COLMAP's OPENCV_FISHEYE and Kalibr's pinhole with equidistant distortion.

    width, height: pixels. fx, fy, cx, cy: focal lengths and principal point, pixels, center of the top left pixel at
    (0.5, 0.5). k: k1 to k4. camera_from_world: 4x4, OpenCV axes. max_angle: largest angle between a ray and the axis,
    radians. The domain ends there, or where r stops increasing with theta, whichever comes first; points and pixels
    beyond are invalid. The inverse is bracketed on that interval and never passes through the plane z = 1.

    Raises InputError for sizes below 1, focal lengths that are not positive, other than four coefficients, numbers that
    are not finite, an angle outside (0, pi], and poses that are not rigid.
    """

    k: Annotated[Any, tuple[float, float, float, float]] = (0.0, 0.0, 0.0, 0.0)
    camera_from_world: Any = None
    max_angle: Number = PI

    shape_fields = ("k",)

    def __post_init__(self) -> None:
        self._check_frame()
        object.__setattr__(self, "k", _four(self.k))
        self._check_lens()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A common lens, and one whose polynomial folds within the image."""
        frame = (width, height, 0.31 * width, 0.3 * width, 0.48 * width, 0.51 * height)
        return {
            "kannala_brandt": cls(*frame, (0.05, -0.01, 0.0, 0.0), camera_from_world),
            "folds": cls(*frame, (0.05, -0.05, 0.0, 0.0), camera_from_world, math.radians(110)),
        }

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        return theta * polynomial((1.0, *self.k), theta * theta)

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        return polynomial(_derivative(self.k), theta * theta)

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        return invert_increasing(self.radius_at, self.slope_at, r, 0.0, self.angle_limit())

    def largest_angle(self) -> Array:
        """The first angle at which f' vanishes; pi if there is none before."""
        kind = library(*self.k)
        if kind == "jax":
            derivative = _derivative(tuple(detach(k) for k in self.k))
            return first_true(lambda theta: polynomial(derivative, theta * theta) <= 0, PI)
        numbers = tuple(float(k if kind == "numpy" else detach(k)[0]) for k in self.k)
        return _turn(numbers)


def _four(k: Any) -> tuple[Array, ...]:
    """k as a tuple of four Python floats, or of four arrays of another library."""
    try:
        values = tuple(float(value) if library(value) == "numpy" else value for value in k)
    except (TypeError, ValueError):
        raise InputError(f"KannalaBrandt(k={k!r}): four numbers k1, k2, k3, k4 are needed") from None
    if len(values) != 4:
        raise InputError(f"KannalaBrandt(k={k!r}): four numbers k1, k2, k3, k4 are needed, not {len(values)}")
    if not all(library(value) != "numpy" or abs(value) <= _LARGEST for value in values):
        raise InputError(f"KannalaBrandt(k={k!r}): four numbers between {-_LARGEST:g} and {_LARGEST:g} are needed")
    return values


def _derivative(k: tuple[Array, ...]) -> tuple[Array, ...]:
    """Coefficients of f' in powers of theta^2."""
    return (1.0, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3])


@functools.lru_cache(maxsize=256)
def _turn(k: tuple[float, ...]) -> float:
    squares = sign_changes(_derivative(k), 0.0, PI * PI)
    return squares[0] ** 0.5 if squares else PI
