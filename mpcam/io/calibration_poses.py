"""Poses in calibration files: rigid matrices, put right where they were rounded by hand, left out where they are none.

A lens is of use without its pose, so a pose that cannot be used costs a warning and not the camera.
"""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.errors import InputError
from mpcam.io.calibration_parts import Section, as_number

EXACT, ROUNDED = 1e-5, 0.02
"""By how much the products of a rotation's rows may miss 0 and 1: as programs write them, and as people round them."""


def inverse(pose: np.ndarray) -> np.ndarray:
    """The inverse of a rigid 4x4 transform."""
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def matrix(part: Section, key: str) -> np.ndarray:
    """The 4x4 matrix of a key: rows of four numbers, or one list of them; the last row may be missing.

    Raises InputError, by the key, for anything else.
    """
    rows, where = part.get(key), f"{part.where}: {key}"
    if isinstance(rows, dict):  # OpenCV's
        rows = Section(where, rows).get("data")
    if isinstance(rows, list) and len(rows) in (12, 16) and not any(isinstance(row, (list, dict)) for row in rows):
        rows = [rows[start : start + 4] for start in range(0, len(rows), 4)]
    if (
        not isinstance(rows, list)
        or len(rows) not in (3, 4)
        or not all(isinstance(row, list) and len(row) == 4 for row in rows)
    ):
        raise part.error(f"{key}: four rows of four numbers are needed (the last, 0 0 0 1, may be missing)")
    found = np.array([[as_number(item, where) for item in row] for row in rows])
    return found if len(found) == 4 else np.concatenate([found, [[0.0, 0.0, 0.0, 1.0]]])


def rotated(rotation: Any, shift: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    """The 4x4 matrix of a 3x3 rotation and a translation."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, shift
    return pose


def quaternion_matrix(w: float, x: float, y: float, z: float) -> np.ndarray:
    """(3, 3) of a quaternion: a rotation times the square of its length, so that a wrong length shows."""
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


class Poses:
    """The poses of one file: each is checked, and what was wrong with them is said once, by `warn`."""

    def __init__(self) -> None:
        self.mended: list[tuple[str, float]] = []
        self.lost: list[tuple[str, str]] = []

    def rigid(self, name: str, found: np.ndarray) -> np.ndarray | None:
        """The rigid transform nearest to a matrix, or None where that is far; name: place and key, for the warning."""
        rotation = found[:3, :3]
        off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
        if np.abs(found[3] - [0, 0, 0, 1]).max() > 1e-9:
            return self.lose(name, "has a last row that is not 0 0 0 1")
        if off > ROUNDED:
            return self.lose(name, f"is not a rigid transform: its rotation is off by {off:.2g}")
        if np.linalg.det(rotation) < 0:
            return self.lose(name, "is not a rigid transform: it mirrors (its determinant is -1)")
        if off > EXACT:
            self.mended.append((name, off))
        return rotated(nearest_rotation(rotation), found[:3, 3]) if off > 1e-14 else found

    def lose(self, name: str, reason: str) -> None:
        """Note a pose that cannot be used."""
        self.lost.append((name, reason))

    def read(self, part: Section, key: str) -> np.ndarray | None:
        """The rigid transform of a key, or None with a note."""
        return self.made(f"{part.where}: {key}", lambda: matrix(part, key))

    def made(self, name: str, make: Callable[[], np.ndarray]) -> np.ndarray | None:
        """The rigid transform of a matrix that `make` finds in the file, or None with a note, also where it raises."""
        try:
            found = make()
        except InputError as error:
            return self.lose(name, str(error).removeprefix(f"{name}: "))
        return self.rigid(name, found)

    def warn(self) -> None:
        """Say what was put right, and what was left out."""
        if self.mended:
            name, off = self.mended[0]
            _say(
                f"{name}: its rotation is off by {off:.2g}, as if rounded by hand{_others(self.mended)}: the nearest "
                "rotation is taken"
            )
        if self.lost:
            name, reason = self.lost[0]
            _say(
                f"{name}: {reason}{_others(self.lost)}: the lens is read and its pose left out (it is at the origin, "
                "along +z); mend the file, or place it by with_pose, pose = in a scene file, or --eye and --target"
            )


def _say(text: str) -> None:
    warnings.warn(text, UserWarning, stacklevel=6)


def nearest_rotation(matrix: np.ndarray) -> np.ndarray:
    """The rotation nearest to a 3x3 matrix."""
    left, _, right = np.linalg.svd(matrix)
    return left @ right


def _others(found: list[Any]) -> str:
    return f" (and {len(found) - 1} more like it)" if len(found) > 1 else ""
