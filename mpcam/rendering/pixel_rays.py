"""The rays of all pixels on the device, however the camera works them out."""

import numpy as np

from mpcam.backend import aligned, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import HasRays, need
from mpcam.cameras.types import Ray
from mpcam.errors import InputError
from mpcam.math import library

FAR = 16.0
"""Distance of the origins from the camera frame's, over their spread, from which float32 is too coarse for them."""


def pixel_rays(camera: Camera) -> tuple[Ray, np.ndarray]:
    """Rays of all pixels, row by row, on the device, and the point of the camera's frame (3,) from which origins count.

    Raises InputError where the camera's `local_ray` gives them neither for Dr.Jit nor for NumPy arrays.
    """
    import drjit as dr

    from mpcam_kernels import samples

    local_ray, t = need(camera, HasRays, "a frame").local_ray, types()
    centers = samples.pixel_centers(t, camera.width, camera.height)
    try:
        ray = local_ray(centers)
    except (TypeError, ValueError, AttributeError, RuntimeError, InputError):
        ray = None
    numbers = () if ray is None else (*ray.origin, *ray.direction, ray.valid)
    anchor, far = np.zeros(3), False
    if ray is None or not all(library(number) == "drjit" or np.ndim(number) == 0 for number in numbers):
        far = True  # written for NumPy alone
    else:
        ray = Ray(t.Array3f(*numbers[:3]), t.Array3f(*numbers[3:6]), t.Bool(ray.valid))
        if camera.ray_geometry == "general":
            ray, anchor, far = _anchored(ray)
    if ray is None or far:
        ray, anchor = _uploaded(local_ray(np.asarray(centers.numpy(), np.float64)), camera)
    dr.eval(*ray)  # of a named tuple it would do nothing
    return ray, anchor


def _anchored(ray: Ray) -> tuple[Ray, np.ndarray, bool]:
    """Rays around the middle of their origins, on the device, and whether that is so far away that it takes float64."""
    import drjit as dr

    usable = ray.valid & dr.isfinite(ray.origin.x + ray.origin.y + ray.origin.z)
    ends = [dr.min(dr.select(usable, part, dr.inf)) for part in ray.origin]
    ends += [dr.max(dr.select(usable, part, -dr.inf)) for part in ray.origin]
    low, high = np.array([end[0] for end in ends], np.float64).reshape(2, 3)
    if not (low <= high).all():
        return ray, np.zeros(3), False
    anchor = (0.5 * low + 0.5 * high).astype(np.float32).astype(np.float64)
    far = bool(np.abs(anchor).max() > FAR * (high - low).max())
    return ray._replace(origin=dr.select(usable, ray.origin - types().Array3f(*anchor.tolist()), 0)), anchor, far


def _uploaded(ray: Ray, camera: Camera) -> tuple[Ray, np.ndarray]:
    """Rays of NumPy arrays, components first, on the device, around the middle of their origins."""
    count, t = camera.width * camera.height, types()
    try:
        origin, direction = (
            np.stack([np.broadcast_to(np.asarray(part, np.float64), count) for part in parts])
            for parts in (ray.origin, ray.direction)
        )
        valid = np.broadcast_to(np.asarray(ray.valid, bool), count)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{type(camera).__name__}.local_ray gives no rays of {count} pixels ({error}): return mpcam.Ray(origin, "
            "direction, valid), vectors with their components first"
        ) from None
    valid = valid & np.isfinite(origin).all(0) & np.isfinite(direction).all(0)
    some = origin[:, valid]
    anchor = 0.5 * some.min(axis=1) + 0.5 * some.max(axis=1) if valid.any() else np.zeros(3)
    parts = (np.where(valid, origin - anchor[:, None], 0.0), np.where(valid, direction, 0.0))
    origin, direction = (t.Array3f(np.ascontiguousarray(part, np.float32)) + opaque_zero() for part in parts)
    return Ray(origin, direction, t.Bool(aligned(valid, bool)) & (opaque_zero() == 0)), anchor
