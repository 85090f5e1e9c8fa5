"""Where the rays of neighboring pixels do not belong together: parts of an image within which rays change smoothly."""

from typing import Any

import numpy as np

JUMP = 8.0
"""Two rays do not belong together if they differ so many times more than their neighbors do."""
FLOOR = 1e-5
"""Differences of directions, and of origins over their range, that tell nothing."""


def smooth_parts(width: int, height: int, pixels: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """A number for each of some pixels (N,), the same for those that are connected without a jump of the rays.

    All are 0 where nothing jumps. pixels (N,): row by row. origin, direction (3, N).
    """
    from scipy.ndimage import label

    there = np.zeros((height, width), bool)
    there.ravel()[pixels] = True
    across, down = there[:, 1:] & there[:, :-1], there[1:] & there[:-1]
    pairs = np.count_nonzero(across) + np.count_nonzero(down)
    spread = max((float(np.ptp(part)) for part in origin), default=0.0) if len(pixels) else 0.0
    for vectors, floor in ((direction, FLOOR), (origin, FLOOR * spread)):
        right, below = _squares(vectors, pixels, there.shape)
        across &= ~_jumps(right, floor)
        down &= ~_jumps(below.T, floor).T
    if np.count_nonzero(across) + np.count_nonzero(down) == pairs:
        return np.zeros(len(pixels), np.int64)
    # A finer grid, which also has a place for every pair of neighbors.
    grid = np.zeros((2 * height - 1, 2 * width - 1), bool)
    grid[::2, ::2], grid[::2, 1::2], grid[1::2, ::2] = there, across, down
    found: Any = label(grid)
    return found[0][::2, ::2].ravel()[pixels].astype(np.int64)


def _squares(vectors: np.ndarray, pixels: np.ndarray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Squared differences of vectors (3, N) from those of the pixels to the right and below; NaN where one is none."""
    across, down = np.zeros((shape[0], shape[1] - 1), np.float32), np.zeros((shape[0] - 1, shape[1]), np.float32)
    image = np.full(shape, np.nan, np.float32)
    for values in vectors:
        image.ravel()[pixels] = values
        across += np.square(image[:, 1:] - image[:, :-1])
        down += np.square(image[1:] - image[:-1])
    return across, down


def _jumps(squares: np.ndarray, floor: float) -> np.ndarray:
    """Which squared differences of columns are far larger than the two to their left, or the two to their right."""
    count = squares.shape[1]
    wide = np.pad(squares, ((0, 0), (2, 2)), constant_values=np.nan)
    left = np.fmax(wide[:, :count], wide[:, 1 : count + 1])
    right = np.fmax(wide[:, 3 : count + 3], wide[:, 4 : count + 4])
    return squares > JUMP**2 * np.fmin(left, right) + floor**2
