"""Thread indices: the first argument of every kernel."""

import functools
from typing import Any

import drjit as dr


@functools.lru_cache(maxsize=12)
def threads(types: Any, first: int, last: int) -> Any:
    """UInt first, ..., last - 1, evaluated; kept for a while, since most frames want what the frame before wanted."""
    indices = dr.arange(types.UInt, first, last)
    dr.make_opaque(indices)
    return indices
