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
from mpcam.cameras.general_linear_tables import LinearTable
from mpcam.cameras.linear_pieces import LinearPieces
from mpcam.cameras.symmetric import finite_pixel
from mpcam.cameras.types import Box, Domain, Projection, Ray
from mpcam.errors import InputError
from mpcam.math import (
    Array,
    Vector,
    library,
    normalize,
    rotate_back,
    vector,
    whole,
)

_FLAT = 1e-9  # of the area of generators in the image over the square of their distances; below, they lie on a line

Generator = tuple[float, float, float, float]
Place = tuple[float, float]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class GeneralLinear(Makers, LinearTable, Camera):
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
            if _area(self.places) <= _FLAT:
                raise InputError(
                    f"GeneralLinear(image={np.asarray(self.image).tolist()}): the three places lie on one line: give "
                    "three corners of a triangle"
                )
            set_(self, "linear", tuple(float(x) for x in self._numbers()))
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

    @property
    def places(self) -> Any:
        """Where the generators lie in the image, in widths and heights."""
        return self.rays[:, 2:] if self.image is None else self.image

    @property
    def map(self) -> LinearMap:
        """sigma, tau, u and v as functions of the pixel, in the camera frame."""
        return LinearMap(*(self._numbers() if self.linear is None else self.linear))

    @property
    def pieces(self) -> LinearPieces:
        """The camera as the only piece of itself."""
        return LinearPieces.of(np.eye(4)[None], [np.full(1, float(number)) for number in self.map])

    def locate(self, x: Array, y: Array) -> Array:
        """Piece of pixel positions."""
        return whole(0.0 * (x + y))

    def _numbers(self) -> list[Array]:
        return linear_numbers(self.rays, self.places, self.width, self.height)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame."""
        x, y, valid = finite_pixel(pixel)
        sigma, tau, u, v = self.map.at(x, y)
        zero = 0.0 * x
        return Ray(vector(u + zero, v + zero, zero), normalize(vector(sigma + zero, tau + zero, zero + 1.0)), valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """The image of a point in the camera frame: see `LinearMap.solve`."""
        linear = self.map
        return (linear.solve(linear.coefficients(point)),)

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Box of the part of a triangle with z >= 0, cut at the planes of slits."""
        return general_linear_bounds.box(self.map, a, b, c)

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
