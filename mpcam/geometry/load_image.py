"""Texture images: from 8-bit or 16-bit sRGB pixels to linear float32."""

from pathlib import Path
from typing import IO

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


def read_texture(source: Path | IO[bytes], name: str = "") -> tuple[np.ndarray, bool]:
    """The image as (H, W, 3) float32 linear RGB, and whether some of it is transparent.

    source: the file, or its bytes as a stream, called by the name. Raises InputError if it is not an image.
    """
    from PIL import Image

    try:
        with Image.open(source) as image:
            return linear_texture(image), _transparent(image)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        # SyntaxError is what PIL raises for damaged PNG files
        raise InputError(f"texture {name or source} is not a readable image: use PNG or JPEG") from None


def _transparent(image) -> bool:
    if image.mode in ("RGBA", "LA", "PA"):
        return image.getchannel("A").getextrema()[0] < 255
    return "transparency" in image.info
