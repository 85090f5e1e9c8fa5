"""What each image format keeps, and how planes become what it stores."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mpcam.errors import InputError
from mpcam.io.openimageio import StoredImage
from mpcam.math.srgb import linear_from_srgb, srgb_from_linear


@dataclass(frozen=True)
class ImageFormat:
    """floats: 32-bit linear light, else 8 bits and sRGB. layers: depth, further channels and the camera are kept."""

    floats: bool
    alpha: bool = True
    layers: bool = False
    shared_exponent: bool = False


FORMATS = {
    ".exr": ImageFormat(floats=True, layers=True),
    ".tif": ImageFormat(floats=True),
    ".tiff": ImageFormat(floats=True),
    ".hdr": ImageFormat(floats=True, alpha=False, shared_exponent=True),
    ".png": ImageFormat(floats=False),
    ".bmp": ImageFormat(floats=False),
    ".tga": ImageFormat(floats=False),
    ".jpg": ImageFormat(floats=False, alpha=False),
    ".jpeg": ImageFormat(floats=False, alpha=False),
    ".ppm": ImageFormat(floats=False, alpha=False),
}


def format_of(path) -> ImageFormat:
    """The format that the suffix of path asks for; raises InputError if images are not written as that."""
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        kind = suffix or "a file without suffix"
        raise InputError(f"{path}: images cannot be written as {kind}: use {', '.join(sorted(FORMATS))}")
    return FORMATS[suffix]


def shared_exponent(path, planes: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Three planes for a shared-exponent file; raises InputError for numbers that it cannot hold."""
    unfit = sum(np.count_nonzero(~(np.isfinite(plane) & (plane >= 0))) for plane in planes.values())
    if unfit:
        raise InputError(f"{path}: {unfit} values are NaN, infinite or negative, which .hdr cannot keep: write .exr")
    return planes if len(planes) == 3 else dict.fromkeys("RGB", planes["Y"])


def srgb_encoded(path, planes: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """sRGB planes for 8 bits: colors divided by alpha, as these formats keep them. Raises InputError for NaN."""
    unfit = np.count_nonzero(np.any([np.isnan(plane) for plane in planes.values()], axis=0))
    if unfit:
        total = next(iter(planes.values())).size
        raise InputError(
            f"{path}: {unfit} of {total} pixels are NaN, which {Path(path).suffix} cannot keep: "
            "write .exr, or replace them first (numpy.nan_to_num)"
        )
    if "A" not in planes:
        return {name: srgb_from_linear(plane) for name, plane in planes.items()}
    alpha = np.clip(planes["A"], 0.0, 1.0)
    divisor = np.where(alpha > 0, alpha, 1.0)
    colors = {name: srgb_from_linear(np.where(alpha > 0, planes[name] / divisor, 0.0)) for name in "RGB"}
    return colors | {"A": alpha}


def linear(image: StoredImage) -> dict[str, np.ndarray]:
    """Planes of a file as linear light, colors multiplied by alpha."""
    planes = image.planes
    if not image.linear:
        planes = {
            name: plane if name in ("A", "a") else linear_from_srgb(plane).astype(np.float32)
            for name, plane in planes.items()
        }
    if image.unassociated and "A" in planes:
        planes = {name: plane if name == "A" else plane * planes["A"] for name, plane in planes.items()}
    return planes
