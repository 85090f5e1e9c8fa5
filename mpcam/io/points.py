"""Points in text: a row each, as spreadsheets, NumPy and most tools write them."""

import re
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mpcam.errors import InputError

_BEGINS = re.compile(r"[-+]?[.,]?\d")  # how numbers begin, also those that are none, such as 1,5 or 1_000


def read_points(source: str | Path) -> np.ndarray:
    """Points (N, 3) float64 from a text file, or from standard input if source is "-".

    A row holds x, y, z, separated by semicolons, by commas or by blanks, with a point before decimals; further columns
    are ignored, and so are empty rows, what follows a #, and a first row without any number (a header). Raises
    InputError, with the line, for anything else.
    """
    if source == "-":
        return parse_points(sys.stdin, "standard input")
    try:
        with open(source, encoding="utf-8-sig") as lines:
            return parse_points(lines, str(source))
    except OSError as error:
        raise InputError(f"{source}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{source}: is not text: give rows of x, y, z") from None


def read_point(text: str, name: str) -> np.ndarray:
    """One point (3,) from text like "1,0,2.5"; `name` says in errors what it is for."""
    try:
        point = np.array([float(cell) for cell in text.replace(",", " ").split()])
    except ValueError:
        point = np.zeros(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError(f"{name} {text}: give three numbers, as 1,0,2.5")
    return point


def parse_points(lines: Iterable[str], name: str) -> np.ndarray:
    """Points (N, 3) from rows of text; `name` says in errors where they are from. See read_points."""
    points = []
    header = True
    for number, line in enumerate(lines, 1):
        text = line.split("#", 1)[0].strip()
        if not text:
            continue
        cells = _cells(text)
        numbers = [_number(cell) for cell in cells]
        if header and any(cells) and not any(map(_BEGINS.match, cells)) and all(value is None for value in numbers):
            header = False
            continue
        header = False
        where = f"{name}:{number}: {line.strip()!r:.60}"
        if ";" in text and any("," in cell for cell in cells):
            raise InputError(f"{where}: give decimals with a point, as 1.5, and three numbers x, y, z")
        if None in numbers[:3]:
            raise InputError(f"{where}: give three numbers x, y, z")
        if len(cells) < 3:
            raise InputError(f"{where} is too short: give three numbers x, y, z")
        points.append(numbers[:3])
    if not points:
        raise InputError(f"{name}: has no points: give rows of x, y, z")
    return np.array(points, np.float64)


def _cells(text: str) -> list[str]:
    """What stands between semicolons, or else commas, or else blanks; without quotes around it."""
    separator = next((sign for sign in ";," if sign in text), None)
    cells = text.split(separator)
    if separator and not cells[-1].strip():  # a separator at the end of the row
        cells = cells[:-1]
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _number(cell: str) -> float | None:
    """A number, NaN and infinity among them; None for other texts, such as 1_000."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
