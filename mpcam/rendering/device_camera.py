"""Cameras on the device: their numbers for kernels and their pixels' rays, for every pose; the last used are kept."""

import copy
import dataclasses
import functools
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends, HasKernels
from mpcam.cameras.profiles import Profile
from mpcam.cameras.types import PosedRays, Ray
from mpcam.errors import InputError
from mpcam.math import library
from mpcam.math.pose import frame_origin
from mpcam.rendering.pixel_pieces import PixelPieces, pixel_pieces
from mpcam.rendering.pixel_rays import pixel_rays


def _key(camera: Camera) -> tuple[Any, ...]:
    """What decides a camera's rays in its own frame: everything but the pose."""
    names = [field.name for field in dataclasses.fields(camera)]  # pyright: ignore[reportArgumentType]
    values = ((name, getattr(camera, name)) for name in names if name != "camera_from_world")
    return (type(camera), *(_plain(v) for _, v in values))


def _plain(value: Any) -> Any:
    """Numbers of any library, tables and tuples of them in a hashable form, the same for the same ones."""
    if isinstance(value, tuple):
        return tuple(_plain(v) for v in value)
    if dataclasses.is_dataclass(value) and not isinstance(value, Profile):
        return tuple(_plain(getattr(value, field.name)) for field in dataclasses.fields(value))
    if value is None or isinstance(value, (str, int, Profile)):
        return value
    return _Table(value) if np.ndim(value) > 0 else float(value)


class _Table:
    """A large array, told apart by which object it is, small ones by what they hold: cameras are not changed."""

    def __init__(self, value: Any):
        self.value = value
        table = np.asarray(value)
        self._key = id(value) if table.nbytes > 4096 else (table.shape, table.dtype.str, table.tobytes())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Table) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


def _numbers(camera: Camera) -> dict[str, Any]:
    """The fields that are data: all but the pose, what belongs to the program, words and what is left out."""
    names = [field.name for field in dataclasses.fields(camera)]  # pyright: ignore[reportArgumentType]
    values = ((name, getattr(camera, name)) for name in names)
    fixed = (*camera.static_fields, *camera.host_fields, "camera_from_world")
    return {n: value for n, value in values if n not in fixed and not isinstance(value, (str, type(None)))}


def unposed(camera: Camera) -> Camera:
    """The camera at the identity pose with its numbers on the device, for use inside of kernels."""
    result, values = copy.copy(camera), _numbers(camera)
    for name in ("camera_from_world", *camera.host_fields):  # arrays of NumPy, which frozen kernels cannot tell apart
        object.__setattr__(result, name, None)
    numbers = [float(v) for value in values.values() for v in (value if isinstance(value, tuple) else (value,))]
    on_device = iter(opaque_numbers(numbers))
    for name, value in values.items():
        several = isinstance(value, tuple)
        object.__setattr__(result, name, tuple(next(on_device) for _ in value) if several else next(on_device))
    return result


def on_device(camera: Camera) -> Camera:
    """The camera as kernels take it: what it has `for_kernels`, or `unposed`; other models of tables as they are."""
    if isinstance(camera, HasKernels):
        return _opaque(camera.for_kernels(types().Float))
    plain = all(np.ndim(value) == 0 for value in _numbers(camera).values() if not isinstance(value, tuple))
    return unposed(camera) if plain else camera


def _opaque(tables: Any) -> Any:
    """A dataclass of device arrays and numbers as one of which kernels take nothing for granted but whole numbers."""
    values = {field.name: getattr(tables, field.name) for field in dataclasses.fields(tables)}
    numbers = [name for name, value in values.items() if isinstance(value, float)]
    found = dict(zip(numbers, opaque_numbers([values[name] for name in numbers]), strict=True))
    arrays = {name: value for name, value in values.items() if library(value) == "drjit"}
    found |= {name: value + type(value)(opaque_zero()) for name, value in arrays.items()}
    return dataclasses.replace(tables, **found)


def _check_profile(profile: Any) -> None:
    """See that a user's profile runs on Dr.Jit arrays: inside a kernel's recording it is too late to say so."""
    if not isinstance(profile, Profile):
        return
    theta, problem = types().Float([0.1, 0.2]), ""
    for name in ("radius", "slope", "angle"):
        try:
            result = getattr(profile, name)(theta)
        except (TypeError, ValueError, AttributeError, RuntimeError) as error:
            problem = f"{name} fails: {error}"
        else:
            problem = problem or ("" if library(result) == "drjit" else f"{name} gives a {type(result).__name__}")
        if problem:
            text = " ".join(problem.split())
            raise InputError(
                f"profile {profile.name!r} does not run on Dr.Jit arrays ({text}): use mpcam.math functions"
            )


class DeviceCamera:
    """Rays and kernels' view of a camera, which hold for every pose of it.

    ray: of each pixel, row by row, on the device, in the camera's frame, from `anchor` (3,), a point of that frame.
    pieces: those of bent rays. kept: what others make of the rays.
    """

    def __init__(self, camera: Camera):
        _check_profile(getattr(camera, "profile", None))
        self.size: tuple[int, int] = (camera.width, camera.height)
        self.kept: dict[Any, Any] = {}
        self.on_device = on_device(camera)
        self.central = camera.ray_geometry == "central"
        self._camera = camera

    @functools.cached_property
    def _rays(self) -> tuple[Ray, np.ndarray]:
        return pixel_rays(self.on_device)

    @property
    def ray(self) -> Ray:
        return self._rays[0]

    @property
    def anchor(self) -> np.ndarray:
        return self._rays[1]

    @functools.cached_property
    def pieces(self) -> PixelPieces:
        return pixel_pieces(self._camera)

    @functools.cached_property
    def has_center(self) -> bool:
        """Whether all rays leave from the anchor."""
        import drjit as dr

        away: Any = dr.any(self.ray.valid & (dr.squared_norm(self.ray.origin) > 0))
        return self.central or not away[0]

    @functools.cached_property
    def directions(self) -> Any:
        """Samples of a central camera."""
        from mpcam_kernels import samples

        return samples.central_samples(types(), self.ray.direction, self.ray.valid, *self.size)

    @functools.cached_property
    def centers(self) -> Any:
        """Samples of the image plane, for straight-edged triangles."""
        from mpcam_kernels import samples

        return samples.planar_samples(types(), self.ray.valid, *self.size)


@functools.lru_cache(maxsize=16)
def _device_camera(key: tuple[Any, ...], backend: str, holder: "_Held") -> DeviceCamera:
    return DeviceCamera(holder.camera)


class _Held:
    """Carries a camera past the cache's key: all holders are equal."""

    def __init__(self, camera: Camera):
        self.camera = camera

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Held)

    def __hash__(self) -> int:
        return 0


def device_camera(camera: Camera) -> DeviceCamera:
    """Rays of a camera's pixels on the device; the sixteen used last are kept."""
    from mpcam_kernels.backend import backend_name

    return _device_camera(_key(camera), backend_name(), _Held(camera))


def posed_rays(camera: Camera) -> PosedRays:
    """The rays of a camera's pixels, in scene units."""
    known = device_camera(camera)
    return PosedRays(around(camera, known.anchor), known.ray)


def looks_from(camera: Camera) -> np.ndarray:
    """A point of the world (3,) near which the rays of a camera start."""
    known = device_camera(camera)
    return frame_origin(around(camera, known.pieces.anchor if isinstance(camera, Bends) else known.anchor))


def around(camera: Camera, anchor: np.ndarray) -> np.ndarray:
    """4x4, the camera's axes around an anchor of its frame, from the world."""
    pose = np.array(camera.camera_from_world, np.float64)
    pose[:3, 3] -= anchor
    return pose


def world_rays(rays: Ray) -> PosedRays:
    """Rays in the world, origin (N, 3), direction (N, 3), valid (N,), on the device around their middle."""
    t, valid = types(), np.ascontiguousarray(rays.valid, bool)
    origin, direction = np.asarray(rays.origin, np.float64), np.asarray(rays.direction, np.float64)
    pose = np.eye(4)
    if valid.any():
        pose[:3, 3] = -0.5 * (origin[valid].min(axis=0) + origin[valid].max(axis=0))
    origin = np.where(valid[:, None], origin + pose[:3, 3], 0.0)
    columns = (np.ascontiguousarray(x.T, np.float32) for x in (origin, direction))
    start, along = (t.Array3f(x) + opaque_zero() for x in columns)
    return PosedRays(pose, Ray(start, along, t.Bool(aligned(valid, bool)) & (opaque_zero() == 0)))
