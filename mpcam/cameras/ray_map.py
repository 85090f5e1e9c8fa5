"""Ray maps: a ray for each pixel, whatever the rays, bilinear between the centers of pixels."""

import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from mpcam.cameras.base import Camera, register_pytrees
from mpcam.cameras.bilinear import Line, Patch, patch
from mpcam.cameras.capabilities import Bends, HasRays, need
from mpcam.cameras.ray_search import Made, search
from mpcam.cameras.symmetric import finite_pixel
from mpcam.cameras.types import Domain, Projection, Ray
from mpcam.checks import whole_number
from mpcam.errors import InputError
from mpcam.math import Array, Vector, cross, detach, dot, library, norm, normalize, safe_divide, vector, where
from mpcam.math.pose import as_pose

MOST_WRITTEN = 4096
"""Rays of a map that is written as text."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RayMap(Camera):
    """A ray for each pixel, central or not: measured, computed elsewhere, or taken from another camera by `of`.

    origins, directions (H, W, 3): of the rays of the pixels' centers, in the camera frame, which is the world unless
    camera_from_world says otherwise; scene units, directions of any length. A pixel whose direction is zero, or with a
    number that is not finite, has no ray. Between centers, origins and directions (as they are given, not brought to
    length 1) are interpolated bilinearly, beyond the outermost ones extrapolated as far as the border of the image; a
    position has a ray if all pixels with a weight there have one. images: how many images `project` gives for each
    point, 2 or more; of more than these the nearest count.

    An image is a place whose neighbors see other points: where rays of a curve or of an area meet, at the eye of a
    central map for instance, a point has none; so it is in maps of one row or one column. Raises InputError for shapes
    that do not fit.
    """

    origins: Any
    directions: Any
    camera_from_world: Any = None
    images: int = 4

    static_fields: ClassVar[tuple[str, ...]] = ("images",)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "camera_from_world", as_pose(self.camera_from_world))
        set_(self, "images", whole_number("images", self.images, 2, of="RayMap"))
        if library(self.origins, self.directions) == "numpy":
            origins, directions = _table(self.origins, "origins"), _table(self.directions, "directions")
            if origins.shape != directions.shape:
                raise InputError(
                    f"RayMap: origins have shape {origins.shape}, directions {directions.shape}: give the same"
                )
            exists = np.isfinite(origins).all(-1) & np.isfinite(directions).all(-1) & (directions != 0).any(-1)
            for name, table in (("origins", origins), ("directions", directions)):
                set_(self, name, _settled(table, exists))
        register_pytrees()

    @classmethod
    def of(cls, camera: Camera, images: int = 4) -> Self:
        """The rays of another camera at the centers of its pixels, in its frame and with its pose.

        Raises InputError for a camera whose rays bend.
        """
        if isinstance(camera, Bends):
            raise InputError(
                f"RayMap.of(): rays of a {type(camera).__name__} bend, and a ray map has one straight ray a pixel: "
                "take one of the pieces that camera.ray_pieces(pixel) gives"
            )
        local_ray = need(camera, HasRays, "RayMap.of()").local_ray
        v, u = np.indices((camera.height, camera.width)) + 0.5
        with np.errstate(invalid="ignore", over="ignore"):
            ray = local_ray(np.stack([u, v]))
        valid = np.asarray(ray.valid)[..., None]
        origins, directions = (np.moveaxis(np.asarray(part, np.float64), 0, -1) for part in (ray.origin, ray.direction))
        return cls(np.where(valid, origins, 0.0), np.where(valid, directions, 0.0), camera.camera_from_world, images)

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """One center, twisted, a mirror with a hole, and folded, in numbers that an EXR holds."""
        x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
        none = 0 * x
        normal = np.stack([0.5 * x, 0.5 * y, -1 + 0.1 * (x * x + y * y)], -1)  # of a bowl that is seen from z = -3
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        bowl = np.stack([x, y, 0.25 * (x * x + y * y)], -1)
        seen = bowl - [0, 0, -3]
        mirrored = seen - 2 * (seen * normal).sum(-1, keepdims=True) * normal
        hole = (x - 0.2) ** 2 + y**2 < 0.15
        maps = {
            "central": (np.stack([none, none, none], -1), np.stack([x, y, 1 + none], -1)),
            "twisted": (
                0.5 * np.stack([x, y, none], -1),
                np.stack([0.6 * x - 0.4 * y, 0.6 * y + 0.4 * x, 1 + none], -1),
            ),
            "mirror with a hole": (bowl, np.where(hole[..., None], np.nan, mirrored)),
            "folded": (np.stack([x, y, none], -1), np.stack([0.8 * x * x - 0.9 * x, 0.2 * y, 1 + none], -1)),
        }
        single = {name: [table.astype(np.float32) for table in tables] for name, tables in maps.items()}
        return {name: cls(origins, rays, camera_from_world) for name, (origins, rays) in single.items()}

    @property
    def width(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Columns of the map."""
        return self.origins.shape[1]

    @property
    def height(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Rows of the map."""
        return self.origins.shape[0]

    @property
    def images_per_point(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """How many images `project` gives for each point."""
        return self.images

    @property
    def domain(self) -> Domain:
        """No common center is known of, so no largest angle, and no image circle."""
        return Domain(None, None)

    def with_pose(self, camera_from_world: Array) -> Self:
        """The same map at another pose; what was made for projections stays."""
        moved = super().with_pose(camera_from_world)
        object.__setattr__(moved, "_made", self.made)
        return moved

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame; valid in the image, where all pixels with a weight have a ray."""
        u, v, finite = finite_pixel(pixel)
        inside = finite & (u >= 0) & (v >= 0) & (u <= self.width) & (v <= self.height)
        found = self._patch(where(inside, u, 0.5), where(inside, v, 0.5))
        origin, along = found.ray
        valid = inside & found.valid & (abs(along[0]) + abs(along[1]) + abs(along[2]) > 0)
        zero = 0.0 * u
        along = vector(*(where(valid, part, zero + end) for part, end in zip(along, (0.0, 0.0, 1.0), strict=True)))
        return Ray(vector(*(where(valid, part, zero) for part in origin)), normalize(along), valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """All images of a point in the camera frame, the nearest first; see `project` of the class.

        They are searched for in float64 on the host, so points must be known: not inside of a kernel that is being
        recorded. JAX calls back to the host, under `jit` too; derivatives are those of the implicit function.
        """
        pixels, valid = search(self, point)
        numbers = range(self.images)
        if library(point) == "drjit":
            return tuple(self._image(point, pixels[k][0], pixels[k][1], valid[k]) for k in numbers)
        every = self._image(point[:, None], pixels[:, 0], pixels[:, 1], valid)
        return tuple(Projection(every.pixel[:, k], every.depth[k], every.valid[k]) for k in numbers)

    def _image(self, point: Vector, u: Array, v: Array, valid: Array) -> Projection:
        """The image near a pixel position, which is given without derivatives."""
        point = vector(*(where(valid, part, 0.0) for part in point))
        if library(point, self.origins, self.directions) != "numpy":
            found = self._patch(u, v)
            step = _newton_step(found.ray, found.slopes, point)
            # Only the derivative: the position is more exact than a step in single precision.
            u, v = (where(valid, x - (s - detach(s)), 0.0) for x, s in zip((u, v), step, strict=True))
        depth = norm(point - self._patch(u, v).ray.origin)
        return Projection(vector(u, v), where(valid, depth, 0.0), valid)

    def _patch(self, u: Array, v: Array) -> Patch:
        return patch(self._tables(u), self.width, self.height, u, v)

    def _tables(self, like: Array) -> list[Array]:
        """Components of origins and directions, row by row, for the library of an array."""
        if library(self.origins, self.directions) == "jax":
            return [table.reshape(-1, 3)[:, k] for table in (self.origins, self.directions) for k in range(3)]
        return self.made.tables(type(like) if library(like) == "drjit" else np.ndarray)

    @property
    def made(self) -> Made:
        """What is made of the rays when it is first needed, for all poses."""
        if "_made" not in vars(self):  # JAX puts cameras together without their constructor
            object.__setattr__(self, "_made", Made(self.origins, self.directions))
        return vars(self)["_made"]

    def _check_text(self) -> None:
        if self.width * self.height > MOST_WRITTEN:
            raise InputError(
                f"a RayMap of {self.width}x{self.height} rays is too large for JSON (at most {MOST_WRITTEN} rays): "
                "write it as an EXR, mpcam.write_ray_map"
            )

    def __repr__(self) -> str:
        return f"RayMap({self.width}x{self.height})"


def _newton_step(ray: Line, slopes: tuple[Line, Line], point: Vector) -> tuple[Array, Array]:
    """Newton's step in u and v away from the place whose ray meets a point; zero where there is none.

    Its derivatives are those of the place with changed sign, as long as the slopes are constants to them.
    """
    p, d = ray.origin - point, ray.along
    right, below = (detach(cross(slope.origin, d) + cross(p, slope.along)) for slope in slopes)
    long, high = norm(right), norm(below)
    right, below = normalize(right), normalize(below)
    normal = cross(right, below)
    size, off = dot(normal, normal), cross(p, d)
    aside, downward = dot(cross(off, below), normal), dot(cross(right, off), normal)
    return safe_divide(safe_divide(aside, long), size), safe_divide(safe_divide(downward, high), size)


def _settled(table: np.ndarray, exists: np.ndarray) -> np.ndarray:
    """A table that does not change any more, zero where pixels have no ray; the same object if it is one already."""
    if table.base is None and not table.flags.writeable and not table[~exists].any():
        return table
    table = np.where(exists[..., None], table, 0.0)
    table.flags.writeable = False
    return table


def _table(values: Any, name: str) -> np.ndarray:
    try:
        table = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"RayMap: {name} are not an array of numbers: give shape (H, W, 3)") from None
    if table.ndim != 3 or table.shape[2] != 3 or table.size == 0:
        raise InputError(f"RayMap: {name} have shape {table.shape}: give (H, W, 3), a row for each row of pixels")
    return table
