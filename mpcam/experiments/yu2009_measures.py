"""What the experiments after Yu et al. 2009 measure: frames against ray tracing, holes, seams."""

from typing import Any

import numpy as np

from mpcam.comparison.metrics import hit_errors, image_rmse
from mpcam.experiments.common import mismatch

AT, HEIGHTS = 1e-9, 33
"""Pixels from a border where rays are compared, and at how many heights."""


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

    labelled: Any = label(~found, np.ones((3, 3)))
    patches, count = labelled
    background = np.zeros(count + 1, bool)
    background[patches[~expected]] = True
    return int(np.count_nonzero(~found & ~background[patches]))


def seam(camera: Any) -> dict[str, float]:
    """Largest jump of rays from the left to the right of the borders between columns.

    degrees: between directions. units: how far the ray on the right starts from the line of that on the left, scene
    units.
    """
    borders = camera.columns[1:-1]
    y = np.linspace(0.0, camera.height, HEIGHTS)
    x = np.repeat(np.asarray(borders, float), len(y))
    left, right = (camera.ray(np.stack([x + step, np.tile(y, len(borders))], axis=1)) for step in (-AT, AT))
    turn = np.linalg.norm(np.cross(left.direction, right.direction), axis=1)
    gap = np.linalg.norm(np.cross(right.origin - left.origin, left.direction), axis=1)
    return {"degrees": float(np.degrees(np.arcsin(min(turn.max(), 1.0)))), "units": float(gap.max())}


def seam_pixels(camera: Any, distances: tuple[float, ...]) -> float:
    """How far from the border between the first two columns the second one shows what the first shows there, pixels.

    distances: from where rays start, of the points that are looked at; the worst of all counts.
    """
    pixel = np.stack(np.broadcast_arrays(float(camera.columns[1]), np.linspace(0.0, camera.height, HEIGHTS)), axis=1)
    ray, second, worst = camera.piece(0).ray(pixel), camera.piece(1), 0.0
    for distance in distances:
        image = second.project(ray.origin + distance * ray.direction)
        shown = np.where(image.valid[:, :1], np.asarray(image.pixel)[:, 0], np.inf)
        worst = max(worst, float(np.linalg.norm(shown - pixel, axis=1).max()))
    return worst
