"""A small yellow car, closed all round: body, cabin, wheels, bumpers and lamps."""

import numpy as np

from mpcam.geometry.levels import Level, fitted
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, MeshPart, boxes, copies, ellipsoid, join, placements, smooth_curve
from mpcam.geometry.solids import capped, turned
from mpcam.geometry.textures import painted, rgb

BODY_COLOR = rgb("#f2c21a")
"""Of the body alone: what may be painted anew is known by it."""
FULL = 12_000
_AXLES, _TRACK, _WHEEL = (-1.22, 1.3), 0.74, 0.34
_ACROSS = (0.0, 1.0, 0.0)

# along the car: x, middle's height, half-width, half-height of the lower body
_HULL = (
    (-2.0, 0.64, 0.66, 0.17),
    (-1.93, 0.64, 0.77, 0.25),
    (-1.5, 0.62, 0.83, 0.3),
    (-0.6, 0.61, 0.85, 0.32),
    (0.5, 0.6, 0.85, 0.32),
    (1.2, 0.58, 0.83, 0.29),
    (1.8, 0.54, 0.77, 0.23),
    (2.02, 0.52, 0.64, 0.14),
)
# the cabin: x, half-width and height of the roof's middle line above the body
_CABIN = (
    (-1.75, 0.6, 0.02),
    (-1.35, 0.64, 0.26),
    (-0.85, 0.66, 0.5),
    (-0.2, 0.66, 0.57),
    (0.3, 0.65, 0.52),
    (0.75, 0.64, 0.28),
    (1.15, 0.6, 0.02),
)


def car(triangles: int) -> Mesh:
    """4.3 long, 1.9 wide and 1.45 high on z = 0, its front towards +x: within 4 % of so many triangles."""
    return fitted(_parts, triangles, FULL).mesh("car")


def _parts(level: Level) -> Builder:
    builder = Builder()
    yellow, dark, chrome = painted("car body", "#f2c21a"), painted("trim", "#26282c"), painted("chrome", "#b9bec4")
    hull = smooth_curve(_HULL, level(40, 9))
    x, z = hull[:, 0], hull[:, 1]
    builder.add(capped(np.stack([x, 0 * x, z], 1), hull[:, 2:], level(40, 12), _ACROSS, 4.5), yellow)
    _add_cabin(builder, level, yellow)
    arch = turned([(0.0, -0.05), (0.4, -0.05), None, (0.4, 0.05), None, (0.0, 0.05)], level, 8, 40)
    builder.add(_wheels(arch, _TRACK + 0.05, 0.09), dark)
    tire = turned(
        [(0.0, -0.1), (0.2, -0.1), None, (0.31, -0.11), (_WHEEL, -0.07), (_WHEEL, 0.07), (0.31, 0.11), None]
        + [(0.2, 0.1), None, (0.0, 0.1)],
        *(level, 26, 44),
    )
    builder.add(_wheels(tire, _TRACK + 0.06), painted("rubber", "#1d1d1f"))
    hub = turned([(0.0, 0.08), (0.19, 0.08), None, (0.19, 0.115), None, (0.07, 0.13), (0.0, 0.14)], level, 10, 32)
    builder.add(_wheels(hub, _TRACK + 0.06), chrome)
    for front, place, height in ((-1.0, -2.08, 0.47), (1.0, 2.09, 0.4)):
        bend = [(place - 0.16 * front, -0.78), (place, -0.6), (place + 0.04 * front, 0.0), (place, 0.6)]
        bar = smooth_curve([(*p, height) for p in (*bend, (place - 0.16 * front, 0.78))], level(24, 7))
        builder.add(capped(bar, np.full((len(bar), 2), (0.05, 0.085)), level(14, 8), (0.0, 0.0, 1.0), 4.0), dark)
        holders = boxes(
            [(min(place, place - 0.3 * front), y - 0.05, height - 0.05) for y in (-0.45, 0.45)],
            [(max(place, place - 0.3 * front), y + 0.05, height + 0.05) for y in (-0.45, 0.45)],
        )
        builder.add(holders, dark)
    lamp = ellipsoid((0, 0, 0), (0.07, 0.15, 0.085), level(10, 6), level(20, 8))
    builder.add(copies(lamp, placements([(1.97, y, 0.6) for y in (-0.47, 0.47)])), painted("head lamp", "#f4efd9"))
    builder.add(copies(lamp, placements([(-1.97, y, 0.72) for y in (-0.52, 0.52)])), painted("tail lamp", "#c2281f"))
    mirror = ellipsoid((0, 0, 0), (0.07, 0.12, 0.08), level(8, 6), level(16, 8))
    builder.add(copies(mirror, placements([(0.62, y, 0.99) for y in (-0.83, 0.83)])), yellow)
    return builder


def _add_cabin(builder: Builder, level: Level, yellow) -> None:
    """Glass all round with a roof, posts and a rear deck in the body's color on it."""
    base = 0.84
    rows = smooth_curve(_CABIN, level(36, 9))
    x, wide, high = rows.T
    middle = np.stack([x, 0 * x, base - 0.05 + 0.5 * high], axis=1)
    glass = capped(middle, np.stack([wide, 0.5 * high + 0.05], axis=1), level(32, 12), _ACROSS, 3.0)
    builder.add(glass, painted("pane", "#27343f"))
    # A roof a little above the glass: the same surface cut off at the sides of the car.
    inner = (x > -0.98) & (x < 0.42)
    roof = np.stack([x, 0 * x, base + high - 0.045], axis=1)[inner]
    builder.add(
        capped(roof, np.stack([0.84 * wide, 0 * wide + 0.06], axis=1)[inner], level(24, 10), _ACROSS, 3.5), yellow
    )
    for start, end in (((-1.6, 0.57, 0.88), (-0.86, 0.53, 1.31)), ((1.02, 0.57, 0.88), (0.3, 0.53, 1.3))):
        for side in (-1.0, 1.0):
            knots = np.array([start, end]) * (1.0, side, 1.0)
            middle = 0.5 * (knots[0] + knots[1]) + (0.0, 0.02 * side, 0.02)
            post = smooth_curve([knots[0], middle, knots[1]], level(10, 4))
            builder.add(capped(post, np.full((len(post), 2), (0.05, 0.035)), level(10, 6), _ACROSS), yellow)


def _wheels(part: MeshPart, track: float, lift: float = 0.0) -> MeshPart:
    """The part, which is turned about z, at the four wheels or above them; its upper side outwards."""
    found = []
    for x in _AXLES:
        for side in (-1.0, 1.0):
            matrix = np.array(
                [(1.0, 0, 0, x), (0, 0, side, side * track), (0, -side, 0, _WHEEL + lift), (0, 0, 0, 1.0)]
            )
            found.append(copies(part, matrix))
    return join(found)
