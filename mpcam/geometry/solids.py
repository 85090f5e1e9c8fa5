"""Closed solids, whose every edge has a face on either side: turned profiles with sharp rims, tubes with flat ends.

`shapes` has the open surfaces that they are made of.
"""

from collections.abc import Sequence

import numpy as np

from mpcam.geometry.levels import Level
from mpcam.geometry.shapes import MeshPart, join, lathe, loft, smooth_curve, unit

Knot = tuple[float, float]


def turned(profile: Sequence[Knot | None], level: Level, full: int, segments: int) -> MeshPart:
    """A turned solid about z: knots (radius, height) from the bottom up, smooth between, None where an edge is sharp.

    It is closed if the profile starts and ends on the axis, or ends where it started. full: pieces along the whole
    profile; segments: around it.
    """
    cuts = [k for k, knot in enumerate(profile) if knot is None]
    ends = zip([-1, *cuts], [*cuts, len(profile)], strict=True)
    pieces = [[knot for knot in profile[first + 1 : last] if knot is not None] for first, last in ends]
    pieces = [[*before[-1:], *piece] for before, piece in zip([[], *pieces], pieces, strict=False)]
    lengths = np.array([np.linalg.norm(np.diff(piece, axis=0), axis=1).sum() for piece in pieces])
    around, parts = level(segments, 8), []
    for piece, share in zip(pieces, lengths / lengths.sum(), strict=True):
        points = smooth_curve(piece, level(full * share, len(piece) - 1) + 1)
        points[:, 0] = np.maximum(points[:, 0], 0.0)  # the curve may swing past the axis between its knots
        points[[0, -1]] = piece[0], piece[-1]
        parts.append(lathe(points, around))
    return join(parts)


def capped(centers, radii, segments: int, across=(1.0, 0.0, 0.0), power: float = 2.0) -> MeshPart:
    """A `loft` closed by a flat piece at either end; no radius may be 0."""
    centers = np.asarray(centers, np.float64)
    tube = loft(centers, radii, segments, across, power)
    rings = tube.vertices.reshape(len(centers), segments + 1, 3)
    first = _disc(rings[0, ::-1], centers[0], unit(centers[0] - centers[1]))
    last = _disc(rings[-1], centers[-1], unit(centers[-1] - centers[-2]))
    return join([tube, first, last])


def tapered(knots, radii, rows: int, segments: int, across=(1.0, 0.0, 0.0), power: float = 2.0) -> MeshPart:
    """A closed limb along the smooth curve through knots (K, 3), round at its ends.

    radii: (K,) or (K, 2) half-widths at the knots, as in `loft`; those of the ends are how thick they are before they
    are rounded off.
    """
    radii = np.asarray(radii, np.float64)
    radii = np.stack([radii, radii], axis=1) if radii.ndim == 1 else radii
    whole = smooth_curve(np.concatenate([np.asarray(knots, np.float64), radii], axis=1), 16 * len(radii))
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(whole[:, :3], axis=0), axis=1))])
    # Rows by angle where it is round, so that the caps have some, and evenly between.
    ends = np.minimum(whole[[0, -1], 3:].min(axis=1), 0.3 * length[-1])
    cap = max(rows // 6, 2)
    angle = np.linspace(0, np.pi / 2, cap + 1)
    middle = np.linspace(ends[0], length[-1] - ends[1], max(rows - 2 * cap, 2) + 1)
    place = np.concatenate(
        [ends[0] * (1 - np.cos(angle)), middle[1:-1], length[-1] - ends[1] * (1 - np.cos(angle[::-1]))]
    )
    table = np.stack([np.interp(place, length, whole[:, column]) for column in range(5)], axis=1)
    round_off = np.ones(len(place))
    round_off[: cap + 1], round_off[-cap - 1 :] = np.sin(angle), np.sin(angle[::-1])
    return loft(table[:, :3], np.maximum(table[:, 3:], 1e-6) * round_off[:, None], segments, across, power)


def _disc(ring: np.ndarray, middle: np.ndarray, normal: np.ndarray) -> MeshPart:
    """Triangles from the middle to a ring (S + 1, 3), whose last point is its first, counter-clockwise."""
    count = len(ring) - 1
    vertices = np.concatenate([ring[:-1], middle[None]])
    k = np.arange(count)
    faces = np.stack([np.full(count, count), k, (k + 1) % count], axis=1)
    turn = 2 * np.pi * k / count
    uv = 0.5 + 0.5 * np.concatenate([np.stack([np.cos(turn), np.sin(turn)], 1), np.zeros((1, 2))])
    return MeshPart(vertices, faces, np.broadcast_to(normal, vertices.shape).copy(), uv)
