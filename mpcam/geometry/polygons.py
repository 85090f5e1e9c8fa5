"""Polygons in space as triangles: a fan where that is right, cut by ears where a polygon is concave."""

from collections.abc import Callable

import numpy as np


def triangulate(
    counts: np.ndarray, points: np.ndarray, say: Callable[[str], None] = lambda text: None
) -> tuple[np.ndarray, np.ndarray]:
    """Corner numbers (F, 3) of the triangles of all polygons, in their order, and (F,) the polygon of each.

    counts: (P,) corners of each polygon, 3 at least. points: (C, 3) where the corners are, polygon after polygon. A
    polygon that its first corner sees whole, as every convex one, becomes the fan from there; others are cut in the
    plane across their mean normal, which need not be that of an axis. Polygons without area stay fans. say is told of
    polygons that cross themselves.
    """
    counts = np.asarray(counts, np.int64)
    corners, polygon = _fans(counts)
    if counts.max(initial=3) == 3:
        return corners, polygon
    with np.errstate(invalid="ignore", over="ignore"):
        a, b, c = (points[corners[:, k]] for k in range(3))
        areas = np.cross(b - a, c - a)
        normals = np.stack([np.bincount(polygon, areas[:, k], len(counts)) for k in range(3)], axis=1)
        size = (normals * normals).sum(axis=1)
        turned = (areas * normals[polygon]).sum(axis=1) < -1e-9 * size[polygon]
    concave = np.unique(polygon[turned & np.isfinite(size[polygon]) & (size[polygon] > 0)])
    if len(concave) == 0:
        return corners, polygon
    starts = np.cumsum(counts) - counts
    kept = ~np.isin(polygon, concave)
    parts, owners, crossing = [corners[kept]], [polygon[kept]], 0
    for k in concave:
        start = starts[k]
        triangles, whole = _ears(points[start : start + counts[k]], normals[k])
        crossing += not whole
        parts.append(start + triangles)
        owners.append(np.full(len(triangles), k))
    if crossing:
        say(f"{crossing} polygons cross themselves: they are filled as far as can be")
    corners, polygon = np.concatenate(parts), np.concatenate(owners)
    order = np.argsort(polygon, kind="stable")
    return corners[order], polygon[order]


def _fans(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    triangles = counts - 2
    polygon = np.repeat(np.arange(len(counts)), triangles)
    first = (np.cumsum(counts) - counts)[polygon]
    step = np.arange(len(polygon)) - (np.cumsum(triangles) - triangles)[polygon]
    return np.stack([first, first + step + 1, first + step + 2], axis=1), polygon


def _ears(points: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, bool]:
    """The triangles (F, 3) of one polygon, turned as it is, and whether they have its area."""
    import mapbox_earcut

    normal = normal / np.linalg.norm(normal)
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    flat = (points - points[0]) @ np.stack([across, np.cross(normal, across)], axis=1)
    ends = np.array([len(flat)], np.uint32)
    triangles = mapbox_earcut.triangulate_float64(np.ascontiguousarray(flat), ends).reshape(-1, 3).astype(np.int64)
    if len(triangles) == 0:
        return _fans(np.array([len(points)]))[0], False
    x, y = flat.T
    areas = _doubled(x[triangles], y[triangles])
    triangles[areas < 0] = triangles[areas < 0][:, ::-1]
    return triangles, bool(abs(np.abs(areas).sum() - _doubled(x, y)) <= 1e-6 * np.abs(areas).sum())


def _doubled(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Twice the signed area of polygons, by the shoelace formula along the last axis."""
    return (x * np.roll(y, -1, axis=-1) - np.roll(x, -1, axis=-1) * y).sum(axis=-1)
