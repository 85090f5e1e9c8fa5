"""A knotted tube: no place from which all of its sides are seen."""

import numpy as np

from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import surface, to_mesh, unit
from mpcam.geometry.textures import rgb, textured

_TUBE = 0.38
_ASPECT = 6.2  # cells along the tube for each around it, for cells about as long as wide


def knot(triangles: int) -> Mesh:
    """A trefoil tube within 1.5 of the origin, around z: 2 n m triangles, the nearest to the aspect of its cells."""
    around = max(round((triangles / 2 / _ASPECT) ** 0.5), 6)
    # Of a few numbers of cells around, that which leaves the smallest remainder.
    choices = range(max(around - 3, 6), around + 4)
    around = min(choices, key=lambda n: (abs(2 * n * max(round(triangles / 2 / n), 12) - triangles), abs(n - around)))
    along = max(round(triangles / 2 / around), 12)
    t = np.linspace(0, 2 * np.pi, along + 1)
    center, forward = _curve(t)
    # The normal of the torus that the curve winds around: no frame to carry along, and it closes.
    out = np.stack([np.cos(2 * t) * np.cos(3 * t), np.sin(2 * t) * np.cos(3 * t), np.sin(3 * t)], axis=1)
    side = unit(out - (out * forward).sum(axis=1, keepdims=True) * forward)
    up = np.cross(forward, side)
    angle = np.linspace(0, 2 * np.pi, around + 1)[:, None]
    normals = np.cos(angle) * side[:, None] + np.sin(angle) * up[:, None]
    points = center[:, None] + _TUBE * normals
    points[-1], normals[-1] = points[0], normals[0]
    u, v = np.meshgrid(angle[:, 0] / np.pi, 8 * t / np.pi)
    part = surface(points, np.stack([u, v], axis=2), unit(normals), closed=True)
    return to_mesh([(part, textured("glaze", _bands()))], "knot")


def _curve(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of the middle line, and its unit direction."""
    far, scale = 2.0 + np.cos(3 * t), 0.38
    place = np.stack([far * np.cos(2 * t), far * np.sin(2 * t), 1.25 * np.sin(3 * t)], axis=1)
    slope = np.stack(
        [
            -3 * np.sin(3 * t) * np.cos(2 * t) - 2 * far * np.sin(2 * t),
            -3 * np.sin(3 * t) * np.sin(2 * t) + 2 * far * np.cos(2 * t),
            3.75 * np.cos(3 * t),
        ],
        axis=1,
    )
    return scale * place, unit(slope)


def _bands(size: int = 128) -> np.ndarray:
    """Two bands of a glaze, one along the tube's inside, with thin lines across."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    base = np.where((x < 0.5)[..., None], rgb("#d9643a"), rgb("#f1dfbd"))
    line = np.minimum(y, 1 - y) < 0.06
    return np.where(line[..., None], rgb("#2c4a63"), base).astype(np.float32)
