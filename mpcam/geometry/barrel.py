"""A barrel of wooden staves with iron hoops, closed all round."""

import numpy as np

from mpcam.geometry.levels import Level, fitted
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, MeshPart, moved
from mpcam.geometry.solids import turned
from mpcam.geometry.textures import painted, planks, textured

HEIGHT, END, BELLY = 0.9, 0.29, 0.36
FULL = 6_000


def barrel(triangles: int) -> Mesh:
    """0.72 wide and 0.9 high on z = 0: within 4 % of so many triangles."""
    return fitted(_parts, triangles, FULL).mesh("barrel")


def radius_at(height):
    """Radius of the staves at a height, 0 to 0.9."""
    off = np.asarray(height, np.float64) / (0.5 * HEIGHT) - 1.0
    return BELLY - (BELLY - END) * off**2


def _parts(level: Level) -> Builder:
    builder = Builder()
    side = [(float(radius_at(z)), z) for z in np.linspace(0.0, HEIGHT, 9)]
    inner, sunk = END - 0.028, 0.045
    bottom = [(0.0, sunk), (inner, sunk), None, (inner, 0.0), None, side[0], None]
    top = [None, (inner, HEIGHT), None, (inner, HEIGHT - sunk), None, (0.0, HEIGHT - sunk)]
    staves = textured("staves", planks("#a8743f", 92, count=18, size=256))
    builder.add(turned([*bottom, *side[1:], *top], level, 30, 64), staves)
    iron = painted("hoop", "#3d4046")
    for low, high in ((0.02, 0.085), (0.2, 0.25), (0.65, 0.7), (0.815, 0.88)):
        a, b = (float(radius_at(z)) for z in (low, high))
        hoop = [(a - 0.01, low), (a + 0.009, low), None, (b + 0.009, high), None, (b - 0.01, high), None]
        builder.add(turned([*hoop, hoop[0]], level, 4, 64), iron)
    builder.add(_bung(level), iron)
    return builder


def _bung(level: Level) -> MeshPart:
    """A plug in the head, near its edge."""
    low, high = HEIGHT - 0.06, HEIGHT - 0.02
    plug = turned([(0.0, low), (0.035, low), None, (0.035, high), None, (0.0, high)], level, 6, 24)
    return moved(plug, (0.14, 0.05, 0.0))
