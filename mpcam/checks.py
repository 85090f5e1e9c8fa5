"""Values from callers: how they are shown in a message, and the checks that many functions share."""

from typing import Any

import numpy as np

from mpcam.errors import InputError


def shown(value: Any) -> str:
    """A value as it appears in an error message: one line, not too long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def is_number(value: Any) -> bool:
    """Whether a value is one finite real number; True and False are none."""
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool) and bool(np.isfinite(value))


def reads_as_number(text: str) -> bool:
    """Whether a text is a number, as `float` reads it."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def number_table(value: Any) -> np.ndarray:
    """The value as a new float64 array of any shape; (0,) where it is none of numbers."""
    try:
        return np.array(value, np.float64)
    except (TypeError, ValueError):
        return np.zeros(0)


def vectors(name: str, value: Any) -> np.ndarray:
    """The value as float64 (..., 3), finite or not; raises InputError for other shapes and what is no number."""
    try:
        found = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: numbers of shape (..., 3) are needed, got {shown(value)}") from None
    if found.ndim == 0 or found.shape[-1] != 3:
        raise InputError(f"{name} has shape {found.shape}: the last axis must have length 3")
    return found


def three_numbers(name: str, value: Any, hint: str = "") -> np.ndarray:
    """The value as a new array (3,); raises InputError unless it is three finite numbers. hint: what else may be."""
    found = number_table(value)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise InputError(f"{name}={shown(value)}: give three finite numbers{hint}")
    return found


def whole_number(
    name: str, value: Any, low: int, high: int | None = None, *, of: str = "", unit: str = "", hint: str = ""
) -> int:
    """The value as an int; raises InputError unless it is a whole number from low to high (None: no limit).

    name: of the argument. of: the function that it was given to. unit: what is counted. hint: what it does, in a few
    words.
    """
    if not isinstance(value, bool) and isinstance(value, (int, np.integer)):
        if low <= value and (high is None or value <= high):
            return int(value)
    given = f"{name}={shown(value)}"
    kind = f"a whole number of {unit}" if unit else "a whole number"
    if high is None:
        allowed = f">= {low}"
    else:
        allowed = f"from {low:,} to {high:,}" if high >= 100_000 else f"from {low} to {high}"
    raise InputError(f"{f'{of}({given})' if of else given}: {kind} {allowed} is needed{f' ({hint})' if hint else ''}")
