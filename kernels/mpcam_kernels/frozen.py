"""Frozen kernels: recorded at the first call, replayed without Python after."""

import functools
import gc
from collections.abc import Callable
from typing import Any

import drjit as dr

RECORDINGS = 64


def frozen(function: Callable[..., Any]) -> Callable[..., Any]:
    """`dr.freeze` for kernels that serve many cameras and meshes.

    One recording is made per camera model and per pattern of equal array lengths, which is more than Dr.Jit takes for
    a mistake by default; the 64 used last are kept. The garbage collector rests meanwhile: if it freed an array that
    borrows NumPy's memory while a recording runs, Dr.Jit would abort the process ("enqueue_host_func(): this function
    cannot be recorded").
    """
    replay = dr.freeze(function, limit=RECORDINGS, warn_after=1 << 30)

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        collecting = gc.isenabled()
        gc.disable()
        try:
            return replay(*arguments)
        finally:
            if collecting:
                gc.enable()

    return call
