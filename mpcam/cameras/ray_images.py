"""Images of points in a ray map: its cells that may see a point, the roots in them, and the nearest of these. NumPy."""

import numpy as np

from mpcam.cameras.cell_roots import roots
from mpcam.cameras.cell_tree import CellTree

_PAIRS = 1 << 15
"""Pairs of a point and a cell that are solved in one go."""


def images(tree: CellTree, points: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (most, 2, N) and validity (most, N) of the images of points (3, N), in the order of their depths.

    Of more images than `most`, the nearest count. Where there is none, the pixel is 0.
    """
    found = [np.zeros((5, 0))]
    with np.errstate(all="ignore"):
        for point, cell in tree.candidates(points):
            for start in range(0, len(point), _PAIRS):
                part = slice(start, start + _PAIRS)
                found.append(_in_cells(tree, points, point[part], cell[part]))
    point, u, v, depth, error = np.concatenate(found, 1)
    order = np.lexsort((u, point))
    point, u, v, depth, error = (values[order] for values in (point.astype(np.int64), u, v, depth, error))
    kept = ~_repeated(point, u, v, error)
    order = np.lexsort((depth[kept], point[kept]))
    point, u, v = (values[kept][order] for values in (point, u, v))
    rank = np.arange(len(point)) - np.searchsorted(point, point)
    shown = rank < most
    pixels, valid = np.zeros((most, 2, points.shape[1])), np.zeros((most, points.shape[1]), bool)
    pixels[rank[shown], :, point[shown]] = np.stack([u[shown], v[shown]], -1)
    valid[rank[shown], point[shown]] = True
    return pixels, valid


def _in_cells(tree: CellTree, points: np.ndarray, point: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Point number, u, v, depth and error in pixels of the images of points in cells, one row each."""
    places, along = tree.corners(cell)
    given = np.take(points, point, axis=1)
    found = roots(given, places, along)
    x, y, error = found.x, found.y, found.error
    # Rounding may lead over the border, where other cells, or none, take over.
    inside = (np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) - 0.5) <= error
    x, y = np.clip(x, 0.0, 1.0), np.clip(y, 0.0, 1.0)
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y])[:, None]
    origin, direction = ((weights * corners[..., found.number]).sum(0) for corners in (places, along))
    seen = given[:, found.number]
    length = np.sqrt((direction * direction).sum(0))
    depth = ((seen - origin) * direction).sum(0) / np.where(length > 0, length, 1.0)
    rounding = 16 * 2.0**-52 * (np.abs(seen) + np.abs(origin)).max(0)
    kept = inside & (length > 0) & (depth >= -rounding)
    low, size = tree.box(cell[found.number])
    pixel = low + size * np.stack([x, y])
    return np.stack([point[found.number], *pixel, depth, error * size.max(0) + 1e-15 * np.abs(pixel).max(0)])[:, kept]


def _repeated(point: np.ndarray, u: np.ndarray, v: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Which images were found before: the same place, from both sides of a border. Sorted by point, then by u."""
    repeated = np.zeros(len(point), bool)
    nearest = 4 * error.max(initial=0.0)
    for back in range(1, len(point)):
        now, before = slice(back, None), slice(None, -back)
        close = (point[now] == point[before]) & (u[now] - u[before] <= nearest)
        if not close.any():  # nor is any farther back
            break
        near = 2 * (error[now] + error[before])
        same = (np.abs(u[now] - u[before]) <= near) & (np.abs(v[now] - v[before]) <= near)
        repeated[now] |= close & same
    return repeated
