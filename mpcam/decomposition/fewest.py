"""How few camera triangles are enough: a search for the smallest number within an error."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import is_number, shown
from mpcam.decomposition.ray_error import error_beside
from mpcam.decomposition.reflector import Reflector
from mpcam.decomposition.views import seen_samples
from mpcam.errors import InputError

CLOSE = 1.02
"""Numbers that are no farther apart are as good as one."""
BELOW = (0.79, 0.82, 0.85, 0.88, 0.91, 0.94, 0.97)
"""Errors do not fall evenly: parts of the number found at which a smaller one may be good as well."""
_FASTEST = 16.0

_SAMPLES = 20_000

T = TypeVar("T")


class Limit(NamedTuple):
    """An error that is not to be exceeded: "max_angle" or "max_error", and how much."""

    name: str
    most: float


def limit_of(triangles: int | None, max_angle: float | None, max_error: float | None) -> Limit | None:
    """The limit that was given in place of a number of triangles, if any. Raises InputError for more than one."""
    limits = [
        Limit(name, value) for name, value in (("max_angle", max_angle), ("max_error", max_error)) if value is not None
    ]
    if len(limits) > 1 or (limits and triangles is not None):
        raise InputError("triangles, max_angle and max_error say the same thing in three ways: give one of them")
    for name, value in limits:
        if not is_number(value) or value <= 0:
            unit = "radians" if name == "max_angle" else "scene units"
            raise InputError(f"{name}={shown(value)}: give a finite number above 0, in {unit}")
    return limits[0] if limits else None


def fewest_within(
    cut: Callable[[int], CameraTriangles], limit: Limit, whole: Reflector, eye: Any, largest: int
) -> CameraTriangles:
    """The fewest camera triangles within an error, by `ray_error` at samples of what an eye sees."""
    view = seen_samples(whole, eye, _SAMPLES)

    def error(cams: CameraTriangles) -> float:
        found = error_beside(cams, whole, view, 2.0 * whole.radius)
        return 1e-3 * found.angle_rms if limit.name == "max_angle" else found.rms

    return fewest(cut, error, limit.most, 104, largest, f"{limit.name}={limit.most:g}")


def fewest(
    make: Callable[[int], T],
    error: Callable[[T], float],
    most: float,
    start: int,
    largest: int,
    what: str,
    *,
    below: bool = True,
) -> T:
    """What `make` gives for the smallest number at which `error` is at most `most`.

    Errors are taken to fall about as one over the number. start: where to begin, largest: where to give up. what: to be
    achieved, for the message. below: whether smaller numbers than the one found are looked at. Raises InputError where
    the largest number is not enough.
    """
    good: tuple[int, T] | None = None
    bad, count = 0, min(start, largest)
    while True:
        found = make(count)
        here = error(found)
        if here <= most:
            good = count, found
        else:
            bad = max(bad, count)
            if count == largest:
                raise InputError(
                    f"{what} is not reached: {largest:,} camera triangles are off by {here:.3g}: allow more"
                )
        if good is not None and (good[0] <= max(bad, 1) * CLOSE or good[0] - bad <= 1):
            break
        step = min(max(here / most, 1 / _FASTEST), _FASTEST) if here > 0 else 1 / _FASTEST
        count = round(count * step * (1.01 if here > most else 0.99))
        low, high = bad + 1, largest if good is None else good[0] - 1
        if good is not None and bad and not bad * CLOSE <= count <= high:
            count = round(math.sqrt(bad * good[0]))
        count = min(max(count, low), high)
    for part in BELOW if below else ():
        count = math.floor(part * good[0])
        if count <= 0 or count == bad:
            continue
        found = make(count)
        if error(found) <= most:
            return found
    return good[1]
