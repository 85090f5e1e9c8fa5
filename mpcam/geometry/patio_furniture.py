"""The furniture of the Patio scene: tables with their sets, chairs, sofas, lanterns, rugs, and a fountain."""

import numpy as np

from mpcam.geometry.levels import Level
from mpcam.geometry.shapes import (
    Builder,
    MeshPart,
    boxes,
    copies,
    ellipsoid,
    join,
    lathe,
    loft,
    placements,
    smooth_curve,
)
from mpcam.geometry.textures import painted, planks, textured, tiles

# middle of each table with its chairs
_SETS = [(2.6, -3.3), (-2.6, 3.6), (-3.2, -3.4), (2.4, 3.7), (-6.6, 0.4)]


def add_furniture(builder: Builder, level: Level) -> None:
    _tables(builder, level)
    _chairs(builder, level)
    _sofas(builder, level)
    _lanterns(builder, level)
    _fountain(builder, level)
    rug = textured("rug", tiles(["#8f2f2a", "#c9973f", "#2f4a5f"], "#e3d2a8", 71, count=6))
    for x, y in ((6.9, -5.2), (6.9, 5.2), (-7.4, -5.2)):
        builder.add(boxes((x - 1.6, y - 0.9, 0), (x + 1.6, y + 0.9, 0.015), "xXyYZ"), rug)


def _curved(profile, level: Level, full: int, segments: int) -> MeshPart:
    """A lathe with a rounded profile; None in the profile is a sharp edge. full: points along all of it."""
    cuts = [k for k, point in enumerate(profile) if point is None]
    pieces = [profile[a + 1 : b] for a, b in zip([-1, *cuts], [*cuts, len(profile)], strict=True)]
    pieces = [[*before[-1:], *piece] for before, piece in zip([[], *pieces], pieces, strict=False)]
    parts = []
    for piece in pieces:
        points = smooth_curve(piece, level(full * len(piece) / len(profile), len(piece)))
        # the curve may swing past the axis between its knots
        points[:, 0] = np.where(points[:, 0] <= 0.003, 0.003, points[:, 0])
        for end, knot in ((0, piece[0]), (-1, piece[-1])):
            points[end] = knot
        parts.append(lathe(points, level(segments, 6)))
    return join(parts)


def _tables(builder: Builder, level: Level) -> None:
    """Round tables on a turned foot, with plates, cups and a jug."""
    wood, white = textured("table wood", planks("#8b5a34", 72)), painted("china", "#f1efe8")
    blue = painted("jug", "#3566a0")
    foot = _curved(
        [(0.3, 0.0), (0.28, 0.04), (0.08, 0.12), (0.06, 0.3), (0.1, 0.42), (0.05, 0.6), (0.12, 0.7)], level, 24, 24
    )
    top = lathe(
        [(0.0, 0.7), (0.58, 0.7), (0.62, 0.72), (0.62, 0.74), (0.6, 0.75), (0.0, 0.75)], level(48, 8), smooth=False
    )
    spots = placements([(x, y, 0.0) for x, y in _SETS])
    builder.add(copies(foot, spots), wood)
    builder.add(copies(top, spots), wood)
    plate = _curved([(0.07, 0.0), (0.12, 0.012), (0.13, 0.02), None, (0.11, 0.014), (0.0, 0.01)], level, 10, 28)
    cup = _curved(
        [(0.02, 0.0), (0.035, 0.02), (0.04, 0.07), None, (0.036, 0.07), None, (0.03, 0.025), (0.0, 0.01)], level, 14, 20
    )
    jug = _curved(
        [
            (0.06, 0.0),
            (0.1, 0.08),
            (0.08, 0.18),
            (0.04, 0.24),
            (0.055, 0.3),
            None,
            (0.045, 0.3),
            None,
            (0.03, 0.22),
            (0.0, 0.2),
        ],
        level,
        26,
        26,
    )
    angles = np.pi / 4 + np.pi / 2 * np.arange(4)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(4)], axis=1)
    plates = np.concatenate([np.array((x, y, 0.752)) + 0.4 * ring for x, y in _SETS])
    turned = np.stack([np.cos(angles + 0.5), np.sin(angles + 0.5), np.zeros(4)], axis=1)
    cups = np.concatenate([np.array((x, y, 0.752)) + 0.42 * turned for x, y in _SETS])
    builder.add(copies(plate, placements(plates)), white)
    builder.add(copies(cup, placements(cups)), white)
    builder.add(copies(jug, placements([(x + 0.05, y, 0.752) for x, y in _SETS])), blue)


def _chairs(builder: Builder, level: Level) -> None:
    """Four turned chairs with a cushion around each table."""
    leg = [(0.018, 0.0), (0.022, 0.05), (0.016, 0.12), (0.026, 0.25), (0.018, 0.36), (0.024, 0.44)]
    parts = [
        copies(_curved(leg, level, 12, 10), placements([(a * 0.18, b * 0.17, 0.0) for a in (-1, 1) for b in (-1, 1)]))
    ]
    seat = boxes((-0.22, -0.21, 0.44), (0.22, 0.21, 0.47))
    lines, around = level(8, 4), level(8, 4)
    for k in range(5):
        x = 0.075 * (k - 2)
        bow = smooth_curve([(x, 0.19, 0.47), (1.05 * x, 0.205, 0.7), (1.15 * x, 0.25, 0.93)], lines)
        parts.append(loft(bow, np.where(np.arange(lines) < lines - 1, 0.011, 0.0), around))
    rail = smooth_curve(
        [(-0.23, 0.22, 0.9), (-0.12, 0.25, 0.945), (0.0, 0.255, 0.96), (0.12, 0.25, 0.945), (0.23, 0.22, 0.9)],
        level(20, 9),
    )
    widths = np.full((len(rail), 2), (0.022, 0.03))
    widths[[0, -1]] = 0.0
    parts.append(loft(rail, widths, level(14, 6), across=(0.0, 1.0, 0.0)))
    cushion = ellipsoid((0, -0.01, 0.49), (0.21, 0.2, 0.045), level(16, 5), level(32, 8))
    wood = painted("chair", "#5f3a22")
    spots, turns = [], []
    for number, (x, y) in enumerate(_SETS):
        for k in range(4):
            angle = np.pi / 4 + np.pi / 2 * k
            spots.append((x + 0.85 * np.cos(angle), y + 0.85 * np.sin(angle), 0.0))
            turns.append(angle - np.pi / 2 + 0.25 * np.sin(5 * k + 3 * number))
    matrices = placements(spots, turns)
    builder.add(copies(join([*parts, seat]), matrices), wood)
    builder.add(copies(cushion, matrices), painted("cushion", "#c2483a"))


def _pillow(center, size, level: Level, power: float = 5.0) -> MeshPart:
    """A box with rounded edges and bulging sides: a superellipsoid."""
    rows, columns = level(20, 6), level(40, 12)
    angle, turn = np.linspace(-np.pi / 2, np.pi / 2, rows + 1), np.linspace(0, 2 * np.pi, columns + 1)
    ring = np.cos(angle)
    ring[[0, -1]] = 0.0
    sphere = np.stack(
        [ring[:, None] * np.cos(turn), ring[:, None] * np.sin(turn), np.repeat(np.sin(angle)[:, None], columns + 1, 1)],
        axis=2,
    )
    length = (np.abs(sphere) ** power).sum(axis=2, keepdims=True) ** (-1 / power)
    points = sphere * length
    normals = np.sign(points) * np.abs(points) ** (power - 1) / np.asarray(size)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    ball = ellipsoid((0, 0, 0), (1, 1, 1), rows, columns)
    vertices = (np.asarray(center) + points * np.asarray(size)).reshape(-1, 3)
    vertices = vertices.reshape(rows + 1, columns + 1, 3)
    vertices[:, -1] = vertices[:, 0]
    return MeshPart(vertices.reshape(-1, 3), ball.faces, normals.reshape(-1, 3), ball.uv)


def _sofas(builder: Builder, level: Level) -> None:
    """Sofas against the walls under the gallery."""
    body = [_pillow((0, 0.0, 0.22), (1.0, 0.42, 0.2), level), _pillow((0, 0.36, 0.52), (1.0, 0.13, 0.36), level)]
    body += [_pillow((s * 0.98, 0.0, 0.38), (0.12, 0.44, 0.26), level) for s in (-1, 1)]
    seats = join([_pillow((s * 0.43, -0.05, 0.48), (0.42, 0.36, 0.09), level) for s in (-1, 1)])
    small = join([_pillow((s * 0.62, 0.16, 0.72), (0.2, 0.09, 0.19), level, 3.0) for s in (-1, 1)])
    spots = placements(
        [(-4.8, 8.35, 0.02), (4.8, 8.35, 0.02), (-4.8, -8.35, 0.02), (4.8, -8.35, 0.02)], [0, 0, np.pi, np.pi]
    )
    builder.add(copies(join(body), spots), painted("sofa", "#4a6f6a"))
    builder.add(copies(seats, spots), painted("sofa seat", "#6f9a8c"))
    builder.add(copies(small, spots), painted("pillow", "#e0a93f"))


def _lanterns(builder: Builder, level: Level) -> None:
    """Glass lanterns on rods, below the gallery and the rafters."""
    metal, glass = painted("lantern metal", "#3a3128"), painted("lantern glass", "#ffe3a0")
    globe = _curved([(0.05, -0.3), (0.14, -0.24), (0.17, -0.1), (0.13, 0.04), (0.06, 0.1)], level, 18, 28)
    caps = join(
        [
            _curved([(0.0, -0.36), (0.03, -0.34), (0.06, -0.3), None, (0.0, -0.3)], level, 8, 20),
            lathe([(0.0, 0.09), (0.08, 0.09), (0.08, 0.12), (0.0, 0.2)], level(20, 6), smooth=False),
        ]
    )
    ribs = []
    count = level(6, 4)
    for k in range(count):
        angle = 2 * np.pi * k / count
        bow = smooth_curve([(0.04, -0.315), (0.15, -0.25), (0.18, -0.1), (0.14, 0.05), (0.05, 0.12)], level(12, 6))
        path = np.stack([bow[:, 0] * np.cos(angle), bow[:, 0] * np.sin(angle), bow[:, 1]], axis=1)
        ribs.append(loft(path, np.full(len(path), 0.007), level(5, 3), across=(-np.sin(angle), np.cos(angle), 0.0)))
    hanging = [(x, s * 7.7, 2.6, 0.7) for x in (-8.2, -3.5, 3.5, 8.2) for s in (-1, 1)] + [
        (s * 10.7, 0.0, 2.6, 0.7) for s in (-1, 1)
    ]
    hanging += [(x, y, 4.9, 2.2) for x in (-3.6, 0.0, 3.6) for y in (-2.0, 2.0)]
    spots = placements([(x, y, z) for x, y, z, _ in hanging])
    builder.add(copies(globe, spots), glass)
    builder.add(copies(join([caps, *ribs]), spots), metal)
    rods = np.array([(x, y, z + 0.18, z + 0.1 + rod) for x, y, z, rod in hanging])
    builder.add(boxes(rods[:, :3] - (0.008, 0.008, 0), rods[:, [0, 1, 3]] + (0.008, 0.008, 0), "xXyY"), metal)


def _fountain(builder: Builder, level: Level) -> None:
    """A basin with two bowls, and its water."""
    stone, water = painted("fountain", "#cfc3ab"), painted("water", "#5fa3b5")
    around = level(64, 12)
    basin = lathe(
        [(1.5, 0.0), (1.5, 0.1), (1.42, 0.14), (1.42, 0.45), (1.5, 0.5), (1.5, 0.58), (1.3, 0.58), (1.3, 0.1)],
        around,
        smooth=False,
    )
    stem = _curved([(0.3, 0.1), (0.28, 0.4), (0.12, 0.55), (0.1, 0.9), (0.16, 1.0), (0.1, 1.05)], level, 30, 40)
    bowl = _curved(
        [(0.1, 0.98), (0.45, 1.08), (0.75, 1.25), None, (0.74, 1.28), None, (0.4, 1.14), (0.1, 1.1)], level, 30, 64
    )
    upper = _curved(
        [
            (0.09, 1.05),
            (0.07, 1.4),
            (0.12, 1.55),
            (0.3, 1.65),
            (0.4, 1.76),
            None,
            (0.38, 1.78),
            None,
            (0.2, 1.68),
            (0.0, 1.66),
        ],
        level,
        40,
        48,
    )
    tip = _curved([(0.05, 1.64), (0.04, 1.8), (0.09, 1.9), (0.05, 2.0), (0.0, 2.05)], level, 24, 24)
    spot = placements([(5.2, 0.0, 0.0)])
    builder.add(copies(join([basin, stem, bowl, upper, tip]), spot), stone)
    pools = [
        lathe([(1.3, 0.42), (0.0, 0.42)], around),
        lathe([(0.68, 1.235), (0.0, 1.235)], around),
        lathe([(0.33, 1.74), (0.0, 1.74)], around),
    ]
    builder.add(copies(join(pools), spot), water)
