"""The double sphere: two unit spheres and a pinhole, with projection and inverse in closed form."""

import dataclasses
import math
from typing import Annotated, Any

from mpcam.cameras.base import Camera
from mpcam.cameras.fields import Limits, Number, Share
from mpcam.cameras.spheres import Spheres
from mpcam.math import PI, Array, library, maximum, safe_sqrt, where


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class DoubleSphere(Spheres, Camera):
    """r = rho / (alpha d2 + (1 - alpha) (xi d1 + z)), d1 = norm(x, y, z), d2 = norm(x, y, xi d1 + z), rho = norm(x, y).

    Usenko, Demmel and Cremers 2018, equations 40 to 51. A point lands on a unit sphere, from there, seen from a center
    shifted by xi, on a second one, and from there, seen from a center shifted by alpha / (1 - alpha), in the image.

    width, height: pixels. fx, fy, cx, cy: pixels, center of the top left pixel at (0.5, 0.5); at the axis the image has
    fx / (1 + xi) pixels per radian. xi: above -1. alpha: 0 to 1. camera_from_world: 4x4, OpenCV axes. max_angle:
    largest angle between a ray and the axis, radians. The domain ends there, or where r stops increasing, whichever
    comes first: on the second sphere that is z2 = -w1 d2, with w1 = alpha / (1 - alpha) or its inverse, whichever is
    below 1. (Equation 43 puts that border at another angle, by taking the second sphere's point for one of the first:
    for xi = -0.5, alpha = 0.1, it takes in points behind the pinhole.)

    Derived fields: front = 1 + xi and back = 1 - xi, before xi is rounded to float32: near -1 and 1 the image depends
    on them. At xi = -1 the axis would have no image, and the image no center.

    Raises InputError for sizes below 1, focal lengths that are not positive, xi and alpha out of range, numbers that
    are not finite, an angle outside (0, pi], and poses that are not rigid.
    """

    xi: Annotated[Any, Limits(above=-1)]
    alpha: Share
    camera_from_world: Any = None
    max_angle: Number = PI
    excess: Any = dataclasses.field(default=None, init=False)
    front: Any = dataclasses.field(default=None, init=False)
    back: Any = dataclasses.field(default=None, init=False)

    shape_fields = ("xi", "alpha")

    def __post_init__(self) -> None:
        self._check_frame()
        self._check_lens()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """A common lens, and one with the second center outside of the first sphere."""
        frame = (width, height, 0.37 * width, 0.38 * width, 0.52 * width, 0.49 * height)
        return {
            "double_sphere": cls(*frame, -0.2, 0.59, camera_from_world),
            "center outside": cls(*frame, 1.5, 0.3, camera_from_world, math.radians(115)),
        }

    def _derive(self) -> None:
        super()._derive()
        if library(self.xi) == "numpy":
            object.__setattr__(self, "front", 1 + self.xi)
            object.__setattr__(self, "back", 1 - self.xi)

    def elevation(self, side: Array, ahead: Array) -> Array:
        """xi + ahead, by 1 - |ahead| = side^2 / (1 + |ahead|)."""
        front, back = self._ends()
        less = side * side / (1 + abs(ahead))
        return where(ahead < 0, less - back, front - less)

    def turning(self, side: Array, ahead: Array) -> Array:
        """1 + xi ahead, which is ahead height + side^2 of a unit direction."""
        front, back = self._ends()
        bent = self.xi * (side * side / (1 + abs(ahead)))
        return where(ahead < 0, back + bent, front - bent)

    def seen_at(self, across: Array, height: Array) -> tuple[Array, Array]:
        """The unit direction to a point of the second sphere: along that sphere's radius to the first."""
        xi, (front, back) = self.xi, self._ends()
        squeeze = front * back  # 1 - xi^2
        root = safe_sqrt(height * height + squeeze * across * across)
        shifted = xi * height
        far = where(shifted < 0, squeeze / where(shifted < 0, root - shifted, 1.0), root + shifted)
        return across * maximum(far, 0.0), height * root - xi * across * across

    def border(self) -> tuple[Array, Array]:
        """Unit direction from which on r does not increase, or is infinite."""
        side, ahead = super().border()
        # A center outside of the first sphere sees it twice.
        outside = self.xi > 1
        inverse = 1 / where(outside, self.xi, 1.0)
        front, back = self._ends()
        return where(outside, safe_sqrt(-front * back) * inverse, side), where(outside, -inverse, ahead)

    def _ends(self) -> tuple[Array, Array]:
        """1 + xi and 1 - xi."""
        return (1 + self.xi, 1 - self.xi) if self.front is None else (self.front, self.back)
