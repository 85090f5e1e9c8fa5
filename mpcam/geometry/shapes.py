"""Building blocks of the procedural scenes: NumPy in, triangles out, with normals and texture coordinates.

Every block winds counter-clockwise seen from outside, has no triangle without area, and makes many copies at once.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mpcam.geometry.mesh import Material, Mesh


@dataclass(frozen=True, eq=False)
class MeshPart:
    """A piece of surface. vertices (V, 3), faces (F, 3), normals (V, 3) unit, uv (V, 2); colors (V, 3) or None."""

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    uv: np.ndarray
    colors: np.ndarray | None = None

    @property
    def count(self) -> int:
        return len(self.faces)


class Builder:
    """Collects parts with their materials and joins them once."""

    def __init__(self) -> None:
        self.parts: list[tuple[MeshPart, Material]] = []

    def add(self, part: MeshPart, material: Material) -> None:
        self.parts.append((part, material))

    @property
    def count(self) -> int:
        return sum(part.count for part, _ in self.parts)

    def mesh(self, name: str) -> Mesh:
        return to_mesh(self.parts, name)


def to_mesh(parts: list[tuple[MeshPart, Material]], name: str) -> Mesh:
    """One Mesh of all parts; materials that are the same object become one."""
    materials: dict[int, tuple[int, Material]] = {}
    numbers = [materials.setdefault(id(material), (len(materials), material))[0] for _, material in parts]
    whole = join([part for part, _ in parts])
    return Mesh(
        whole.vertices,
        whole.faces,
        normals=whole.normals,
        uv=whole.uv,
        colors=whole.colors,
        materials=tuple(material for _, material in materials.values()),
        face_material=np.repeat(np.array(numbers, np.int32), [part.count for part, _ in parts]),
        name=name,
    )


def join(parts: list[MeshPart]) -> MeshPart:
    """Several parts as one."""
    starts = np.cumsum([0] + [len(part.vertices) for part in parts])
    colors = None
    if any(part.colors is not None for part in parts):
        colors = np.concatenate([np.ones_like(p.vertices) if p.colors is None else p.colors for p in parts])
    return MeshPart(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.uv for part in parts]),
        colors,
    )


def copies(part: MeshPart, matrices, colors=None) -> MeshPart:
    """The part once per 4x4 matrix (N, 4, 4); matrices must not mirror. colors: (N, 3) tint of each copy, or None."""
    matrices = np.asarray(matrices, dtype=np.float64).reshape(-1, 4, 4)
    linear = matrices[:, :3, :3]
    vertices = part.vertices @ linear.transpose(0, 2, 1) + matrices[:, None, :3, 3]
    cofactor = np.cross(linear[:, [1, 2, 0]], linear[:, [2, 0, 1]])
    normals = unit(part.normals @ cofactor.transpose(0, 2, 1))
    count, size = len(matrices), len(part.vertices)
    faces = part.faces[None] + (np.arange(count) * size)[:, None, None]
    tint = part.colors
    if colors is not None:
        tint = np.repeat(np.asarray(colors, dtype=np.float64), size, axis=0)
    elif tint is not None:
        tint = np.tile(tint, (count, 1))
    return MeshPart(
        vertices.reshape(-1, 3), faces.reshape(-1, 3), normals.reshape(-1, 3), np.tile(part.uv, (count, 1)), tint
    )


def moved(part: MeshPart, offset=(0.0, 0.0, 0.0), turn: float = 0.0, scale: float = 1.0) -> MeshPart:
    """The part scaled, turned about z by an angle in radians, then moved."""
    return copies(part, placements([offset], [turn], [scale]))


def placements(offsets, turns: ArrayLike = 0.0, scales: ArrayLike = 1.0) -> np.ndarray:
    """(N, 4, 4) matrices: scale, turn about z (radians), move to the offsets (N, 3)."""
    offsets = np.asarray(offsets, dtype=np.float64)
    turns = np.broadcast_to(np.asarray(turns, dtype=np.float64), len(offsets))
    scales = np.broadcast_to(np.asarray(scales, dtype=np.float64), len(offsets))
    matrices = np.zeros((len(offsets), 4, 4))
    matrices[:, 0, 0] = matrices[:, 1, 1] = scales * np.cos(turns)
    matrices[:, 1, 0] = scales * np.sin(turns)
    matrices[:, 0, 1] = -matrices[:, 1, 0]
    matrices[:, 2, 2] = scales
    matrices[:, :3, 3] = offsets
    matrices[:, 3, 3] = 1.0
    return matrices


def quads(corners, uv=None) -> MeshPart:
    """Flat quadrilaterals. corners: (N, 4, 3), counter-clockwise. uv: (N, 4, 2) or (4, 2), default 0 to 1 on each."""
    corners = np.asarray(corners, dtype=np.float64).reshape(-1, 4, 3)
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64) if uv is None else np.asarray(uv, np.float64)
    normals = unit(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    faces = np.array([[0, 1, 2], [0, 2, 3]]) + 4 * np.arange(len(corners))[:, None, None]
    return MeshPart(
        corners.reshape(-1, 3),
        faces.reshape(-1, 3),
        np.repeat(normals, 4, axis=0),
        np.broadcast_to(uv, (len(corners), 4, 2)).reshape(-1, 2),
    )


# corner numbers (bits x y z) of the six sides, counter-clockwise from outside, and the axes that uv runs along
_SIDES = {
    "x": ((2, 0, 4, 6), (1, 2)),
    "X": ((1, 3, 7, 5), (1, 2)),
    "y": ((0, 1, 5, 4), (0, 2)),
    "Y": ((3, 2, 6, 7), (0, 2)),
    "z": ((2, 3, 1, 0), (0, 1)),
    "Z": ((4, 5, 7, 6), (0, 1)),
}


def boxes(low, high, sides: str = "xXyYzZ") -> MeshPart:
    """Boxes with edges along the axes. low, high: (N, 3). sides: which faces to make, small letter = towards minus.

    uv is in scene units along the face.
    """
    low, high = np.atleast_2d(np.asarray(low, np.float64)), np.atleast_2d(np.asarray(high, np.float64))
    bits = np.array([[(c >> axis) & 1 for axis in range(3)] for c in range(8)], dtype=bool)
    corners = np.where(bits, high[:, None], low[:, None])
    chosen = np.concatenate([corners[:, None, list(_SIDES[side][0])] for side in sides], axis=1).reshape(-1, 4, 3)
    axes = np.tile(np.array([_SIDES[side][1] for side in sides]), (len(low), 1))
    return quads(chosen, np.take_along_axis(chosen, axes[:, None, :], axis=2))


def surface(points, uv=None, normals=None, closed: bool = False) -> MeshPart:
    """A grid of points (R, C, 3) as a surface; outside is where columns x rows point.

    closed: the last column repeats the first. uv: (R, C, 2), default 0 to 1 along columns and rows. normals: (R, C, 3),
    default those of the grid, smooth. At poles (rows whose points are all one) triangles without area are left out.
    """
    points = np.array(points, dtype=np.float64)
    rows, columns = points.shape[:2]
    if closed:
        points[:, -1] = points[:, 0]
    if normals is None:
        normals = _grid_normals(points, closed)
    if uv is None:
        v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
        uv = np.stack([u, v], axis=2)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2).reshape(-1, 3)
    vertices = points.reshape(-1, 3)
    corners = vertices[faces]
    same = [(corners[:, k] == corners[:, (k + 1) % 3]).all(axis=1) for k in range(3)]
    faces = faces[~(same[0] | same[1] | same[2])]
    return MeshPart(
        vertices, faces, np.asarray(normals, np.float64).reshape(-1, 3), np.asarray(uv, np.float64).reshape(-1, 2)
    )


def _grid_normals(points: np.ndarray, closed: bool) -> np.ndarray:
    along = np.gradient(points, axis=1)
    if closed:
        along[:, 0] = along[:, -1] = (points[:, 1] - points[:, -2]) / 2
    normals = np.cross(along, np.gradient(points, axis=0))
    for row, inner, way in ((0, 1, 1.0), (-1, -2, -1.0)):
        if (points[row] == points[row, 0]).all():
            # a pole: the normal of the fan of triangles around it
            ring = points[inner]
            normals[row] = np.cross(np.diff(ring, axis=0), way * (ring[:-1] - points[row, 0])).sum(axis=0)
    return unit(normals)


def lathe(profile, segments: int, smooth: bool = True, flute: float = 0.0, uv_scale=(1.0, 1.0)) -> MeshPart:
    """A surface of revolution about z. profile: (K, 2) radius and height, from the bottom up on the outside.

    smooth: rounded along the profile; otherwise every piece of the profile has an edge at both ends.
    flute: every other corner is drawn in by this part of the radius, and facets are flat (segments must be even).
    """
    profile = np.asarray(profile, dtype=np.float64)
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring[-1] = ring[0]
    if flute:
        ring *= np.where(np.arange(segments + 1) % 2 == 1, 1 - flute, 1.0)[:, None]
    strips = [profile] if smooth else [profile[k : k + 2] for k in range(len(profile) - 1)]
    parts = []
    for strip in strips:
        radius, height = (
            strip[:, 0, None, None],
            np.broadcast_to(strip[:, 1, None, None], (len(strip), segments + 1, 1)),
        )
        points = np.concatenate([radius * ring, height], axis=2)
        u, v = np.meshgrid(angle / (2 * np.pi) * uv_scale[0], strip[:, 1] * uv_scale[1])
        if flute:
            cells = [
                np.stack([g[:-1, :-1], g[:-1, 1:], g[1:, 1:], g[1:, :-1]], axis=2) for g in (points, np.dstack([u, v]))
            ]
            parts.append(quads(cells[0].reshape(-1, 4, 3), cells[1].reshape(-1, 4, 2)))
            continue
        tangent = np.gradient(strip, axis=0)
        flank, rise = (
            np.broadcast_to(tangent[:, None, 1:], u.shape + (1,)),
            np.broadcast_to(tangent[:, None, :1], u.shape + (1,)),
        )
        normals = unit(np.concatenate([flank * ring, -rise], axis=2))
        parts.append(surface(points, np.stack([u, v], axis=2), normals, closed=True))
    return join(parts)


def loft(centers, radii, segments: int, across=(1.0, 0.0, 0.0), power: float = 2.0, ripple=None) -> MeshPart:
    """A tube along centers (R, 3) with elliptic cross-sections.

    radii: (R,) or (R, 2), the half-widths along `across` and at right angles to it. power: 2 is an ellipse, more is
    squarer. ripple: (R, segments + 1) factors on the radius, or None. A radius of 0 at an end closes the tube there.
    """
    centers = np.asarray(centers, dtype=np.float64)
    radii = np.asarray(radii, dtype=np.float64)
    radii = np.stack([radii, radii], axis=1) if radii.ndim == 1 else radii
    forward = unit(np.gradient(centers, axis=0))
    across = np.broadcast_to(np.asarray(across, dtype=np.float64), centers.shape)
    side = unit(across - (across * forward).sum(axis=1, keepdims=True) * forward)
    up = np.cross(forward, side)
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    cosine, sine = np.cos(angle), np.sin(angle)
    stretch = (np.abs(cosine) ** power + np.abs(sine) ** power) ** (-1 / power)
    stretch = np.broadcast_to(stretch, (len(centers), segments + 1)) * (1.0 if ripple is None else ripple)
    points = (
        centers[:, None]
        + (radii[:, :1] * stretch * cosine)[:, :, None] * side[:, None]
        + (radii[:, 1:] * stretch * sine)[:, :, None] * up[:, None]
    )
    for row in (0, -1):
        if not radii[row].any():
            points[row] = centers[row]
    return surface(points, closed=True)


def ellipsoid(center, radii, rows: int, segments: int) -> MeshPart:
    """A closed ellipsoid; poles on z."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.cos(angle)
    ring[[0, -1]] = 0.0
    sphere = np.stack(
        [
            ring[:, None] * np.cos(turn),
            ring[:, None] * np.sin(turn),
            np.repeat(np.sin(angle)[:, None], segments + 1, 1),
        ],
        axis=2,
    )
    radii = np.asarray(radii, dtype=np.float64)
    return surface(np.asarray(center) + sphere * radii, normals=unit(sphere / radii), closed=True)


def smooth_curve(knots, count: int) -> np.ndarray:
    """(count, D) points on the Catmull-Rom curve through the knots (K, D), evenly spaced in its parameter."""
    knots = np.asarray(knots, dtype=np.float64)
    padded = np.concatenate([2 * knots[:1] - knots[1:2], knots, 2 * knots[-1:] - knots[-2:-1]])
    place = np.linspace(0, len(knots) - 1, count)
    piece = np.minimum(place.astype(int), len(knots) - 2)
    t = (place - piece)[:, None]
    a, b, c, d = (padded[piece + k] for k in range(4))
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors scaled to length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
