"""What the calibrated lens models share: an image symmetric about the axis, scaled by fx and fy.

A direction at angle theta from the axis and azimuth phi has the pixel (cx + fx r cos phi, cy + fy r sin phi), where
r = f(theta) is the model's own. r is measured in focal lengths.
"""

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from mpcam.cameras.arcs import outer_bound, radial_bound, radial_bound_rough
from mpcam.cameras.fields import Number, Positive
from mpcam.cameras.outline import Outline, VertexView, small_outline, symmetric_vertex_view
from mpcam.cameras.profiles import Profile, bulges_outward
from mpcam.cameras.symmetric import finite_pixel, project_centered, symmetric_image, symmetric_ray, within
from mpcam.cameras.types import Box, Domain, Projection, Ray, RayGeometry
from mpcam.errors import InputError
from mpcam.math import PI, Array, Vector, detach, library, maximum, minimum, vector, where

FARTHEST = 1e6
"""Images end at so many focal lengths from the center, where a formula would go on to infinity."""

_FAR = 1e9  # pixels; stands for infinity
_SAMPLES = 2001
_MARGIN = 1.05  # how much farther than the image's corners tight boxes reach


@dataclasses.dataclass(frozen=True)
class _View:
    """A lens as the bounds of `arcs` want it: in focal lengths, around the origin."""

    profile: Profile
    fov: Array
    radius: Array
    cx: float = 0.0
    cy: float = 0.0
    pixels_per_radius: float = 1.0


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LensFields:
    """The fields with which every calibrated lens begins.

    Derived ones, set at construction where all parameters are plain numbers: limit, the largest angle of the domain;
    rim, its radius in focal lengths; edge, an angle beyond which nothing lands in the image; convex, whether images of
    straight lines bulge away from the center up to there (see `Profile`). They are None and False in cameras whose
    parameters are traced by JAX.
    """

    width: int
    height: int
    fx: Positive
    fy: Positive
    cx: Number
    cy: Number
    limit: Any = dataclasses.field(default=None, init=False)
    rim: Any = dataclasses.field(default=None, init=False)
    edge: Any = dataclasses.field(default=None, init=False)
    convex: bool = dataclasses.field(default=False, init=False)


class Calibrated(LensFields):
    """Rays, images and boxes from the functions r = f(theta), f' and the inverse that a model supplies.

    A model adds its own numbers, a pose, and max_angle, the largest angle that it is to have.
    """

    camera_from_world: Any
    max_angle: Any

    ray_geometry: ClassVar[RayGeometry] = "central"
    static_fields: ClassVar[tuple[str, ...]] = ("width", "height", "convex")
    shape_fields: ClassVar[tuple[str, ...]]
    """Fields that decide f."""

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        raise TypeError(f"{type(self).__name__} must define radius_at")

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        raise TypeError(f"{type(self).__name__} must define slope_at")

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        raise TypeError(f"{type(self).__name__} must define angle_at")

    def largest_angle(self) -> Array:
        """Where f stops increasing or goes beyond FARTHEST, radians."""
        raise TypeError(f"{type(self).__name__} must define largest_angle")

    def _check_lens(self) -> None:
        """Check the fields that all models have, and derive the domain."""
        self._check_numbers()  # pyright: ignore[reportAttributeAccessIssue]
        if library(self.max_angle) == "numpy" and not 0 < self.max_angle <= PI:
            raise InputError(
                f"{type(self).__name__}(max_angle={self.max_angle!r}): radians above 0 and at most pi are needed"
            )
        numbers = [self.fx, self.fy, self.cx, self.cy, self.max_angle, *self._shape()]
        known = library(*numbers) == "numpy"
        self._derive()
        limit = float(minimum(self.max_angle, self.largest_angle())) if known else None
        object.__setattr__(self, "limit", limit)
        object.__setattr__(self, "rim", float(self.radius_at(limit)) if limit else None)
        object.__setattr__(self, "edge", self._image_angle() if limit else None)
        object.__setattr__(self, "convex", bool(limit) and self._bulges())

    def _derive(self) -> None:
        """Set what a model derives from its checked numbers, before its domain is found."""

    def _shape(self) -> list[Array]:
        values = [getattr(self, name) for name in self.shape_fields]
        return [number for value in values for number in (value if isinstance(value, tuple) else (value,))]

    def _image_angle(self) -> float:
        """An angle at which all radii that occur in the image are passed."""
        across = max(abs(self.cx), abs(self.width - self.cx)) / self.fx
        down = max(abs(self.cy), abs(self.height - self.cy)) / self.fy
        return float(self.angle_at(min(_MARGIN * float(np.hypot(across, down)), self.rim)))

    def _bulges(self) -> bool:
        """On equal steps of theta and, where f rises at different rates, on equal steps of r."""
        theta, r = np.linspace(0.0, self.edge, _SAMPLES), np.linspace(0.0, self.radius_at(self.edge), _SAMPLES)
        return all(bulges_outward(angles, np.asarray(self.radius_at(angles))) for angles in (theta, self.angle_at(r)))

    def angle_limit(self) -> Array:
        """Largest angle of the domain, radians; a constant to gradients."""
        return detach(minimum(self.max_angle, self.largest_angle())) if self.limit is None else self.limit

    def _profile(self, limit: Array, convex: bool = False) -> Profile:
        return Profile(type(self).__name__, self.radius_at, self.slope_at, self.angle_at, limit, True, convex)

    def _rim(self) -> Array:
        """Radius of the domain's image, focal lengths; a constant to gradients."""
        return detach(self.radius_at(self.angle_limit())) if self.rim is None else self.rim

    @property
    def domain(self) -> Domain:
        """The largest angle, and the radius in pixels (the larger one of an ellipse) of the image that ends there.

        The radius is None where f goes to infinity.
        """
        limit, radius = self.angle_limit(), self._rim()
        if library(radius) == "numpy" and radius > 0.9 * FARTHEST:
            return Domain(limit, None)
        return Domain(limit, maximum(self.fx, self.fy) * radius)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame; valid in the image of the domain."""
        u, v, valid = finite_pixel(pixel)
        x, y = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        return symmetric_ray(self._profile(self.angle_limit()), x, y, self._rim(), valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Image of a point in the camera frame; valid in the domain, not at the camera's center."""
        return (project_centered(self, point),)

    def local_image(self, point: Vector) -> tuple[Vector, Array]:
        """Pixel of a point, and whether it lies in the domain; beyond it, the pixel is on its rim."""
        limit = self.angle_limit()
        x, y, theta = symmetric_image(self._profile(limit), point)
        return vector(self.cx + self.fx * x, self.cy + self.fy * y), within(theta, limit)

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Box of the curved triangle, exact to about 0.01 pixel for what lies in the image.

        Parts that are farther out count as infinitely far in the quadrants that they may be in. Where f is not convex,
        or not known yet (JAX), the box is that of an annular sector.
        """
        return self._bound(radial_bound, a, b, c)

    def local_vertex_view(self, point: Vector) -> VertexView:
        """What a vertex knows of the projection around it, for `local_outline`."""
        limit = self.angle_limit()
        convex = self.limit is not None and self.convex
        view = limit if self.limit is None else self.edge
        return symmetric_vertex_view(self._profile(limit, convex), view, limit, point)

    def local_outline(self, points: list[Vector], views: list[VertexView]) -> tuple[Outline, Array]:
        """Box and three lines around a small triangle, and whether they hold."""
        return small_outline((self.cx, self.cy), (self.fx, self.fy), points, views)

    def local_bound_rough(self, a: Vector, b: Vector, c: Vector) -> Box:
        """A cheap conservative box, for triangles of which `local_outline` is not sure."""
        return self._bound(radial_bound_rough, a, b, c)

    def _bound(self, bound: Callable[..., Box], a: Vector, b: Vector, c: Vector) -> Box:
        limit = self.angle_limit()
        edge = limit if self.limit is None else self.edge
        convex = self.limit is not None and self.convex
        profile = self._profile(limit, convex)
        view = _View(profile, 2.0 * edge, profile.radius(edge))
        inner, outer = bound(view, a, b, c), outer_bound(view, limit, a, b, c)
        low, high = [], []
        for i, (center, focal) in enumerate(((self.cx, self.fx), (self.cy, self.fy))):
            smallest, largest = where(inner.valid, inner.low[i], _FAR), where(inner.valid, inner.high[i], -_FAR)
            smallest = where(outer.valid, minimum(smallest, outer.low[i]), smallest)
            largest = where(outer.valid, maximum(largest, outer.high[i]), largest)
            low.append(maximum(minimum(center + focal * smallest, _FAR), -_FAR))
            high.append(maximum(minimum(center + focal * largest, _FAR), -_FAR))
        return Box(vector(*low), vector(*high), inner.valid | outer.valid)

    def __repr__(self) -> str:
        return described(self, ("fx", "fy", "cx", "cy", *self.shape_fields), PI)


def described(camera: Any, names: tuple[str, ...], widest: float) -> str:
    """A camera on one line: size, the fields that are named, max_angle where it is below the widest, and the eye."""
    numbers = ", ".join(f"{name}={_short(getattr(camera, name))}" for name in names)
    if library(camera.max_angle) != "numpy" or camera.max_angle < widest:
        numbers += f", max_angle={_short(camera.max_angle)}"
    if library(camera.camera_from_world) == "numpy" and not np.array_equal(camera.camera_from_world, np.eye(4)):
        numbers += f", eye={_short(tuple(map(float, camera.eye)))}"
    return f"{type(camera).__name__}({camera.width}, {camera.height}, {numbers})"


def _short(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_short, value))}{',' if len(value) == 1 else ''})"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
