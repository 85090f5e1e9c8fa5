"""Vertex colors of files: sRGB in some range of numbers, to linear light."""

import numpy as np

from mpcam.geometry.load_text import Say
from mpcam.math.srgb import linear_from_srgb


def linear_colors(values: np.ndarray, say: Say, kind: np.dtype | None = None) -> np.ndarray:
    """(N, 3) sRGB numbers of a file as linear float64 in [0, 1].

    kind: the type that the file gives them. Unsigned integers of 8 and 16 bits run to the largest of their type. Other
    numbers run to 255 if they are whole and one is 2 or more, or if half of those above 0 are 2 or more; else to 1.
    What is outside of the range is cut off, which say is told of unless it is a hair.
    """
    values = np.asarray(values, np.float64)
    if kind is not None and kind.kind in "iu" and kind.itemsize <= 2:
        top = 255.0 if kind.itemsize == 1 else 65535.0
        if kind.kind == "i":  # bytes written by programs without unsigned ones
            values = np.where(values < 0, values + top + 1, values)
    else:
        top = 255.0 if _to_255(values[np.isfinite(values)]) else 1.0
    values = np.where(np.isfinite(values), values / top, 1.0)
    if values.max(initial=0.0) > 1.1 or values.min(initial=0.0) < -0.1:
        say(f"vertex colors run from {values.min() * top:g} to {values.max() * top:g}: cut off to 0 and {top:g}")
    return linear_from_srgb(np.clip(values, 0.0, 1.0))


def _to_255(values: np.ndarray) -> bool:
    some = values[values > 0]
    if len(some) == 0 or some.max() < 2:
        return False
    return bool(np.all(values == np.round(values)) or np.median(some) >= 2)
