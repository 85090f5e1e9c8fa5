"""Frozen kernels: recorded at the first call, replayed without Python after."""

import functools
import gc
from collections.abc import Callable
from typing import Any

import drjit as dr

from mpcam_kernels.constants import constants

RECORDINGS = 64


def frozen(function: Callable[..., Any]) -> Callable[..., Any]:
    """`dr.freeze` for kernels that serve many cameras and meshes.

    One recording is made per camera model, per pattern of equal array lengths, and per `constants` of the arguments,
    which is more than Dr.Jit takes for a mistake by default; the 64 used last are kept. The garbage collector rests
    meanwhile: if it freed an array that borrows NumPy's memory while a recording runs, Dr.Jit would abort the process
    ("enqueue_host_func(): this function cannot be recorded").
    """

    def run(key: str, *arguments: Any) -> Any:
        return function(*arguments)

    replay = dr.freeze(run, limit=RECORDINGS, warn_after=1 << 30)

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        collecting = gc.isenabled()
        gc.disable()
        try:
            return replay(constants(arguments), *arguments)
        finally:
            if collecting:
                gc.enable()

    return call
