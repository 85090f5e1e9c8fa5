"""The Temple scene: a roofed hall of fluted columns, each made of many long thin triangles.

Stands in for the scene of that name in Gascuel et al. 2008, section 5.1 (4,000 triangles, their worst overdraw).
"""

import numpy as np

from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, MeshPart, boxes, copies, join, lathe, placements, quads
from mpcam.geometry.textures import painted, plaster, roof_tiles, textured, tiles

_HEIGHT = 6.0  # of the columns
_GAP = 3.75  # between columns
_CEILING = 7.0
_OPEN = (9.4, 2.4)  # half the size of the opening in the roof, x and y
_EDGE = (16.4, 8.9)  # half the size of the roof
_SLOPE = 0.24


def temple(triangles: int) -> Mesh:
    """The hall along x, floor at z = 0, eye in the middle. triangles: 2,200 to 100,000; met to within 8."""
    builder = Builder()
    _ground(builder)
    _roof(builder)
    _altar(builder)
    spots = _column_spots()
    # a column of s sides has 4 s + 12 triangles, s even; some get two sides more, to come near the target
    steps = max(round((triangles - builder.count - 12 * len(spots)) / 8), 3 * len(spots))
    sides, extra = divmod(steps, len(spots))
    marble = textured("marble", plaster("#e9e0cd", 41, contrast=0.05))
    for group, count in ((spots[:extra], 2 * sides + 2), (spots[extra:], 2 * sides)):
        if len(group):
            builder.add(copies(_column(count), placements(group)), marble)
    return builder.mesh("temple")


def _column_spots() -> np.ndarray:
    """(N, 3) feet of the columns, those near the middle first: one ring, and two rows inside."""
    x, y = _GAP * np.arange(-4, 5), _GAP * np.arange(-1, 2)
    ring = [(a, side * 2 * _GAP) for a in x for side in (-1, 1)] + [(side * 4 * _GAP, b) for b in y for side in (-1, 1)]
    rows = [(a, side * 3.2) for a in x[1:-1] for side in (-1, 1)]
    spots = np.array([(a, b, 0.0) for a, b in ring + rows])
    return spots[np.argsort(np.hypot(spots[:, 0], spots[:, 1]), kind="stable")]


def _column(sides: int) -> MeshPart:
    """A fluted shaft, each facet from foot to top in two triangles; a round capital; a square slab."""
    shaft = lathe([(0.46, 0.0), (0.37, _HEIGHT - 0.4)], sides, flute=0.09, uv_scale=(1.0, 0.3))
    capital = lathe([(0.31, _HEIGHT - 0.45), (0.6, _HEIGHT - 0.2)], sides, uv_scale=(1.0, 0.3))
    slab = boxes((-0.62, -0.62, _HEIGHT - 0.2), (0.62, 0.62, _HEIGHT))
    return join([shaft, capital, slab])


def _ground(builder: Builder) -> None:
    """Floor, three steps, a meadow with cypresses, and hills at the horizon."""
    stone = painted("step", "#cfc5b0")
    floor = textured("floor", tiles(["#d9cfbb", "#b9a98e"], "#8d8372", 42))
    corners = np.array([(-16.4, -8.9, 0), (16.4, -8.9, 0), (16.4, 8.9, 0), (-16.4, 8.9, 0)])
    builder.add(quads(corners, corners[:, :2] / 4.0), floor)
    for k in range(3):
        x, y, z = 16.4 + 0.4 * k, 8.9 + 0.4 * k, -0.3 * k
        builder.add(boxes((-x, -y, z - 0.3), (x, y, z), "xXyY" + ("Z" if k else "")), stone)
    grass = textured("grass", plaster("#7d9a4d", 43, contrast=0.14))
    corners = np.array([(-80, -80, -0.9), (80, -80, -0.9), (80, 80, -0.9), (-80, 80, -0.9)])
    builder.add(quads(corners, corners[:, :2] / 6.0), grass)
    angle = np.linspace(0, 2 * np.pi, 33)
    foot = 74 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    top = 5.5 + 3 * np.sin(3 * angle) + 2 * np.sin(7 * angle + 1)
    low, high = np.insert(foot, 2, -0.9, axis=1), np.concatenate([foot * 1.05, top[:, None]], axis=1)
    hills = quads(np.stack([low[1:], low[:-1], high[:-1], high[1:]], axis=1))
    builder.add(hills, painted("hills", "#6f8a6a"))
    cypress = lathe([(0.0, 0.2), (0.9, 1.3), (0.0, 8.0)], 8)
    around = np.arange(14) * 2 * np.pi / 14 + 0.2
    spots = np.stack([27 * np.cos(around), 20 * np.sin(around), np.full(14, -0.9)], axis=1)
    sizes = 1 + 0.25 * np.sin(5 * around)
    builder.add(
        copies(cypress, placements(spots, around, sizes)), textured("cypress", plaster("#38562f", 44, contrast=0.2))
    )


def _roof(builder: Builder) -> None:
    """Beams on the columns, a ceiling with an opening, and two slopes with gables above."""
    stone = textured("beam", plaster("#ddd2bb", 45, contrast=0.04))
    h, c = _HEIGHT, _CEILING
    beams = [((-15.6, side * 7.5 - 0.5, h), (15.6, side * 7.5 + 0.5, c)) for side in (-1, 1)]
    beams += [((side * 15.0 - 0.5, -7.0, h), (side * 15.0 + 0.5, 7.0, c)) for side in (-1, 1)]
    beams += [((-11.9, side * 3.2 - 0.5, h), (11.9, side * 3.2 + 0.5, c)) for side in (-1, 1)]
    low, high = np.array(beams).transpose(1, 0, 2)
    builder.add(boxes(low, high, "xXyYz"), stone)
    cross = [
        ((x - 0.18, side * 5.35 - 1.65, h + 0.45), (x + 0.18, side * 5.35 + 1.65, c))
        for x in _GAP * np.arange(-3, 4)
        for side in (-1, 1)
    ]
    low, high = np.array(cross).transpose(1, 0, 2)
    builder.add(boxes(low, high, "xXz"), painted("cross beam", "#a9744a"))
    (ox, oy), (ex, ey) = _OPEN, _EDGE
    coffer = textured("coffers", tiles(["#a8452f", "#3d5f86"], "#d9b45c", 46))
    for x0, y0, x1, y1 in ((-ex, oy, ex, ey), (-ex, -ey, ex, -oy), (-ex, -oy, -ox, oy), (ox, -oy, ex, oy)):
        corners = np.array([(x0, y1, c), (x1, y1, c), (x1, y0, c), (x0, y0, c)])
        builder.add(quads(corners, corners[:, :2] / 3.0), coffer)
    # outside: eaves, slopes up to the opening, the ridge at both ends, gables
    builder.add(boxes((-ex, -ey, c), (ex, ey, c + 0.35), "xXyY"), stone)
    eaves = c + 0.35
    rim, ridge = eaves + _SLOPE * (ey - oy), eaves + _SLOPE * ey
    clay = textured("roof", roof_tiles("#b96a45", 47))
    for s in (-1, 1):
        slope = np.array(
            [(-s * -ex, s * ey, eaves), (-s * ex, s * ey, eaves), (-s * ex, s * oy, rim), (s * ex, s * oy, rim)]
        )
        builder.add(quads(slope, slope[:, :2] / 2.0), clay)
        for x0, x1 in ((-ex, -ox), (ox, ex)):
            a, b = (x1, x0) if s > 0 else (x0, x1)
            top = np.array([(a, s * oy, rim), (b, s * oy, rim), (b, 0, ridge), (a, 0, ridge)])
            builder.add(quads(top, top[:, :2] / 2.0), clay)
        # walls of the light well: along x, then its ends, which reach up to the ridge
        a, b = (s * ox, s * oy), (-s * ox, s * oy)
        well = [[(*b, c), (*a, c), (*a, rim), (*b, rim)]]
        a, b = (s * ox, -s * oy), (s * ox, s * oy)
        well += [[(*b, c), (*a, c), (*a, rim), (*b, rim)]]
        builder.add(quads(well), stone)
        for x, facing in ((s * ox, -s), (s * ex, s)):
            width, foot = (oy, rim) if x == s * ox else (ey, eaves)
            points = np.array([(x, -facing * width, foot), (x, facing * width, foot), (x, 0, ridge)])
            normal = np.tile((float(facing), 0.0, 0.0), (3, 1))
            builder.add(MeshPart(points, np.array([[0, 1, 2]]), normal, points[:, 1:] / 2.0), stone)


def _altar(builder: Builder) -> None:
    """A stepped altar with a bronze fire bowl before the eye, and another behind."""
    stone, bronze = painted("altar", "#c4b79c"), painted("bronze", "#8a6a35")
    ember = painted("ember", "#ff8a30")
    bowl = lathe([(0.12, 0.0), (0.08, 0.5), (0.45, 0.85), (0.4, 0.85), (0.0, 0.7)], 10, smooth=False)
    flame = lathe([(0.0, 0.66), (0.22, 0.85), (0.12, 1.15), (0.0, 1.45)], 8)
    for x in (-7.0, 7.0):
        low = [(x - 1.1, -1.1, 0.0), (x - 0.7, -0.7, 0.25)]
        high = [(x + 1.1, 1.1, 0.25), (x + 0.7, 0.7, 1.0)]
        builder.add(boxes(low, high, "xXyYZ"), stone)
        builder.add(copies(bowl, placements([(x, 0.0, 1.0)])), bronze)
        builder.add(copies(flame, placements([(x, 0.0, 1.0)])), ember)
