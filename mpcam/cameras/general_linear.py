"""General linear cameras: all affine combinations of three rays (Yu and McMillan 2004; Yu et al. 2009).

A ray is (sigma, tau, u, v): it starts at (u, v, 0) and runs along (sigma, tau, 1). Pinholes, parallel rays, pushbrooms,
two crossed slits and four more kinds are cameras of this one class.
"""

import dataclasses
import functools
from typing import Annotated, Any, ClassVar

import numpy as np

from mpcam.cameras import general_linear_bounds
from mpcam.cameras.base import Camera, register_pytrees
from mpcam.cameras.general_linear_kinds import Kind, Line, classify
from mpcam.cameras.general_linear_makers import CORNERS, Makers
from mpcam.cameras.general_linear_map import LinearMap, linear_numbers
from mpcam.cameras.symmetric import finite_pixel
from mpcam.cameras.types import Box, Domain, Projection, Ray
from mpcam.errors import InputError
from mpcam.math import (
    Array,
    Vector,
    absolute,
    detach,
    epsilon,
    isfinite,
    library,
    norm,
    normalize,
    rotate_back,
    vector,
    where,
)

_FLAT = 1e-9  # of the area of generators in the image over the square of their distances; below, they lie on a line
_UNSURE = 4.0  # roundings of the determinant that a point's image has to be sure of

Generator = tuple[float, float, float, float]
Place = tuple[float, float]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class GeneralLinear(Makers, Camera):
    """The affine combinations of three rays, which it calls its generators.

    rays (3, 4): generators by rows, (sigma, tau, u, v) in the camera frame: each starts at (u, v, 0), scene units, and
    runs along (sigma, tau, 1). width, height: pixels. image (3, 2): where the generators lie in the image, in widths
    and heights. If left out, that is at their own (u, v), so that the image shows u and v from 0 to 1; where these lie
    on one line (a slit in the plane z = 0, a pinhole's center), at three corners: left top, right top, left bottom.
    camera_from_world: 4x4, OpenCV axes. Points with z >= 0 are seen; depth is the distance along the ray from z = 0.

    Other ways to make one: `from_rays`, and a classmethod for each kind. Raises InputError for shapes that do not fit,
    numbers that are not finite, places in the image that lie on one line, sizes below 1, and poses that are not rigid.
    """

    rays: Annotated[Any, tuple[Generator, Generator, Generator]]
    width: int
    height: int
    image: Annotated[Any, tuple[Place, Place, Place]] = None
    camera_from_world: Any = None
    linear: Any = dataclasses.field(default=None, init=False)  # what kernels know of it, see `LinearMap`

    host_fields: ClassVar[tuple[str, ...]] = ("rays", "image")

    def __post_init__(self) -> None:
        self._check_frame()
        set_ = object.__setattr__
        set_(self, "rays", _table(self.rays, "rays", 4))
        if self.image is not None:
            set_(self, "image", _table(self.image, "image", 2))
        if library(self.rays, self.image) == "numpy":
            if self.image is None and _area(self.rays[:, 2:]) <= _FLAT:
                set_(self, "image", _table(CORNERS, "image", 2))
            if _area(self._places()) <= _FLAT:
                raise InputError(
                    f"GeneralLinear(image={np.asarray(self.image).tolist()}): the three places lie on one line: give "
                    "three corners of a triangle"
                )
            set_(
                self,
                "linear",
                tuple(float(x) for x in linear_numbers(self.rays, self._places(), self.width, self.height)),
            )
        register_pytrees()

    @property
    def domain(self) -> Domain:
        """No largest angle and no image circle; the depths z of the slits, where images run to infinity."""
        return Domain(None, None, self._kind.depths)

    @functools.cached_property
    def _kind(self) -> Kind:
        if library(self.rays) == "numpy":
            return classify(self.rays)
        return classify(np.asarray(self.rays))

    @property
    def kind(self) -> str:
        """ "pinhole", "orthographic", "pushbroom", "cross_slit", "pencil", "twisted_orthographic", "bilinear" or "epi".

        "not a camera" where the rays are no family of two dimensions.
        """
        return self._kind.name

    @property
    def margin(self) -> float:
        """How much the generators must change to become another kind, `nearest_kind`, relative to how far they are
        apart. A small one says that the kind is a matter of rounding."""
        return self._kind.margin

    @property
    def nearest_kind(self) -> str:
        """The kind that the smallest change of the generators would make of this camera."""
        return self._kind.nearest

    @property
    def slits(self) -> tuple[Line, ...]:
        """The lines in space, world frame, that all rays meet: two of a cross-slit camera, one of a pushbroom or a
        pencil camera, none of others. Directions are unit vectors."""
        if self.kind not in ("cross_slit", "pushbroom", "pencil"):
            return ()
        table = np.asarray(self.rays, np.float64)
        middle, differences = table.mean(axis=0), table[1:] - table[0]
        found = []
        for z in self._kind.depths:
            ends = differences[:, 2:] + z * differences[:, :2]
            along = np.linalg.svd(ends)[2][0]  # the generators' triangle is as good as flat here
            found.append(self._line(np.array([*(middle[2:] + z * middle[:2]), z]), np.array([*along, 0.0])))
        return tuple(found)

    @property
    def center(self) -> np.ndarray | None:
        """The point (3,) in the world that all rays of a pinhole meet; None for other kinds."""
        if self.kind != "pinhole":
            return None
        (z,), middle = self._kind.depths, np.asarray(self.rays, np.float64).mean(axis=0)
        return self._line(np.array([*(middle[2:] + z * middle[:2]), z]), np.array([0.0, 0.0, 1.0])).point

    def _line(self, point: np.ndarray, direction: np.ndarray) -> Line:
        pose = np.asarray(self.camera_from_world, np.float64)
        return Line((point - pose[:3, 3]) @ pose[:3, :3], np.asarray(rotate_back(pose, direction)))

    def _places(self) -> Any:
        """Where the generators lie in the image, in widths and heights."""
        return self.rays[:, 2:] if self.image is None else self.image

    def _map(self) -> LinearMap:
        numbers = (
            linear_numbers(self.rays, self._places(), self.width, self.height) if self.linear is None else self.linear
        )
        return LinearMap(*numbers)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame."""
        x, y, valid = finite_pixel(pixel)
        sigma, tau, u, v = self._map().at(x, y)
        zero = 0.0 * x
        return Ray(vector(u + zero, v + zero, zero), normalize(vector(sigma + zero, tau + zero, zero + 1.0)), valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """The image of a point in the camera frame: two linear equations in the plane of its depth (Yu et al. 2009,
        eq. 5). Valid from z = 0 on, but in planes of slits, where rounding decides about the image, or there is none.
        """
        x, y, z = point
        valid = (z >= 0) & isfinite(x) & isfinite(y) & isfinite(z)
        x, y, z = (where(valid, part, 1.0) for part in (x, y, z))
        linear = self._map()
        (a, b), (c, d), (right, below) = linear.equations(x, y, z)
        determinant = a * d - b * c
        sure = absolute(determinant) > _UNSURE * epsilon(x) * self._doubt(linear, z, a, b, c, d)
        inverse = 1.0 / where(sure, determinant, 1.0)
        px, py = (d * right - b * below) * inverse, (a * below - c * right) * inverse
        sure = sure & valid & isfinite(px) & isfinite(py)
        px, py = where(sure, px, 0.0), where(sure, py, 0.0)
        sigma, tau, _, _ = linear.at(px, py)
        depth = where(sure, z * norm(vector(sigma, tau, 1.0 + 0.0 * sigma)), 0.0)
        return (Projection(vector(px, py), depth, sure),)

    @staticmethod
    def _doubt(linear: LinearMap, z: Array, *entries: Array) -> Array:
        """What one rounding of each entry of the equations can change in their determinant."""
        (a, b, c, d), sizes = (absolute(detach(entry)) for entry in entries), linear.sizes(detach(z))
        return sizes[0] * d + a * sizes[3] + sizes[1] * c + b * sizes[2]

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Box of the part of a triangle with z >= 0, cut at the planes of slits."""
        return general_linear_bounds.box(self._map(), a, b, c)

    def __repr__(self) -> str:
        return f"GeneralLinear({self.width}x{self.height}, {self.kind})"


def _area(places: Any) -> float:
    """Area of three places in the plane over the square of their distances; 0 where they lie on one line."""
    table = np.asarray(places, np.float64)
    sides = table[1:] - table[0]
    square = float((sides * sides).sum())
    return abs(float(np.linalg.det(sides))) / square if square > 0 else 0.0


def _table(values: Any, name: str, columns: int) -> Any:
    """A table (3, columns) of finite numbers in the precision that it was given in; other libraries' arrays pass."""
    if library(values) != "numpy" or type(values) is object:
        return values
    try:
        table = np.array(values)
        table = table if table.dtype == np.float32 else table.astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"GeneralLinear: {name} is not an array of numbers: give shape (3, {columns})") from None
    if table.shape != (3, columns):
        words = "three rays by rows, sigma tau u v" if columns == 4 else "where each of the three rays lies"
        raise InputError(f"GeneralLinear: {name} has shape {table.shape}: give (3, {columns}), {words}")
    if not np.isfinite(table).all():
        raise InputError(f"GeneralLinear: {name} holds NaN or infinity: give finite numbers")
    table.flags.writeable = False
    return table
