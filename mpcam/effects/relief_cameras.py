"""Cameras for reliefs: what sees a tile from above, along parallel rays or around the thing in it."""

from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.orthographic import Orthographic
from mpcam.cameras.single_pole import SinglePoleOcclusion
from mpcam.checks import is_number, shown, whole_number
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import look_at

KINDS = ("single_pole", "orthographic")
HEIGHT, ASIDE = 3.0, 3.0
"""Of the eye of the single pole: how far it is above the box, and how far beside it rays come from, in half diagonals
of the box.
"""


def relief_camera(
    camera: Any,
    box: np.ndarray,
    size: int = 512,
    *,
    top: float | None = None,
    height: float = HEIGHT,
    aside: float = ASIDE,
) -> Camera:
    """A camera that looks down on a tile, by name or as it is; see `Relief.render`.

    box: (2, 3), tile frame. Of "single_pole" top: z of the thing in the middle of the box, default the box's; what is
    higher is seen as by a pinhole, and around what is lower rays bend: if they began to higher up, some would miss the
    middle. height: how far the eye is above that. aside: how far beside the eye bent rays come from; both in half
    diagonals of the box. A lower eye and more aside see more of the sides, and less sharply; images of rays are longer
    then. Raises InputError.
    """
    if isinstance(camera, Camera):
        return camera
    if not isinstance(camera, str) or camera not in KINDS:
        raise InputError(f"camera={shown(camera)}: give one of mpcam's cameras, or {' or '.join(map(repr, KINDS))}")
    size = whole_number("size", size, 8, 8192, unit="pixels")
    low, high = np.asarray(box, np.float64)
    center, extent = 0.5 * low + 0.5 * high, high - low
    if camera == "orthographic":
        scale = size / float(extent[:2].max())
        columns, rows = (max(round(scale * float(side)), 1) for side in extent[:2])
        above = (center[0], center[1], high[2] + 0.05 * float(extent.max()))
        return Orthographic(columns, rows, scale, camera_from_world=look_at(above, center, (0.0, 1.0, 0.0)))
    for name, value, least in (("height", height, "above 0"), ("aside", aside, "from 0")):
        if not is_number(value) or value < 0 or (name == "height" and value == 0):
            raise InputError(f"relief_camera({name}={shown(value)}): a finite number {least} is needed")
    radius = 0.5 * float(np.linalg.norm(extent))
    level = float(high[2] if top is None else np.clip(top, low[2] + 0.02 * extent[2], high[2]))
    near = height * radius + float(high[2]) - level
    far, beside = near + level - float(low[2]), aside * radius
    # d(z) = f beside (1 / near - 1 / z): corners of the box land so far from the pole, in focal lengths.
    across = 0.5 * float(np.linalg.norm(extent[:2]))
    widest = max(across / z + beside * (1 / near - 1 / max(z, near)) for z in (height * radius, near, far))
    focal = 0.5 * size / widest
    pose = look_at((center[0], center[1], level + near), center, (0.0, 1.0, 0.0))
    return SinglePoleOcclusion(
        size,
        size,
        focal,
        focal,
        0.5 * size,
        0.5 * size,
        near=near,
        far=far,
        shift_far=focal * beside * (1 / near - 1 / far),
        camera_from_world=pose,
    )


def top_in_middle(mesh: Mesh, box: np.ndarray) -> float | None:
    """z of the highest point of a mesh on the vertical line through the middle of a box; None where there is none."""
    middle = 0.5 * (box[0, :2] + box[1, :2])
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        a, b, c = (mesh.corners[:, i] for i in range(3))
        sides = [_cross(q[:, :2] - p[:, :2], middle - p[:, :2]) for p, q in ((b, c), (c, a), (a, b))]
        total = sum(sides)
        weights = np.stack(sides, axis=1) / np.where(total == 0, 1.0, total)[:, None]
        inside = (total != 0) & (weights >= 0).all(axis=1)
        heights = (weights * np.stack([a[:, 2], b[:, 2], c[:, 2]], axis=1)).sum(axis=1)
    found = heights[inside & np.isfinite(heights)]
    return float(found.max()) if len(found) else None


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
