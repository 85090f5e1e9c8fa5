"""What the experiments after Yu et al. 2009 measure: frames against ray tracing, holes, seams."""

from typing import Any

import numpy as np

from mpcam.comparison.metrics import hit_errors, image_rmse
from mpcam.experiments.common import mismatch

_AT = 1e-7  # pixels from a border


def errors(
    hits: Any, truth: Any, image: np.ndarray | None = None, true_image: np.ndarray | None = None
) -> dict[str, Any]:
    """How far a frame is from ray tracing, as cells of a table; the error of its picture where there are pictures."""
    found = hit_errors(hits, truth)
    row: dict[str, Any] = {
        "wrong_percent": 100 * mismatch(hits, truth) / truth.mask.size,
        "outline_percent": 100 * found.hit_mismatch,
        "holes": holes(hits.mask, truth.mask),
        "depth_median": found.depth_median,
        "depth_p999": found.depth_p999,
    }
    if image is not None and true_image is not None:
        row["rmse"] = image_rmse(image, true_image)
    return row


def holes(found: np.ndarray, expected: np.ndarray) -> int:
    """Pixels that nothing covers, in patches without any pixel where ray tracing, too, hits nothing."""
    from scipy.ndimage import label

    patches, count = label(~found, np.ones((3, 3)))  # pyright: ignore[reportGeneralTypeIssues]
    background = np.zeros(count + 1, bool)
    background[patches[~expected]] = True
    return int(np.count_nonzero(~found & ~background[patches]))


def seam(camera: Any, number: int | None = None) -> dict[str, float]:
    """Largest jump of rays from the left to the right of borders between columns, or of one of them.

    degrees: between directions. units: how far the ray on the right starts from the line of that on the left, scene
    units.
    """
    borders = camera.columns[1:-1] if number is None else camera.columns[number : number + 1]
    y = np.linspace(0.0, camera.height, 33)
    x = np.repeat(np.asarray(borders, float), len(y))
    left, right = (camera.ray(np.stack([x + step, np.tile(y, len(borders))], axis=1)) for step in (-_AT, _AT))
    turn = np.linalg.norm(np.cross(left.direction, right.direction), axis=1)
    gap = np.linalg.norm(np.cross(right.origin - left.origin, left.direction), axis=1)
    return {"degrees": float(np.degrees(np.arcsin(min(turn.max(), 1.0)))), "units": float(gap.max())}


def seam_pixels(camera: Any, points: np.ndarray, number: int = 1) -> float:
    """How far apart both neighbors of a border show points (N, 3) of the world that lie at it, pixels, at most.

    Of points less than half a pixel from the border in the left neighbor, where both see them. NaN if there is none.
    """
    x = float(camera.columns[number])
    first, second = (camera.piece(k).project(points) for k in (number - 1, number))
    a, b = first.pixel[:, 0], second.pixel[:, 0]
    near = first.valid[:, 0] & second.valid[:, 0] & (np.abs(a[:, 0] - x) < 1e-3)
    return float(np.linalg.norm(a - b, axis=1)[near].max()) if near.any() else float("nan")
