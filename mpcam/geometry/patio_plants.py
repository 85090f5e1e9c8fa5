"""The plants of the Patio scene: pots, trunks, and as many leaves as the number of triangles asks for."""

import numpy as np

from mpcam.geometry.levels import Level
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, MeshPart, copies, lathe, loft, placements, smooth_curve, unit
from mpcam.geometry.textures import painted, plaster, rgb, textured

_TREES = [(8.1, -2.9), (8.1, 2.9), (-8.1, -3.6), (-8.1, 3.6)]
_PALMS = [(5.4, -5.4), (5.4, 5.4), (-5.4, -5.6), (-5.4, 5.6), (0.0, -5.6), (0.0, 5.6)]
_SHRUBS = [(x, s * 8.4) for x in (-10.9, -9.3, -1.1, 1.1, 9.3, 10.9) for s in (-1, 1)] + [
    (s * 11.4, y) for y in (-2.2, 2.2) for s in (-1, 1)
]
_VINES = [(x, s * 6.4) for x in (-7.5, -4.7, -1.2, 2.4, 5.9, 8.2) for s in (-1, 1)] + [
    (s * 9.4, y) for y in (-4.0, 0.6, 4.4) for s in (-1, 1)
]


def add_plants(builder: Builder, level: Level, triangles: int) -> None:
    """Pots and stems, then leaves until the whole scene has about that number of triangles."""
    rng = np.random.default_rng(560)
    _pots(builder, level)
    _trunks(builder, level)
    leaf = _leaf()
    total = max(round((triangles - builder.count) / leaf.count), 64)
    blade = textured("leaf", plaster("#ffffff", 81, size=32, contrast=0.08))
    shares = np.array([0.28, 0.2, 0.2, 0.32])
    counts = np.floor(shares * total).astype(int)
    counts[0] += total - counts.sum()
    frames = [_crowns(rng, counts[0]), _fronds(rng, counts[1]), _bushes(rng, counts[2]), _hanging(rng, counts[3])]
    greens = ["#5f8f3a", "#3f8a45", "#6f9a4a", "#4a7a35"]
    matrices, colors = [], []
    for (place, forward, up, size), green in zip(frames, greens, strict=True):
        matrices.append(_frames(place, forward, up, size))
        tone = np.array(rgb(green)) * rng.uniform(0.65, 1.3, (len(place), 1)) * rng.uniform(0.9, 1.1, (len(place), 3))
        colors.append(tone)
    # every third vine is all flowers; on the shrubs there are some
    for group, code, every in ((3, "#c03a86", 3), (2, "#e8d24a", 11)):
        colors[group][::every] = np.array(rgb(code)) * rng.uniform(0.8, 1.15, (len(colors[group][::every]), 1))
    builder.add(copies(leaf, np.concatenate(matrices), np.concatenate(colors)), blade)


def _leaf() -> MeshPart:
    """A thin closed leaf of 16 triangles, 1 long along y from the origin, its upper side towards z."""
    points, faces = [], []
    for rise in (0.035, -0.02):
        start = len(points)
        points.append((0.0, 0.0, 0.0))
        for y, half, height in ((0.3, 0.2, 0.05), (0.7, 0.16, 0.02)):
            points += [(half, y, height), (0.0, y, height + rise), (-half, y, height)]
        points.append((0.0, 1.0, -0.12))
        side = [(0, 1, 2), (0, 2, 3), (1, 4, 2), (2, 4, 5), (2, 5, 3), (3, 5, 6), (4, 7, 5), (5, 7, 6)]
        # the lower side is the upper one turned over
        faces += [[start + k for k in (face if rise > 0 else face[::-1])] for face in side]
    vertices, index = np.array(points), np.array(faces)
    return MeshPart(vertices, index, Mesh(vertices, index).smooth_normals(), vertices[:, :2] + (0.5, 0.0))


def _frames(place, forward, up, size) -> np.ndarray:
    """(N, 4, 4) matrices that put y along forward, z near up, scaled and moved."""
    forward = unit(forward)
    right = unit(np.cross(forward, up))
    matrices = np.zeros((len(place), 4, 4))
    size = np.broadcast_to(size, len(place))[:, None]
    matrices[:, :3, 0], matrices[:, :3, 1] = right * size, forward * size
    matrices[:, :3, 2] = np.cross(right, forward) * size
    matrices[:, :3, 3] = place
    matrices[:, 3, 3] = 1.0
    return matrices


def _dealt(count: int, places) -> np.ndarray:
    """(count, 2) the places in turn, each as often as the others."""
    return np.array(places)[np.arange(count) % len(places)]


def _sphere(rng, count: int) -> np.ndarray:
    return unit(rng.standard_normal((count, 3)))


def _crowns(rng, count: int):
    """Leaves on the clustered crowns of the trees, drooping outwards."""
    trunk = _dealt(count, _TREES)
    cluster = _sphere(np.random.default_rng(7), 14) * (0.75, 0.75, 0.5)
    center = cluster[rng.integers(len(cluster), size=count)]
    way = _sphere(rng, count)
    offset = center + way * 0.5 * rng.uniform(0.6, 1.0, (count, 1))
    place = np.concatenate([trunk, np.full((count, 1), 3.0)], axis=1) + offset
    forward = way + 0.5 * _sphere(rng, count) - (0, 0, 0.4)
    return place, forward, unit(offset) + (0.02, 0.01, 0.6), rng.uniform(0.11, 0.19, count)


def _fronds(rng, count: int):
    """Leaflets on both sides of the arching fronds of the palms."""
    palm = _dealt(count, _PALMS)
    frond = rng.integers(18, size=count)
    bearing = frond * 2.399963 + palm[:, 0]
    steep = 0.5 + 1.0 * (frond / 18)
    t = rng.uniform(0.12, 1.0, count)
    reach = 1.15 * t
    outward = np.stack([np.cos(bearing), np.sin(bearing), np.zeros(count)], axis=1)
    rise = reach * steep * 1.3 - 1.1 * reach**2 * (0.6 + 0.4 * steep)
    place = np.insert(palm, 2, 0.75, axis=1) + outward * reach[:, None]
    place[:, 2] += rise
    slope = steep * 1.3 - 2.2 * reach * (0.6 + 0.4 * steep)
    along = unit(outward + slope[:, None] * np.array((0.0, 0.0, 1.0)))
    side = np.cross(along, (0.0, 0.0, 1.0)) * np.where(rng.random(count) < 0.5, 1.0, -1.0)[:, None]
    up = np.cross(np.cross(along, (0.0, 0.0, 1.0)), along)
    return (
        place,
        side + 0.7 * along - (0, 0, 0.25),
        up + (0.01, 0.0, 0.02),
        0.3 * np.sin(np.pi * (0.15 + 0.8 * t)) + 0.04,
    )


def _bushes(rng, count: int):
    """Leaves of the round shrubs along the walls."""
    shrub = _dealt(count, _SHRUBS)
    way = _sphere(rng, count)
    way[:, 2] = np.abs(way[:, 2]) * 1.2 - 0.2
    offset = way * (0.42, 0.42, 0.6) * rng.uniform(0.55, 1.0, (count, 1))
    place = np.insert(shrub, 2, 0.85, axis=1) + offset
    return (
        place,
        way + 0.5 * _sphere(rng, count) + (0, 0, 0.3),
        unit(offset) + (0.01, 0.02, 0.5),
        rng.uniform(0.08, 0.15, count),
    )


def _hanging(rng, count: int):
    """Leaves of the vines that hang from the gallery and climb its columns."""
    vine = _dealt(count, _VINES)
    strand = rng.integers(9, size=count)
    along_x = np.abs(np.abs(vine[:, 1]) - 6.4) < 1e-9
    drop = rng.uniform(0.0, 1.0, count) ** 1.3 * (0.8 + 0.16 * (strand % 5))
    sway = 0.16 * (strand - 4) + 0.06 * np.sin(5 * drop + strand)
    inward = -np.sign(np.where(along_x, vine[:, 1], vine[:, 0]))
    depth = inward * (0.4 + 0.05 * np.sin(7 * drop + 2 * strand))
    step = np.where(along_x[:, None], np.stack([sway, depth], axis=1), np.stack([depth, sway], axis=1))
    place = np.concatenate([vine + step, (4.45 - 1.45 * drop)[:, None]], axis=1) + 0.04 * _sphere(rng, count)
    out = np.where(along_x[:, None], np.stack([0 * inward, inward], axis=1), np.stack([inward, 0 * inward], axis=1))
    out = np.insert(out, 2, 0.0, axis=1)
    return (
        place,
        0.5 * out + 0.7 * _sphere(rng, count) - (0, 0, 0.6),
        out + (0.02, 0.03, 0.4),
        rng.uniform(0.07, 0.13, count),
    )


def _pots(builder: Builder, level: Level) -> None:
    """A clay pot with earth under each plant, larger ones for trees."""
    profile = [(0.2, 0.0), (0.24, 0.1), (0.3, 0.3), (0.31, 0.42), (0.35, 0.44), (0.35, 0.5), (0.3, 0.5), (0.28, 0.44)]
    pot = lathe(smooth_curve(profile, level(16, 8)), level(24, 8))
    earth = lathe([(0.29, 0.45), (0.0, 0.47)], level(24, 6))
    spots = [(x, y, 0.0) for x, y in _TREES + _PALMS + _SHRUBS]
    sizes = [1.7] * len(_TREES) + [1.25] * len(_PALMS) + [0.95] * len(_SHRUBS)
    matrices = placements(spots, 0.0, sizes)
    builder.add(copies(pot, matrices), textured("pot", plaster("#b5623e", 82, size=64)))
    builder.add(copies(earth, matrices), painted("earth", "#4a3626"))


def _trunks(builder: Builder, level: Level) -> None:
    """Bent trunks with branches for the trees, short stems for the others."""
    bark = textured("bark", plaster("#6f5238", 83, size=64, contrast=0.2))
    lines, around = level(14, 8), level(12, 5)
    paths = [([(0, 0, 0.6), (0.06, 0.02, 1.4), (-0.03, 0.05, 2.2), (0.0, 0.0, 3.0)], 0.085, 0.04)]
    for k in range(6):
        angle = k * 2.4
        tip = (0.75 * np.cos(angle), 0.75 * np.sin(angle), 2.9 + 0.12 * k)
        paths.append(([(0.0, 0.02, 1.9 + 0.1 * k), (0.4 * tip[0], 0.4 * tip[1], 2.5 + 0.08 * k), tip], 0.035, 0.012))
    for knots, thick, thin in paths:
        widths = np.linspace(thick, thin, lines)
        widths[-1] = 0.0
        branch = loft(smooth_curve(knots, lines), widths, around)
        builder.add(copies(branch, placements([(x, y, 0.0) for x, y in _TREES])), bark)
    widths = np.linspace(0.05, 0.02, lines)
    widths[-1] = 0.0
    stem = loft(smooth_curve([(0, 0, 0.4), (0.02, 0, 0.6), (0, 0, 0.9)], lines), widths, around)
    builder.add(copies(stem, placements([(x, y, 0.0) for x, y in _PALMS + _SHRUBS])), bark)
