"""Order along a space-filling curve, so that neighbors in space are neighbors in memory."""

import numpy as np

BITS = 10


def interleaved(cells: np.ndarray) -> np.ndarray:
    """Morton numbers (N,) of whole coordinates (N, 2) below 2**31, or (N, 3) below 2**21."""
    dimensions = cells.shape[1]
    result = np.zeros(len(cells), np.int64)
    bits = int(cells.max()).bit_length() if cells.size else 0
    for axis in range(dimensions):
        for bit in range(bits):
            result |= (cells[:, axis].astype(np.int64) >> bit & 1) << (bit * dimensions + axis)
    return result


def nearby(points: np.ndarray) -> np.ndarray:
    """Numbers of points (N, 3), so that neighbors lie close together; points that are not finite come last."""
    finite = np.isfinite(points).all(axis=1)
    some = points[finite]
    low, high = (some.min(0), some.max(0)) if len(some) else (np.zeros(3), np.ones(3))
    extent = float((high - low).max()) or 1.0
    cells = np.zeros(points.shape, np.int64)
    cells[finite] = np.minimum((some - low) / extent * (1 << BITS), (1 << BITS) - 1).astype(np.int64)
    return np.argsort(np.where(finite, interleaved(cells), np.iinfo(np.int64).max), kind="stable")
