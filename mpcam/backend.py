"""The device: array types of the backend in force, numbers that compilers leave alone, and one thread at a time."""

import functools
import threading
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numpy as np

from mpcam.errors import SetupError

P = ParamSpec("P")
R = TypeVar("R")

_LOCK = threading.RLock()


def exclusive(function: Callable[P, R]) -> Callable[P, R]:
    """The function, run by one thread at a time; others wait.

    Recordings and caches of Dr.Jit's kernels are not made for more.
    """

    @functools.wraps(function)
    def locked(*arguments: P.args, **named: P.kwargs) -> R:
        with _LOCK:
            return function(*arguments, **named)

    return locked


def types() -> Any:
    """Dr.Jit array types of the backend in force; raises SetupError with the remedy where it cannot run."""
    from mpcam_kernels import backend

    try:
        return backend.types()
    except backend.BackendError as error:
        raise SetupError(str(error)) from None


def aligned(values: Any, dtype: Any = np.float32) -> np.ndarray:
    """A flat copy (N,) of an array, at an address that vector instructions like: a multiple of 64.

    Dr.Jit takes NumPy's memory as it is, and its kernels are others for arrays at other addresses. NumPy chooses those
    by chance: without this, what was compiled once, and kept on the disk, would be compiled again every so often.
    """
    values = np.asarray(values)
    flat = aligned_room(values.size, dtype)
    flat.reshape(values.shape)[...] = values
    return flat


def aligned_room(count: int, dtype: Any = np.float32) -> np.ndarray:
    """Memory (count,) at such an address, to be written."""
    size = count * np.dtype(dtype).itemsize
    memory = np.empty(size + 64, np.uint8)
    first = -memory.ctypes.data % 64
    return memory[first : first + size].view(dtype)


def opaque_numbers(numbers: list[Any]) -> list[Any]:
    """Numbers as one-element device arrays, so that kernels do not change when they do."""
    import drjit as dr

    t = types()
    table = t.Float(np.array(numbers, np.float32))
    values = [dr.gather(t.Float, table, t.UInt(i)) for i in range(len(numbers))]
    dr.eval(values)
    return values


@functools.cache
def opaque_zero() -> Any:
    """Zero on the device, which no compiler can leave out."""
    return opaque_numbers([0.0])[0]
