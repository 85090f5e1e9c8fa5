"""Single-pole occlusion cameras for tests, and points that they see."""

from typing import Any

import numpy as np
from catalog import POSE

import mpcam as mp
from mpcam.cameras.types import RayPieces

EXAMPLES: dict[str, Any] = mp.SinglePoleOcclusion.examples(96, 64, POSE)
SHIFTED = [name for name, camera in EXAMPLES.items() if camera.shift_far > 0]
RANGES = ("before", "within", "beyond")


def make(**changes: Any) -> mp.SinglePoleOcclusion:
    """A usual one, with fx != fy and a pole beside the center, at the identity pose."""
    given = {"near": 1.0, "far": 3.0, "shift_near": 2.0, "shift_far": 20.0, "pole": (40.0, 25.0)} | changes
    return mp.SinglePoleOcclusion(96, 64, 60.0, 52.0, 45.0, 33.0, **given)


def seen(camera: Any, ranges: str, count: int = 3000, seed: int = 0) -> np.ndarray:
    """Points (count, 3) in the world, before, within or beyond the range of depths."""
    rng = np.random.default_rng(seed)
    part = rng.uniform(0, 1, count)
    z = {
        "before": camera.near * (0.02 + 0.98 * part),
        "within": camera.near + (camera.far - camera.near) * part,
        "beyond": camera.far * (1 + 9 * part),
    }[ranges]
    pixel = rng.uniform(-0.5, 1.5, (2, count)) * [[camera.width], [camera.height]]
    local = np.stack([(pixel[0] - camera.cx) * z / camera.fx, (pixel[1] - camera.cy) * z / camera.fy, z], -1)
    pose = np.asarray(camera.camera_from_world)
    return (local - pose[:3, 3]) @ pose[:3, :3]


def at(pieces: RayPieces, k: int, length: np.ndarray) -> np.ndarray:
    """Points so far along the bent ray, on its piece k."""
    return pieces.origin[:, k] + (length - pieces.start[:, k])[:, None] * pieces.direction[:, k]
