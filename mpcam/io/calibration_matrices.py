"""Camera matrix and distortion under the many names that scripts around OpenCV give them."""

import re
from collections.abc import Iterable
from typing import Any

from mpcam.io.calibration_parts import HALF, Section, as_number
from mpcam.io.calibration_yaml import Tagged

MATRIX = "cameramatrix cammatrix k kmatrix m mtx intrinsicmatrix intrinsics intrinsic cameraintrinsics matrix".split()
DISTORTION = (
    "distortioncoefficients distortioncoefficient distcoeffs distcoeff distcoefs distcoef distortioncoeffs distortion "
    "distortionparameters distortioncoefs dist d"
).split()
WIDTHS = ("image_width", "width", "w", "img_width", "cols", "Image_Width", "Camera.width", "ImageWidth", "imageWidth")
HEIGHTS = ("image_height", "height", "h", "img_height", "rows", "Image_Height", "Camera.height", "ImageHeight")
SIZES: tuple[str | tuple[str, str], ...] = (
    *zip(WIDTHS, (*HEIGHTS, "imageHeight"), strict=True),
    *"image_size imageSize ImageSize Image_Size img_size imgsize size resolution image_resolution dim DIM".split(),
)
"""Keys, or pairs of them, of width and height. Not shape: NumPy's has the height first, OpenCV's the width."""


def plain(key: Any) -> str:
    """A key without what people vary in it: case, and signs between words."""
    return re.sub(r"[^a-z0-9]", "", str(key).lower())


def key_of(data: dict[Any, Any], names: Iterable[str], suffix: str = "") -> str | None:
    """The key in a mapping that is one of the names, which come first to last, and whose value is no single number.

    suffix: a number after the name.
    """
    there = {plain(key): key for key, value in reversed(list(data.items())) if isinstance(value, (list, dict, Tagged))}
    return next((there[f"{name}{suffix}"] for name in names if f"{name}{suffix}" in there), None)


def numbers_of(part: Section, key: str) -> list[float]:
    """The numbers of a matrix, row by row: OpenCV's, nested lists, or one list. Raises InputError by the key."""
    value, where = part.get(key), f"{part.where}: {key}"
    if isinstance(value, dict):
        return _opencv(Section(where, value))
    flat = list(_flat(value)) if isinstance(value, (list, tuple)) else [value]
    return [as_number(item, where) for item in flat]


def camera_matrix(part: Section, key: str) -> list[float]:
    """fx, fy, cx, cy, the center as here; raises InputError for skew, and for what is no camera matrix."""
    numbers = numbers_of(part, key)
    if len(numbers) == 4:  # fx, fy, cx, cy
        return [numbers[0], numbers[1], numbers[2] + HALF, numbers[3] + HALF]
    if len(numbers) != 9:
        raise part.error(f"{key}: {len(numbers)} numbers are there, 9 are needed")
    if numbers[2] == numbers[5] == 0 and (numbers[6] or numbers[7]):  # columns first, as Open3D writes it
        numbers = [numbers[i] for i in (0, 3, 6, 1, 4, 7, 2, 5, 8)]
    if any(numbers[i] != expected for i, expected in ((1, 0), (3, 0), (6, 0), (7, 0), (8, 1))):
        raise part.error(f"{key} has skew or is no camera matrix: fx 0 cx, 0 fy cy, 0 0 1 is needed")
    return [numbers[0], numbers[4], numbers[2] + HALF, numbers[5] + HALF]


def listed_frame(part: Section) -> list[float] | None:
    """fx, fy, cx, cy of a mapping that has them as keys of their own, the center as here; None of others."""
    for keys in (("fx", "fy", "cx", "cy"), ("fx", "fy", "ppx", "ppy"), ("f", "f", "cx", "cy")):
        if all(key in part for key in keys):
            fx, fy, cx, cy = (part.number(key) for key in keys)
            return [fx, fy, cx + HALF, cy + HALF]
    return None


def _opencv(inner: Section) -> list[float]:
    numbers = inner.numbers("data", otherwise=[])
    sides = inner.numbers("sizes") if "sizes" in inner else [inner.number(side) for side in ("rows", "cols")]
    channels = re.match(r"\d*", str(inner.data.get("dt", "")))
    count = float(channels[0]) if channels and channels[0] else 1.0
    for side in sides:
        count *= side
    if count != len(numbers):
        wanted = " x ".join(f"{side:g}" for side in sides)
        raise inner.error(f"{len(numbers)} numbers are there, {wanted} are needed")
    return numbers


def _flat(value: Any) -> Iterable[Any]:
    if isinstance(value, (list, tuple)):
        for item in value:
            yield from _flat(item)
    else:
        yield value
