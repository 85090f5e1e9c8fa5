"""Texture images: from 8-bit or 16-bit sRGB pixels to linear float32."""

from pathlib import Path

import numpy as np

from mpcam.errors import InputError
from mpcam.math.srgb import linear_from_srgb


def linear_texture(image) -> np.ndarray:
    """A PIL image as (H, W, 3) float32 linear RGB, top row first; transparency is ignored."""
    if image.mode.startswith("I"):
        gray = linear_from_srgb(np.clip(np.asarray(image, dtype=np.float64) / 65535.0, 0.0, 1.0))
        return np.repeat(gray[:, :, None], 3, axis=2).astype(np.float32)
    table = linear_from_srgb(np.arange(256) / 255.0).astype(np.float32)
    return table[np.asarray(image.convert("RGB"))]


def read_texture(path: Path) -> np.ndarray:
    """The image file as (H, W, 3) float32 linear RGB. Raises InputError if it is missing or not an image."""
    from PIL import Image

    try:
        with Image.open(path) as image:
            return linear_texture(image)
    except FileNotFoundError:
        raise InputError(f"texture {path} does not exist: put the image there or correct the material file") from None
    except (OSError, ValueError, SyntaxError):
        # SyntaxError is what PIL raises for damaged PNG files
        raise InputError(f"texture {path} is not a readable image: use PNG or JPEG") from None
