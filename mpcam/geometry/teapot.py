"""A teapot with lid, spout and handle, closed all round."""

import numpy as np

from mpcam.geometry.levels import Level, fitted
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, smooth_curve
from mpcam.geometry.solids import capped, tapered, turned
from mpcam.geometry.textures import painted, rgb, textured

BODY = ((0.45, 0.0), (0.68, 0.12), (0.82, 0.38), (0.76, 0.62), (0.58, 0.78), (0.5, 0.82))
"""Radius and height of the body, to the rim."""
LID = ((0.5, 0.82), (0.34, 0.9), (0.13, 0.95), (0.07, 0.99), (0.12, 1.07), (0.09, 1.14), (0.0, 1.16))
SPOUT = ((0.66, 0.0, 0.26), (0.98, 0.0, 0.4), (1.08, 0.0, 0.66), (1.3, 0.0, 0.86))
HANDLE = ((-0.68, 0.0, 0.66), (-1.05, 0.0, 0.72), (-1.2, 0.0, 0.5), (-1.05, 0.0, 0.28), (-0.74, 0.0, 0.22))
FULL = 20_000


def teapot(triangles: int) -> Mesh:
    """About 2.5 long and 1.16 high on z = 0, spout towards +x: within 4 % of so many triangles."""
    return fitted(_parts, triangles, FULL).mesh("teapot")


def _parts(level: Level) -> Builder:
    builder = Builder()
    rim = ((0.5, 0.82), (0.53, 0.835), (0.5, 0.85))
    lid = ((0.5, 0.85), *((radius, height + 0.03) for radius, height in LID[1:]))
    body = [(0.0, 0.02), (0.4, 0.02), None, (0.42, 0.0), (0.45, 0.0), None, *BODY[1:], *rim[1:], None, *lid[1:]]
    builder.add(turned(body, level, 62, 100), textured("china", _pattern()))
    clay, across = painted("clay", "#c9573a"), (0.0, 1.0, 0.0)
    spout = smooth_curve([(0.5, 0.0, 0.2), *SPOUT], level(36, 8))
    thick = np.interp(np.linspace(0, 1, len(spout)), [0, 0.2, 0.55, 1], [0.2, 0.2, 0.12, 0.075])
    builder.add(capped(spout, thick, level(34, 8), across), clay)
    builder.add(tapered(HANDLE, np.full(len(HANDLE), 0.065), level(48, 12), level(24, 6), across), clay)
    return builder


def _pattern(size: int = 256) -> np.ndarray:
    """Cream china with a band of blue lozenges, and a line above and below; v is the height."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    v, u = 1.0 - y, 12 * x % 1.0
    lozenge = np.abs(u - 0.5) / 0.42 + np.abs(v - 0.44) / 0.13 < 1
    line = (np.abs(np.abs(v - 0.44) - 0.19) < 0.018) | (np.abs(v - 0.86) < 0.012)
    color = np.where(lozenge[..., None], rgb("#2f5f93"), rgb("#efe6d0"))
    return np.where(line[..., None], rgb("#c9573a"), color).astype(np.float32)
