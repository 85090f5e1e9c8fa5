"""Points in text: a row each, as spreadsheets, NumPy and most tools write them."""

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mpcam.errors import InputError


def read_points(source: str | Path) -> np.ndarray:
    """Points (N, 3) float64 from a text file, or from standard input if source is "-".

    A row holds x, y, z, separated by commas, semicolons or blanks; further columns are ignored, and so are empty rows,
    what follows a #, and a first row without numbers (a header). Raises InputError, with the line, for anything else.
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
        cells = line.split("#", 1)[0].replace(",", " ").replace(";", " ").split()
        if not cells:
            continue
        try:
            points.append([float(cell) for cell in cells[:3]])
        except ValueError:
            if not header:
                raise InputError(f"{name}:{number}: {line.strip()!r:.60}: give three numbers x, y, z") from None
        else:
            if len(cells) < 3:
                raise InputError(f"{name}:{number}: {line.strip()!r:.60} is too short: give three numbers x, y, z")
        header = False
    if not points:
        raise InputError(f"{name}: has no points: give rows of x, y, z")
    return np.array(points, np.float64)
