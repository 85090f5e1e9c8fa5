"""Panoramas: one center, columns by longitude, rows by latitude or by height on a cylinder."""

import dataclasses
import math
from typing import Any, ClassVar, Literal, Self

from mpcam.cameras.base import Camera
from mpcam.cameras.symmetric import finite_pixel
from mpcam.cameras.tables import degrees
from mpcam.cameras.types import Domain, Projection, Ray, RayGeometry
from mpcam.errors import InputError
from mpcam.math import (
    PI,
    Array,
    Vector,
    atan,
    atan2,
    cos,
    detach,
    epsilon,
    isfinite,
    library,
    maximum,
    minimum,
    norm,
    normalize,
    sin,
    tan,
    vector,
    where,
)

PROJECTIONS = ("equirectangular", "cylindrical")
_SLACK = 1e-6  # by what part bounds may go beyond their limits
_STEEPEST = 1e-15  # distance from the axis over height, below which a cylinder has no image of a point


@dataclasses.dataclass(frozen=True, eq=False)
class Panorama(Camera):
    """Longitude grows with u; latitude ("equirectangular") or its tangent ("cylindrical") falls with v.

    Longitude a and latitude b are the direction (sin a cos b, -sin b, cos a cos b): zero looks along +z, a grows to the
    right, b upward. width, height: pixels. projection: one of PROJECTIONS; use the constructors `equirectangular` and
    `cylindrical`. camera_from_world: 4x4, OpenCV axes. longitude: (low, high) of the left and the right border,
    radians, at most a turn apart. latitude: (low, high) of the bottom and the top border, radians; by default from pole
    to pole, and on a cylinder what makes the pixels at the horizon square.

    Each direction has one image: that with a longitude less than half a turn from the middle of the range, and of the
    two borders of a turn the left one. So a whole turn has u in [0, width), and the seam has no crack and no pixel
    twice; v is in [0, height) as well where the range reaches both poles. A pole, which is a whole row of the image,
    is given at the middle longitude; a cylinder has no image of it. Beyond narrower ranges the map goes on, as far as a
    turn and the poles.

    Raises InputError for sizes below 1, unknown projections, ranges that are empty, longer than a turn or beyond the
    poles, and poses that are not rigid.
    """

    width: int
    height: int
    projection: str = "equirectangular"
    camera_from_world: Any = None
    longitude: Any = (-PI, PI)
    latitude: Any = None

    ray_geometry: ClassVar[RayGeometry] = "central"
    static_fields: ClassVar[tuple[str, ...]] = ("width", "height", "projection")

    def __post_init__(self) -> None:
        self._check_frame()
        if self.projection not in PROJECTIONS:
            raise InputError(f"Panorama(projection={self.projection!r}): allowed are {', '.join(PROJECTIONS)}")
        self._check_range("longitude", 4 * PI, 2 * PI)
        if self.latitude is None:
            low, high = self.longitude
            top = atan(0.5 * self.height * (high - low) / self.width) if self._cylindrical else 0.5 * PI
            object.__setattr__(self, "latitude", (-top, top))
        self._check_range("latitude", 0.5 * PI, PI, open_=self._cylindrical)

    @classmethod
    def equirectangular(
        cls,
        width: int,
        height: int,
        camera_from_world: Any = None,
        *,
        longitude: tuple[float, float] = (-PI, PI),
        latitude: tuple[float, float] = (-0.5 * PI, 0.5 * PI),
    ) -> Self:
        """Rows of equal latitude: the whole sphere, or a part of it; ranges in radians."""
        return cls(width, height, "equirectangular", camera_from_world, longitude, latitude)

    @classmethod
    def cylindrical(
        cls,
        width: int,
        height: int,
        camera_from_world: Any = None,
        *,
        longitude: tuple[float, float] = (-PI, PI),
        latitude: tuple[float, float] | None = None,
        heights: tuple[float, float] | None = None,
        fov: float | None = None,
    ) -> Self:
        """Rows of equal height on a cylinder of radius 1 around the vertical axis: vertical lines stay straight.

        The rows are given by one of latitude (radians), heights (low, high) on the cylinder, or fov, the full vertical
        angle of view (radians, below pi); without any, pixels at the horizon are square. Raises InputError for more
        than one of them.
        """
        if sum(given is not None for given in (latitude, heights, fov)) > 1:
            raise InputError("Panorama.cylindrical: give one of latitude=, heights= and fov=, not several")
        if fov is not None:
            if library(fov) == "numpy" and not 0 < fov < PI:
                raise InputError(f"Panorama.cylindrical(fov={fov!r}): radians between 0 and pi are needed")
            latitude = (-0.5 * fov, 0.5 * fov)
        if heights is not None:
            low, high = _two(heights, "heights")
            latitude = (atan(low), atan(high))
        return cls(width, height, "cylindrical", camera_from_world, longitude, latitude)

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        projection: Literal["equirectangular", "cylindrical"] = "equirectangular",
        longitude: tuple[float, float] = (-180.0, 180.0),
        latitude: tuple[float, float] | None = None,
    ) -> Self:
        """From the keys of a scene file: ranges (low, high) in degrees."""
        ranges = [None if ends is None else tuple(map(math.radians, ends)) for ends in (longitude, latitude)]
        return cls(width, height, projection, None, *ranges)

    def to_table(self) -> dict[str, Any]:
        """The keys that `from_table` takes, but for width and height."""
        ranges = {name: [degrees(float(x)) for x in getattr(self, name)] for name in ("longitude", "latitude")}
        return {"projection": self.projection, **ranges}

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """Small instances for tests and pages: whole, partial, and at their limits."""
        pose = camera_from_world
        low, high = -0.4 * PI, 0.25 * PI
        return {
            "equirectangular": cls.equirectangular(width, height, pose),
            "equirectangular, part": cls.equirectangular(
                width, height, pose, longitude=(-1.2, 2.0), latitude=(low, high)
            ),
            "cylindrical": cls.cylindrical(width, height, pose),
            "cylindrical, steep": cls.cylindrical(
                width, height, pose, longitude=(-0.5, 0.7), latitude=(low, 0.47 * PI)
            ),
        }

    @property
    def domain(self) -> Domain:
        """All directions, but for the poles on a cylinder; the image is not a disc."""
        return Domain(PI, None)

    @property
    def _cylindrical(self) -> bool:
        return self.projection == "cylindrical"

    @property
    def _rows(self) -> tuple[Array, Array]:
        """Latitudes, or heights on the cylinder, of the bottom and the top border."""
        low, high = self.latitude
        return (tan(low), tan(high)) if self._cylindrical else (low, high)

    @property
    def _columns(self) -> tuple[Array, Array]:
        """Longitude of the middle, and the range as a part of a turn: 1 exactly where rounding cannot tell."""
        low, high = self.longitude
        part = (high - low) / (2 * PI)
        whole = abs(part - 1.0) <= 4 * epsilon(part)
        return 0.5 * (low + high), part + detach(where(whole, 1.0 - part, 0.0))

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame; valid up to half a turn from the middle, and up to the poles."""
        u, v, valid = finite_pixel(pixel)
        (middle, part), (low, high) = self._columns, self._rows
        turned = (u / self.width - 0.5) * part * (2 * PI)
        rise = high - (v / self.height) * (high - low)
        slack = 1.0 + 4.0 * epsilon(turned)
        valid = valid & (abs(turned) <= PI * slack)
        valid = valid & (isfinite(rise) if self._cylindrical else abs(rise) <= 0.5 * PI * slack)
        angle, rise = middle + where(valid, turned, 0.0), where(valid, rise, 0.0)
        if self._cylindrical:
            direction = normalize(vector(sin(angle), 0.0 - rise, cos(angle)))
        else:
            direction = vector(sin(angle) * cos(rise), 0.0 - sin(rise), cos(angle) * cos(rise))
        zero = 0.0 * turned
        return Ray(vector(zero, zero, zero), direction, valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Image of a point in the camera frame; not valid at the camera's center, nor above it on a cylinder."""
        x, y, z = point
        valid = isfinite(x) & isfinite(y) & isfinite(z)
        x, y, z = where(valid, x, 0.0), where(valid, y, 0.0), where(valid, z, 0.0)
        depth = norm(vector(x, y, z))
        valid = valid & (depth > 0)
        largest = detach(maximum(maximum(abs(x), abs(y)), abs(z)))
        scale = where(largest > 0, largest, 1.0)
        x, y, z = x / scale, y / scale, z / scale
        rho = norm(vector(x, 0.0 * x, z))
        low, high = self._rows
        if self._cylindrical:
            valid = valid & (rho > _STEEPEST)
            rise = (0.0 - where(valid, y, 0.0)) / where(valid, rho, 1.0)
        else:
            seen = rho + abs(y) > 0
            rise = atan2(0.0 - y, where(seen, rho, 1.0))
            rise = maximum(minimum(rise, 0.5 * PI), -0.5 * PI)  # rounding may lead beyond a pole
        v = self.height * ((high - rise) / (high - low))
        if not self._cylindrical:
            to_the_pole = low <= -0.5 * PI * (1.0 - 4.0 * epsilon(rise))
            v = where(to_the_pole, minimum(v, self.height * (1.0 - 0.5 * epsilon(rise))), v)
        u = self._column(x, z)
        valid = valid & isfinite(u + v)
        pixel = vector(where(valid, u, 0.5 * self.width), where(valid, v, 0.5 * self.height))
        return (Projection(pixel, depth, valid),)

    def _column(self, x: Array, z: Array) -> Array:
        """u of a direction, which is the middle where x and z are zero."""
        middle, part = self._columns
        largest = detach(maximum(abs(x), abs(z)))
        scale = where(largest > 0, largest, 1.0)
        steep = largest <= 1e-30  # so near to a pole that derivatives would be infinite; they are zero there
        x, z = where(steep, detach(x), x) / scale, where(steep, detach(z), z) / scale
        aside, ahead = x * cos(middle) - z * sin(middle), x * sin(middle) + z * cos(middle)
        turned = atan2(aside, where(largest > 0, ahead, 1.0)) / (2 * PI)
        u = self.width * (0.5 + turned / part)
        # Of the two borders of a turn, the left one; u itself may also be rounded up to the right one.
        return where(u >= self.width * (0.5 + 0.5 / part), u - self.width / part, u)

    def _check_range(self, name: str, limit: float, length: float, open_: bool = False) -> None:
        """Check two bounds within +-limit (open: inside of them), at most so far apart; other libraries' numbers pass.

        A float32 that was rounded up may go beyond.
        """
        low, high = _two(getattr(self, name), name)
        object.__setattr__(self, name, (low, high))
        if library(low, high) != "numpy":
            return
        most = limit * (1 - 1e-9 if open_ else 1 + _SLACK)
        if not (max(-low, high) <= most and 0 < high - low <= length * (1 + _SLACK)):
            ends = f"{'inside of' if open_ else 'within'} +-{limit:.6g} and at most {length:.6g} apart"
            raise InputError(f"Panorama({name}=({low:.6g}, {high:.6g})): give radians (low, high), low < high, {ends}")


def _two(values: Any, name: str) -> tuple[Any, Any]:
    """Two numbers, as Python's unless they are another library's."""
    try:
        low, high = values
        return tuple(x if library(x) != "numpy" else float(x) for x in (low, high))  # pyright: ignore[reportReturnType]
    except (TypeError, ValueError):
        raise InputError(f"Panorama({name}={values!r}): give two numbers (low, high)") from None
