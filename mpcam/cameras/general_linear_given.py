"""Numbers, vectors and lines that people give to makers of general linear cameras, checked."""

from typing import Any

import numpy as np

from mpcam.checks import is_number, number_table, shown, three_numbers
from mpcam.errors import InputError


def axis_pixel(width: int, height: int, cx: float | None, cy: float | None) -> tuple[float, float]:
    """The pixel of the axis, the middle if it is left out."""
    return (
        0.5 * width if cx is None else a_number("cx", cx),
        0.5 * height if cy is None else a_number("cy", cy),
    )


def focal_lengths(width: int, fx: float | None, fy: float | None) -> tuple[float, float]:
    first = 0.5 * width if fx is None else a_positive("focal length", fx)
    return first, first if fy is None else a_positive("fy", fy)


def pixels_per_unit(width: int, height: int, scale: float | None) -> float:
    return 0.5 * min(width, height) if scale is None else a_positive("scale", scale)


def a_number(name: str, value: Any) -> float:
    if not is_number(value):
        raise InputError(f"{name}={shown(value)}: a finite number is needed")
    return float(value)


def a_positive(name: str, value: Any) -> float:
    if not is_number(value) or not value > 0:
        raise InputError(f"{name}={shown(value)}: a number above 0 is needed")
    return float(value)


def a_nonzero(name: str, value: Any) -> float:
    if a_number(name, value) == 0:
        raise InputError(f"{name}={shown(value)}: not zero, or it is another kind of camera")
    return float(value)


def seen_extent(value: Any, width: int, height: int) -> tuple[float, float]:
    pair = np.atleast_1d(np.asarray(value, object))
    wide = a_positive("extent", pair[0])
    if pair.shape not in ((1,), (2,)):
        raise InputError(f"extent={shown(value)}: give a width, or a width and a height")
    return wide, wide * height / width if len(pair) == 1 else a_positive("extent", pair[1])


def a_slit(line: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
    try:
        point, direction = line
    except (TypeError, ValueError):
        raise InputError(f"cross_slit: {name}={shown(line)}: give a point (3,) and a direction (3,)") from None
    point, direction = three_numbers(f"{name}, its point", point), three_numbers(f"{name}, its direction", direction)
    if not direction.any():
        raise InputError(f"cross_slit: the direction of the {name} slit is zero")
    return point, direction / np.linalg.norm(direction)


def ray_rows(value: Any, name: str) -> np.ndarray:
    found = number_table(value)
    if found.shape != (3, 3) or not np.isfinite(found).all():
        raise InputError(f"from_rays: {name} has shape {np.shape(value)}: give (3, 3) finite numbers, a row for a ray")
    return found
