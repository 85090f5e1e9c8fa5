"""What the calibration formats share: looking things up in a file with one-line complaints, and the half pixel."""

import math
from collections.abc import Callable
from typing import Any, TypeVar

from mpcam.cameras import Camera
from mpcam.errors import InputError
from mpcam.io.calibration_yaml import Tagged

T = TypeVar("T")

HALF = 0.5
"""What OpenCV and Kalibr, with (0, 0) at the center of the first pixel, lack in their principal points."""


class NoSize(InputError):
    """A file that says nothing of the size of its images, and a caller who does neither."""


class Section:
    """A mapping in a calibration file, how to call it in messages ("cam.yaml: cam0"), and the size given for it."""

    def __init__(self, where: str, data: Any, given: tuple[int, int] | None = None):
        self.where, self.given = where, given
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

    def part(self, key: str) -> "Section":
        """The mapping that is the value of a key."""
        return Section(f"{self.where}: {key}", self.get(key), self.given)

    def image_size(self, *keys: str | tuple[str, str]) -> tuple[int, int]:
        """Width and height: by the first key, or pair of keys, that is there; else what the caller gave.

        Raises NoSize where neither is, and InputError where they differ.
        """
        for key in keys:
            names = (key,) if isinstance(key, str) else key
            if all(name in self for name in names):
                found = self.size(*(self.numbers(names[0], 2) if len(names) == 1 else map(self.get, names)))
                if self.given not in (None, found):
                    raise self.error(f"{' and '.join(names)} say {found[0]} x {found[1]}: leave size out")
                return found
        if self.given is not None:
            return self.size(*self.given)
        names = " or ".join(key if isinstance(key, str) else " and ".join(key) for key in keys[:2])
        there = ", ".join(str(key) for key in self.data)
        raise NoSize(
            f"{self.where}: has no image size, such as {names}, among its keys {there[:120]}: give "
            "size=(width, height), --size WIDTHxHEIGHT, or size = [width, height] in a scene file"
        )

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
    if isinstance(value, Tagged):
        return repr(value)
    if isinstance(value, (dict, list)):
        return f"a {type(value).__name__} of {len(value)}"
    text = " ".join(repr(value).split())
    return text if len(text) <= 40 else f"{text[:37]}..."


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
