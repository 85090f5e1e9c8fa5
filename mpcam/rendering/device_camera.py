"""Cameras on the device: their numbers for kernels and their pixels' rays, for every pose; the last used are kept."""

import copy
import dataclasses
import functools
from typing import Any

import numpy as np

from mpcam.backend import opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import HasRays, need
from mpcam.cameras.profiles import Profile
from mpcam.errors import InputError
from mpcam.math import library


def _key(camera: Camera) -> tuple[Any, ...]:
    """What decides a camera's rays in its own frame: everything but the pose."""
    names = [field.name for field in dataclasses.fields(camera)]  # pyright: ignore[reportArgumentType]
    values = ((name, getattr(camera, name)) for name in names if name != "camera_from_world")
    return (type(camera), *(_plain(v) for _, v in values))


def _plain(value: Any) -> Any:
    """Numbers of any library, tables and tuples of them in a hashable form, the same for the same ones."""
    if isinstance(value, tuple):
        return tuple(_plain(v) for v in value)
    if value is None or isinstance(value, (str, int, Profile)):
        return value
    if np.ndim(value) > 0:
        table = np.asarray(value)
        return table.shape, table.dtype.str, table.tobytes()
    return float(value)


def unposed(camera: Camera) -> Camera:
    """The camera at the identity pose with its numbers on the device, for use inside of kernels."""
    result = copy.copy(camera)
    object.__setattr__(result, "camera_from_world", None)
    names = [field.name for field in dataclasses.fields(camera)]  # pyright: ignore[reportArgumentType]
    values = {n: getattr(camera, n) for n in names if n not in (*camera.static_fields, "camera_from_world")}
    numbers = [float(v) for value in values.values() for v in (value if isinstance(value, tuple) else (value,))]
    on_device = iter(opaque_numbers(numbers))
    for name, value in values.items():
        several = isinstance(value, tuple)
        object.__setattr__(result, name, tuple(next(on_device) for _ in value) if several else next(on_device))
    return result


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
    """Rays and kernels' view of a camera, which hold for every pose of it."""

    def __init__(self, camera: Camera):
        import drjit as dr

        from mpcam_kernels import samples

        _check_profile(getattr(camera, "profile", None))
        alike = camera.ray_geometry != "general"  # others keep their tables, which kernels read in a form of their own
        self.on_device, self.size = unposed(camera) if alike else camera, (camera.width, camera.height)
        self.ray = need(self.on_device, HasRays, "a frame").local_ray(
            samples.pixel_centres(types(), camera.width, camera.height)
        )
        dr.eval(self.ray)

    @functools.cached_property
    def directions(self) -> Any:
        """Samples of a central camera."""
        from mpcam_kernels import samples

        return samples.central_samples(types(), self.ray.direction, self.ray.valid, *self.size)

    @functools.cached_property
    def centres(self) -> Any:
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
