"""What every camera model shares: the public edge (arrays of points and pixels, world frame) around its own maps.

A model is a frozen dataclass that supplies maps in its own frame, components first, for NumPy, JAX and Dr.Jit arrays
alike: `local_ray`, which is all that a camera needs, and what it knows beyond (see `capabilities`).
"""

import dataclasses
import sys
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from mpcam.cameras.capabilities import Bends, Bounds, HasRays, Projects, need
from mpcam.cameras.fields import Limits, limits_of
from mpcam.cameras.types import Box, Domain, Projection, Ray, RayGeometry, RayPieces
from mpcam.checks import whole_number
from mpcam.errors import InputError
from mpcam.math import Array, Vector, epsilon, isfinite, library, rotate, rotate_back, translation, vector, where
from mpcam.math.pose import as_pose, frame_origin


def _quiet() -> np.errstate:
    """No warnings from NumPy: NaN and infinity are expected, and masked."""
    return np.errstate(invalid="ignore", over="ignore")


def components(values: Array, count: int, name: str) -> Vector:
    """(..., count) NumPy or JAX array to components first; Dr.Jit vectors are so already."""
    kind = library(values)
    if kind == "drjit":
        return values
    if kind == "jax":
        import jax.numpy as jnp

        array: Any = jnp.asarray(values)
    else:
        try:
            array = np.asarray(values, np.float64)
        except (TypeError, ValueError):
            raise InputError(
                f"{name}: numbers of shape (..., {count}) are needed, got {type(values).__name__}"
            ) from None
    if array.ndim == 0 or array.shape[-1] != count:
        raise InputError(f"{name} has shape {array.shape}: the last axis must have length {count}")
    return np.moveaxis(array, -1, 0) if kind == "numpy" else jnp.moveaxis(array, -1, 0)


def _last(components: Vector) -> Array:
    """Components first to the usual (..., 3) layout."""
    kind = library(components)
    if kind == "drjit":
        return components
    if kind == "jax":
        import jax.numpy as jnp

        return jnp.moveaxis(components, 0, -1)
    return np.moveaxis(components, 0, -1)


def _stacked(entries: Sequence[Any], vectors: int) -> Iterator[Any]:
    """Records of k solutions as one record: the first so many fields are vectors; Dr.Jit: tuples of k entries."""
    kind = library(*entries[0])
    for number, values in enumerate(zip(*entries, strict=True)):
        if kind == "drjit":
            yield values
        elif kind == "jax":
            import jax.numpy as jnp

            yield jnp.stack([_last(v) for v in values], -2) if number < vectors else jnp.stack(values, -1)
        else:
            yield np.stack([_last(v) for v in values], -2) if number < vectors else np.stack(values, -1)


def given_fields(camera: Any) -> list[str]:
    """Names of the fields of a model that its constructor takes; others are derived from them."""
    return [field.name for field in dataclasses.fields(camera) if field.init]


class Camera:
    """Base of the camera models: width, height (pixels) and camera_from_world (4x4, rigid)."""

    width: int
    height: int
    camera_from_world: Any

    ray_geometry: ClassVar[RayGeometry] = "general"
    """ "central": all rays leave from the camera frame's origin; "parallel": all run along its +z; else "general"."""
    images_per_point: ClassVar[int] = 1
    static_fields: ClassVar[tuple[str, ...]] = ("width", "height")
    """Fields that are part of the program rather than of the data (JAX, frozen kernels)."""
    host_fields: ClassVar[tuple[str, ...]] = ()
    """Fields that kernels do without, since others are derived from them."""

    @property
    def domain(self) -> Domain:
        """Where the camera is defined; unless a model says otherwise, nothing is known of it."""
        return Domain(None, None)

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> "dict[str, Camera]":
        """Small sensible cameras of this model by name: typical, wide, extreme but legal; for tests and stress.

        width, height: pixels. camera_from_world: 4x4, the pose of all of them. A model that cannot be made from these
        alone has examples of its own.
        """
        return {"default": cls(width, height, camera_from_world=camera_from_world)}  # pyright: ignore[reportCallIssue]

    def __init_subclass__(cls, **settings: Any) -> None:
        super().__init_subclass__(**settings)
        _waiting.append(cls)

    def ray(self, pixel: Array) -> Ray:
        """Rays of pixels, in the world frame.

        pixel (..., 2): u right, v down. Returns Ray with origin (..., 3), unit direction (..., 3), valid (...).
        Dr.Jit: an Array2f in, Array3f out. Raises InputError when the last axis is not 2.
        """
        register_pytrees()
        local_ray = need(self, HasRays, "ray()").local_ray
        with _quiet():
            origin, direction, valid = local_ray(components(pixel, 2, "pixel"))
        pose, shift = self.camera_from_world, translation(self.camera_from_world)
        moved = vector(origin[0] - shift[0], origin[1] - shift[1], origin[2] - shift[2])
        return Ray(_last(rotate_back(pose, moved)), _last(rotate_back(pose, direction)), valid)

    def ray_pieces(self, pixel: Array) -> RayPieces:
        """The straight pieces of the bent rays of pixels, in the world frame.

        pixel (..., 2). Returns RayPieces with origin, direction (..., k, 3) and start, end, valid (..., k). Dr.Jit: an
        Array2f in, tuples of k entries out. Raises InputError for a camera whose rays are straight, and when the last
        axis is not 2.
        """
        register_pytrees()
        local = need(self, Bends, "ray_pieces()", "its rays are straight, ray() gives them").local_ray_pieces
        with _quiet():
            pieces = local(components(pixel, 2, "pixel"))
        pose, shift = self.camera_from_world, translation(self.camera_from_world)

        def placed(piece: RayPieces) -> RayPieces:
            moved = vector(*(piece.origin[i] - shift[i] for i in range(3)))
            turned = rotate_back(pose, moved), rotate_back(pose, piece.direction)
            return piece._replace(origin=turned[0], direction=turned[1])

        return RayPieces(*_stacked([placed(piece) for piece in pieces], 2))

    def project(self, points: Array) -> Projection:
        """All images of points.

        points (..., 3): world frame. Returns Projection with pixel (..., k, 2), depth (..., k), valid (..., k).
        Dr.Jit: an Array3f in, tuples of k entries out. Raises InputError when the last axis is not 3.
        """
        register_pytrees()
        local_project = need(self, Projects, "project()").local_project
        with _quiet():
            images = local_project(self.local(components(points, 3, "points")))
        return Projection(*_stacked(images, 1))

    def bound(self, triangle: Array) -> Box:
        """A box of pixels that holds the whole image of each triangle (conservative; as tight as the model allows).

        triangle (..., 3, 3): corners by rows, world frame. Returns Box with low (..., 2), high (..., 2), valid (...).
        """
        corners = components(triangle, 3, "triangle")
        if corners.ndim < 2 or corners.shape[-1] != 3:
            raise InputError(f"triangle has shape {np.shape(triangle)}: (..., 3, 3) is needed, corners by rows")
        local_bound = need(self, Bounds, "bound()").local_bound
        with _quiet():
            box = local_bound(*(self.local(corners[..., i]) for i in range(3)))
        return Box(_last(box.low), _last(box.high), box.valid)

    def local(self, point: Vector) -> Vector:
        """World point to the camera frame, components first.

        A point that rounding cannot tell from the camera's center becomes the center: its direction means nothing.
        """
        turned, shift = rotate(self.camera_from_world, point), translation(self.camera_from_world)
        moved = [turned[i] + shift[i] for i in range(3)]
        doubt = 4 * epsilon(moved[0])
        lost = [abs(moved[i]) <= doubt * (abs(turned[i]) + abs(shift[i])) for i in range(3)]
        center = lost[0] & lost[1] & lost[2] & isfinite(moved[0] + moved[1] + moved[2])
        return vector(*(where(center, 0.0, moved[i]) for i in range(3)))

    def contains(self, pixel: Array) -> Array:
        """Whether pixels (..., 2) lie inside the image rectangle."""
        u, v = components(pixel, 2, "pixel")
        return (u >= 0) & (v >= 0) & (u <= self.width) & (v <= self.height)

    def with_pose(self, camera_from_world: Array) -> Self:
        """The same camera at another pose."""
        return dataclasses.replace(self, camera_from_world=camera_from_world)  # pyright: ignore[reportArgumentType]

    @property
    def eye(self) -> np.ndarray:
        """Origin of the camera frame, (3,) in the world."""
        return frame_origin(self.camera_from_world)

    @property
    def world_to_camera(self) -> Any:
        """Other name of `camera_from_world`."""
        return self.camera_from_world

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in given_fields(self))

    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __post_init__(self) -> None:
        self._check_frame()

    def _check_frame(self) -> None:
        """Check and normalize width, height and pose at construction."""
        for name in ("width", "height"):
            side = whole_number(name, getattr(self, name), 1, of=type(self).__name__, unit="pixels")
            object.__setattr__(self, name, side)
        object.__setattr__(self, "camera_from_world", as_pose(self.camera_from_world))
        register_pytrees()

    def _check_text(self) -> None:
        """Raise InputError where a camera is too large to be written as text."""

    def _check_numbers(self) -> None:
        """Check all fields whose types have limits."""
        for name, limits in limits_of(type(self)).items():
            self._check_number(name, **dataclasses.asdict(limits))

    def _check_number(self, name: str, above: float | None = None, below: float | None = None, **ends: Any) -> None:
        """Check that a field is a finite number within Limits; other libraries' arrays pass."""
        value = getattr(self, name)
        if library(value) != "numpy":
            return
        limits = Limits(above, below, **ends)
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = np.nan
        if not limits.allow(number):
            raise InputError(f"{type(self).__name__}({name}={value!r}): {limits} is needed")
        object.__setattr__(self, name, number)


_waiting: list[type] = []  # models that JAX does not know yet


def register_later(part: type) -> None:
    """Make a dataclass that fields of cameras hold a JAX pytree too; it has `static_fields` as cameras do."""
    _waiting.append(part)


def register_pytrees() -> None:
    """Make every camera model a JAX pytree, users' own too, each once; does nothing while JAX is not loaded."""
    tree_util = getattr(sys.modules.get("jax"), "tree_util", None)  # absent while JAX is still being imported
    if tree_util is None:
        return
    while _waiting:
        model = _waiting.pop()
        if dataclasses.is_dataclass(model):
            _register(model, tree_util)


class _Fixed:
    """A static field as JAX wants it: equal and hashed by value, arrays too."""

    def __init__(self, value: Any):
        self.value = value
        array = isinstance(value, np.ndarray)
        self._key = (value.shape, value.dtype.str, value.tobytes()) if array else value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Fixed) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


def _register(model: type, tree_util: Any) -> None:
    names = given_fields(model)
    data = [name for name in names if name not in model.static_fields]
    static = [name for name in names if name in model.static_fields]

    def flatten(camera: Any) -> tuple[list[Any], tuple[Any, ...]]:
        children = [(tree_util.GetAttrKey(name), getattr(camera, name)) for name in data]
        return children, tuple(_Fixed(getattr(camera, name)) for name in static)

    def unflatten(fixed: tuple[Any, ...], children: Any) -> Any:
        camera = object.__new__(model)  # leaves may be placeholders, which no check would pass
        values = (one.value for one in fixed)
        for name, value in (*zip(static, values, strict=True), *zip(data, children, strict=True)):
            object.__setattr__(camera, name, value)
        return camera

    tree_util.register_pytree_with_keys(model, flatten, unflatten)
