"""What callers give to march with, checked: rays, how far they go, and steps."""

from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_zero, types
from mpcam.cameras.types import PosedRays, Ray
from mpcam.checks import is_number, shown, vectors
from mpcam.errors import InputError
from mpcam.math import library
from mpcam.rendering.device_camera import world_rays

COARSE, FINE = (1.0, 64.0), (1.0 / 16, 4.0)
"""Steps in pixels, the least and the largest."""


def side_for(coarse: Any, fine: Any) -> tuple[int, float, float]:
    """Pixels along the smallest squares for a coarse step, and both steps as numbers; 0: no coarse steps.

    Raises InputError for steps out of range.
    """
    for name, value, (low, high) in (("coarse", coarse, COARSE), ("fine", fine, FINE)):
        if name == "coarse" and value is None:
            continue
        if not is_number(value) or not low <= value <= high:
            hint = ", or None for fine steps alone" if name == "coarse" else ""
            raise InputError(f"{name}={shown(value)}: pixels from {low:g} to {high:g} are needed{hint}")
    if coarse is None or coarse <= fine:
        return 4, 0.0, float(fine)
    side = 1
    while 2 * side < coarse + 1:
        side *= 2
    return side, float(coarse), float(fine)


def rays_of(origins: Any, directions: Any) -> tuple[PosedRays, tuple[int, ...]]:
    """Rays on the device, and the shape that fields of theirs have; raises InputError for other shapes."""
    import drjit as dr

    if isinstance(origins, PosedRays) and directions is None:
        return origins, (dr.width(origins.ray.valid),)
    if library(origins, directions) == "drjit":
        t = types()
        origin, along = (_device_vectors(name, x) for name, x in (("origins", origins), ("directions", directions)))
        width = max(dr.width(origin), dr.width(along))
        if {dr.width(origin), dr.width(along)} - {1, width}:
            raise InputError(f"origins are {dr.width(origin)} and directions {dr.width(along)}: give one for each")
        zero = dr.zeros(t.Float, width)
        ray = Ray(origin + zero, along + zero, zero == 0)
        dr.eval(*ray)
        return PosedRays(np.eye(4), ray), (width,)
    start, along = (vectors(name, x) for name, x in (("origins", origins), ("directions", directions)))
    try:
        shape = np.broadcast_shapes(start.shape, along.shape)
    except ValueError:
        raise InputError(
            f"origins have shape {start.shape} and directions {along.shape}: give a direction for each origin"
        ) from None
    start, along = (np.broadcast_to(x, shape).reshape(-1, 3) for x in (start, along))
    with np.errstate(invalid="ignore", over="ignore"):
        largest = np.abs(along).max(-1, initial=0.0)
        valid = np.isfinite(start).all(-1) & np.isfinite(along).all(-1) & (largest > 0)
        along = np.where(valid[:, None], along / np.where(valid, largest, 1.0)[:, None], (0.0, 0.0, 1.0))
    if len(start) == 0:
        t = types()
        return PosedRays(np.eye(4), Ray(t.Array3f(), t.Array3f(), t.Bool())), shape[:-1]
    return world_rays(Ray(np.where(valid[:, None], start, 0.0), along, valid)), shape[:-1]


def far_of(far: Any, shape: tuple[int, ...]) -> Any:
    """Lengths beyond which nothing counts, on the device; raises InputError for other shapes and for what is NaN."""
    t = types()
    if far is None:
        return t.Float(aligned(np.inf)) + opaque_zero()
    if library(far) == "drjit":
        return t.Float(far)
    try:
        values = np.asarray(far, np.float64)
        flat = np.broadcast_to(values, values.shape if values.ndim == 0 else shape).ravel()
    except (TypeError, ValueError):
        raise InputError(f"far={shown(far)}: give a length, or one for each ray, shape {shape}") from None
    if np.isnan(flat).any():
        raise InputError("far: lengths are needed, and some are NaN")
    return t.Float(aligned(flat)) + opaque_zero()


def _device_vectors(name: str, value: Any) -> Any:
    if library(value) != "drjit" or len(value) != 3:
        raise InputError(f"{name}: Dr.Jit Array3f are needed for both, or NumPy arrays for both")
    return types().Array3f(*value)
