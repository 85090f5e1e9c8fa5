"""Frozen kernels: recorded at the first call, replayed without Python after."""

from collections.abc import Callable
from typing import Any

import drjit as dr

RECORDINGS = 64


def frozen(function: Callable[..., Any]) -> Callable[..., Any]:
    """`dr.freeze` for kernels that serve many cameras and meshes.

    One recording is made per camera model and per pattern of equal array lengths, which is more than Dr.Jit takes for
    a mistake by default; the 64 used last are kept.
    """
    return dr.freeze(function, limit=RECORDINGS, warn_after=1 << 30)
