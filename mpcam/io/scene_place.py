"""Placements and colors as scene files give them."""

import math
from typing import Any

import numpy as np

from mpcam.io.scene_tables import RotateTable
from mpcam.io.scene_text import SceneText


def placement(
    scale: Any, rotate: RotateTable | None, translate: Any, where: tuple[str | int, ...], text: SceneText
) -> np.ndarray:
    """4x4: scale, then rotate, then translate."""
    factors = np.broadcast_to(np.asarray(scale, float), 3)
    if not np.all(factors >= 1e-30):
        raise text.error((*where, "scale"), "give numbers above 0 (from 1e-30)")
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(factors)
    if rotate is not None:
        axis = np.array(rotate.axis)
        largest = np.abs(axis).max()
        if largest == 0:
            raise text.error((*where, "rotate", "axis"), "give a direction, e.g. [0, 0, 1]")
        axis = axis / largest
        matrix[:3, :3] = _rotation(axis / np.linalg.norm(axis), math.radians(rotate.degrees)) @ matrix[:3, :3]
    matrix[:3, 3] = translate
    return matrix


def _rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """3x3 right-handed rotation about a unit axis (Rodrigues' formula)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)


def color(value: Any, text: SceneText, *where: str | int) -> tuple[float, float, float]:
    red, green, blue = np.broadcast_to(np.asarray(value, float), 3)
    if min(red, green, blue) < 0:
        raise text.error(where, "give linear RGB numbers that are not negative")
    return (float(red), float(green), float(blue))
