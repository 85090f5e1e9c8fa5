"""Devernay and Faugeras' lens: the radius in the image is the angle of a stretched pinhole image."""

import dataclasses
from typing import Annotated, Any

from mpcam.cameras.base import Camera
from mpcam.cameras.calibrated import Calibrated, described
from mpcam.cameras.fields import Limits
from mpcam.math import PI, Array, atan2, cos, minimum, sin, tan


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FieldOfView(Calibrated, Camera):
    """r = atan(2 tan(omega / 2) tan(theta)) / omega, pixel = c + f r (cos phi, sin phi).

    The FOV model of Devernay and Faugeras 2001, equation 13: COLMAP's FOV, Kalibr's pinhole with fov distortion. It
    starts from a pinhole image, so rays reach 90 degrees from the axis at most.

    width, height: pixels. fx, fy, cx, cy: focal lengths and principal point, pixels, center of the top left pixel at
    (0.5, 0.5). omega: the field of view of the ideal lens, radians, above 0 (where the lens is a pinhole) and below pi.
    camera_from_world: 4x4, OpenCV axes. max_angle: largest angle between a ray and the axis, radians.

    Raises InputError for sizes below 1, focal lengths that are not positive, omega or an angle out of range, numbers
    that are not finite, and poses that are not rigid.
    """

    omega: Annotated[Any, Limits(above=0, below=PI)]
    camera_from_world: Any = None
    max_angle: Annotated[Any, Limits(above=0, at_most=0.5 * PI)] = 0.5 * PI

    shape_fields = ("omega",)

    def __post_init__(self) -> None:
        self._check_frame()
        self._check_lens()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A common lens."""
        frame = (width, height, 0.42 * width, 0.44 * width, 0.51 * width, 0.49 * height)
        return {"field_of_view": cls(*frame, 0.93, camera_from_world)}

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        return atan2(self._stretch() * sin(theta), cos(theta)) / self.omega

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        stretch, side, ahead = self._stretch(), sin(theta), cos(theta)
        across = stretch * side
        return stretch / (self.omega * (across * across + ahead * ahead))

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        angle = minimum(r * self.omega, 0.5 * PI)
        return minimum(atan2(sin(angle), self._stretch() * cos(angle)), self.angle_limit())

    def largest_angle(self) -> Array:
        """90 degrees."""
        return 0.5 * PI + 0.0 * self.omega

    def __repr__(self) -> str:
        return described(self, ("fx", "fy", "cx", "cy", "omega"), 0.5 * PI)

    def _stretch(self) -> Array:
        return 2.0 * tan(0.5 * self.omega)
