"""The sRGB curve (IEC 61966-2-1), for files with 8 or 16 bits per channel."""

import numpy as np


def srgb_from_linear(linear: np.ndarray) -> np.ndarray:
    """Linear light in [0, 1] (clipped) to sRGB values in [0, 1], any shape; NaN stays NaN."""
    linear = np.clip(linear, 0.0, 1.0)
    # the power is taken of a value that the curve's own branch can have, so that 0 is exact
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """sRGB values in [0, 1] to linear light in [0, 1], any shape; the inverse of srgb_from_linear."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4)
