"""What the calibration formats share: looking things up in a file with one-line complaints, and building cameras."""

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from mpcam.cameras import BrownConrady, Camera, KannalaBrandt, Pinhole
from mpcam.errors import InputError

T = TypeVar("T")

HALF = 0.5
"""What OpenCV and Kalibr, with (0, 0) at the center of the first pixel, lack in their principal points."""

RADTAN = tuple("k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y".split())
"""OpenCV's coefficients in its order: radial and tangential, rational, thin prism, tilted sensor."""


class Section:
    """A mapping in a calibration file, and how to call it in messages: "cam.yaml: cam0"."""

    def __init__(self, where: str, data: Any):
        self.where = where
        if not isinstance(data, dict):
            raise InputError(f"{where}: a mapping of names to values is needed here, got {_kind(data)}")
        self.data: dict[Any, Any] = data

    def __contains__(self, key: str) -> bool:
        return self.data.get(key) is not None

    def error(self, problem: str) -> InputError:
        return InputError(f"{self.where}: {problem}")

    def get(self, key: str, otherwise: Any = None) -> Any:
        """The value of a key; otherwise stands for one that is missing. Raises InputError if it must not be."""
        value = self.data.get(key)
        if value is None and otherwise is None:
            raise self.error(f"{key} is missing")
        return otherwise if value is None else value

    def number(self, key: str, otherwise: float | None = None) -> float:
        return as_number(self.get(key, otherwise), f"{self.where}: {key}")

    def numbers(self, key: str, *counts: int, otherwise: Any = None) -> list[float]:
        """A list of numbers, as long as one of counts if there are any."""
        value, where = self.get(key, otherwise), f"{self.where}: {key}"
        if not isinstance(value, (list, tuple)):
            raise InputError(f"{where}: a list of numbers is needed, got {_kind(value)}")
        if counts and len(value) not in counts:
            allowed = " or ".join(map(str, counts))
            raise InputError(f"{where}: {len(value)} numbers are there, {allowed} are needed")
        return [as_number(item, where) for item in value]

    def matrix(self, key: str) -> np.ndarray:
        """A 4x4 matrix of numbers in nested lists."""
        rows = self.get(key)
        if not isinstance(rows, list) or len(rows) != 4 or not all(isinstance(r, list) and len(r) == 4 for r in rows):
            raise self.error(f"{key}: four rows of four numbers are needed")
        return np.array([[as_number(item, f"{self.where}: {key}") for item in row] for row in rows])

    def size(self, width: Any, height: Any) -> tuple[int, int]:
        """Width and height as whole numbers of pixels."""
        sides = [as_number(side, f"{self.where}: the image size") for side in (width, height)]
        if not all(side >= 1 and side == int(side) for side in sides):
            raise self.error(f"the image size is {sides[0]:g} x {sides[1]:g}: whole numbers of pixels are needed")
        return int(sides[0]), int(sides[1])

    def camera(self, make: Callable[..., T], *arguments: Any) -> T:
        """What `make` makes of the arguments; its InputError names this part."""
        try:
            return make(*arguments)
        except InputError as error:
            raise self.error(str(error)) from None


def as_number(value: Any, where: str) -> float:
    """A finite number, also one written as a text like 1e-5, which some YAML readers take for no number."""
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{where}: a finite number is needed, got {_kind(value)}")
    return number


def _kind(value: Any) -> str:
    if isinstance(value, (dict, list)):
        return f"a {type(value).__name__} of {len(value)}"
    text = " ".join(repr(value).split())
    return text if len(text) <= 40 else f"{text[:37]}..."


def inverse(pose: np.ndarray) -> np.ndarray:
    """The inverse of a rigid 4x4 transform."""
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def intrinsics(camera: Camera, models: dict[type[Camera], str], style: str) -> tuple[float, float, float, float]:
    """fx, fy, cx, cy of a camera that a format can hold.

    models: what the format calls the models that it has. Raises InputError for others.
    """
    if type(camera) not in models:
        allowed = ", ".join(model.__name__ for model in models)
        raise InputError(f"{style} has no model for a {type(camera).__name__}: it can hold {allowed}")
    return tuple(float(getattr(camera, name)) for name in ("fx", "fy", "cx", "cy"))  # pyright: ignore[reportReturnType]


def single(cameras: dict[str, Camera], style: str) -> tuple[str, Camera]:
    """The only camera of several, for formats that hold one."""
    if len(cameras) != 1:
        raise InputError(f"{style} holds one camera per file, not {len(cameras)}: write one file for each")
    return next(iter(cameras.items()))


def undistorted(part: Section, coefficients: list[float], what: str) -> None:
    """See that distortion that no model here has is zero."""
    if any(coefficients):
        raise part.error(f"{what} is not zero: no camera of mpcam has it; undistort the images, or fit another model")


def pinhole_or_fisheye(
    part: Section, fisheye: bool, size: tuple[int, int], frame: list[float], coefficients: list[float]
) -> Camera:
    """A KannalaBrandt camera, or one with OpenCV's coefficients; frame: fx, fy, cx, cy."""
    if fisheye:
        if len(coefficients) != 4:
            raise part.error(f"a fisheye needs 4 distortion coefficients k1 to k4, not {len(coefficients)}")
        return part.camera(KannalaBrandt, *size, *frame, coefficients)
    if len(coefficients) not in (0, 4, 5, 8, 12, 14):
        raise part.error(f"{len(coefficients)} distortion coefficients are there, 0, 4, 5, 8, 12 or 14 are needed")
    return radtan(part, size, frame, dict(zip(RADTAN, coefficients, strict=False)))


def radtan(part: Section, size: tuple[int, int], frame: list[float], given: dict[str, float]) -> Camera:
    """A camera with radial and tangential distortion, a Pinhole where that is zero; given: coefficients by name."""
    kinds = (("thin prism distortion", ("s1", "s2", "s3", "s4")), ("a tilted sensor", ("tau_x", "tau_y")))
    for kind, names in kinds:
        undistorted(part, [given.get(name, 0.0) for name in names], f"{kind} ({', '.join(names)})")
    k, p = ([given.get(f"{letter}{i + 1}", 0.0) for i in range(count)] for letter, count in (("k", 6), ("p", 2)))
    if not any((*k, *p)):
        return part.camera(Pinhole, *size, *frame)
    return part.camera(BrownConrady, *size, *frame, k, p)


def coefficients(camera: BrownConrady) -> dict[str, float]:
    """k1 to k6, p1 and p2 by name."""
    return {f"{letter}{i + 1}": float(value) for letter in "kp" for i, value in enumerate(getattr(camera, letter))}


def coefficients_held(camera: BrownConrady, names: str, style: str) -> list[float]:
    """Those that a format has a place for, in its order; raises InputError where others are not zero."""
    given = coefficients(camera)
    lost = [name for name, value in given.items() if value and name not in names.split()]
    if lost:
        raise InputError(f"{style} has no place for {', '.join(lost)} of {camera!r}: it holds {names}")
    return [given[name] for name in names.split()]
