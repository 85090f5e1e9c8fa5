"""Points, directions and normals from callers: arrays (..., 3), checked."""

from typing import Any

import numpy as np

from mpcam.checks import vectors
from mpcam.errors import InputError


def as_vectors(values: Any, name: str, unit: bool = False) -> np.ndarray:
    """(..., 3) float64, and of length 1 if asked for.

    Raises InputError for other shapes, for what is not finite, and for zero vectors that shall have length 1.
    """
    array = vectors(name, values)
    bad = ~np.asarray(np.isfinite(array).all(-1))
    if bad.any():
        raise InputError(f"{_first(array, bad, name)}: finite numbers are needed; leave out rows that mean nothing")
    if not unit:
        return array
    largest = np.abs(array).max(-1, keepdims=True)
    zero = largest[..., 0] == 0
    if zero.any():
        raise InputError(f"{_first(array, zero, name)}: give a direction, of any length above 0")
    scaled = array / largest
    return scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)


def as_vector(value: Any, name: str) -> np.ndarray:
    """(3,) float64; raises InputError for anything else."""
    array = as_vectors(value, name)
    if array.shape != (3,):
        raise InputError(f"{name} has shape {array.shape}: give 3 numbers")
    return array


def _first(array: np.ndarray, bad: np.ndarray, name: str) -> str:
    """Which row is meant, and how many more are like it."""
    where = [int(i) for i in np.argwhere(bad)[0]]
    others = f" (and {bad.sum() - 1} more like it)" if bad.sum() > 1 else ""
    return f"{name}{where or ''} is {array[tuple(where)].tolist()}{others}"
