"""The numbers of a graph camera from its root and portals, once for NumPy and for arrays that JAX traces.

Across the plane pi = (n, o) of a portal with the center C behind it and P before it, the affine map
H = 1 + (P - C) pi / (pi . C) leaves the plane as it is and takes C to P: rays of the frustum behind become those before
it, straight on. The maps on the way to the root one after the other unbend a point's ray.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.graph_portals import Portal, end_planes
from mpcam.cameras.graph_tree import Tree, owner
from mpcam.cameras.pinhole import Pinhole
from mpcam.math import Array, library


class Numbers(NamedTuple):
    """All frusta of a tree in the root's frame, K of them; rows for the root, which has no face, stand for z = 0.

    faces (K, 4): entry faces (n, o), n . x + o > 0 behind. centers (K, 3). corners (K, n, 3): of the faces, the last
    one repeated. unbend (K, 3, 4): maps into the root's frustum. images (K, n, 3): (a, b, c) of the edges of an image,
    positive inside. pool (Q, 4): planes with n . x + o <= 0 inside. bounds: of each frustum the rows of the pool
    that bound it, first those in which it ends, of which there are `ends`.
    """

    faces: Array
    centers: Array
    corners: Array
    unbend: Array
    images: Array
    pool: Array
    bounds: list[list[int]]
    ends: list[int]

    def planes(self, number: int) -> Array:
        """All planes of a frustum."""
        return self.pool[np.array(self.bounds[number])]

    def exits(self, number: int) -> Array:
        """The planes in which a frustum ends."""
        return self.planes(number)[: self.ends[number]]


def numbers_of(root: Pinhole, portals: Sequence[Portal], ends: Any, tree: Tree) -> Numbers:
    """Numbers of every frustum of the tree."""
    given = [root.camera_from_world, ends, *(p for one in portals for p in (one.polygon, one.center, one.ends))]
    xp = np
    if library(*given) == "jax":
        import jax.numpy as xp  # pyright: ignore[reportAssignmentType]
    x: Any = xp
    shapes = _Shapes([len(portal.polygon) for portal in portals])
    turn, shift = (x.asarray(root.camera_from_world)[:3, part] for part in (slice(3), 3))
    owners = [owner(portals, number) for number in range(len(portals))]
    corners, centers = x.zeros((0, shapes.most, 3)), x.zeros((0, 3))
    if portals:
        padded = [x.asarray(portal.polygon)[rows] for portal, rows in zip(portals, shapes.padded, strict=True)]
        corners = x.stack(padded) @ turn.T + shift
        centers = x.stack([x.asarray(portals[number].center) for number in owners]) @ turn.T + shift
    faces, corners, sides = _faces(x, corners, centers, shapes)
    limits, rows = _limits(x, turn, shift, [ends, *(portal.ends for portal in portals)])
    # Node by node: what the portals have, and the root before them.
    entered, parents = np.array(tree.portals[1:], int), np.array(tree.parents[1:], int)
    faces = x.concatenate([x.asarray([[0.0, 0.0, 1.0, 0.0]]), faces[entered]])
    centers = x.concatenate([x.zeros((1, 3)), centers[entered]])
    corners = x.concatenate([x.zeros((1, shapes.most, 3)), corners[entered]])
    way = centers[parents] - centers[1:]
    share = way / _at(faces[1:], centers[1:])[:, None]
    unbend = x.eye(3, 4)[None]
    for level in range(1, tree.depth + 1):  # parents come first
        some = np.array([number for number, at in enumerate(tree.levels) if at == level])
        before = unbend[parents[some - 1]]
        bent = before + (before[:, :, :3] @ share[some - 1][:, :, None]) * faces[some][:, None, :]
        unbend = x.concatenate([unbend, bent])
    straight = corners[1:] @ x.swapaxes(unbend[parents][:, :, :3], 1, 2) + unbend[parents][:, None, :, 3]
    images = x.concatenate(
        [x.zeros((1, shapes.most, 3)) + x.asarray([0.0, 0.0, 1.0]), _edges(x, straight, entered, shapes)]
    )
    # The pool: faces, faces turned, limits, and sides portal by portal; then sides of frusta that merge.
    count, own = len(tree.parents), len(portals) * shapes.most
    pool, bounds, lasts = [faces, -faces, limits, sides.reshape(own, 4)], [], []
    size = 2 * count + len(limits) + own
    fanned: list[list[int]] = [[]]
    for number in range(1, count):
        first = 2 * count + len(limits) + shapes.most * tree.portals[number]
        mine = [first + side for side in range(shapes.counts[tree.portals[number]])]
        if _merged(tree, tree.parents[number]):
            before = x.concatenate(pool)[np.array(fanned[tree.parents[number]])]
            pulled = before + (before[:, :3] @ share[number - 1])[:, None] * faces[number]
            pool.append(_unit_rows(x, pulled))
            mine += range(size, size + len(before))
            size += len(before)
        fanned.append(mine)
    for number in range(count):
        exits = [*tree.children(number), *(2 * count + row for row in rows[tree.owners[number] + 1])]
        bounds.append([*exits, count + number, *fanned[number]])
        lasts.append(len(exits))
    return Numbers(faces, centers, corners, unbend, images, x.concatenate(pool), bounds, lasts)


class _Shapes:
    """Polygons of any number of corners in one table: the last corner is repeated, and so is the last edge."""

    def __init__(self, counts: list[int]):
        self.counts, self.most = counts, max([3, *counts])
        self.padded = [np.minimum(np.arange(self.most), count - 1) for count in counts]
        self.weights = np.array([(np.arange(self.most) < n) / n for n in counts]).reshape(-1, self.most, 1)
        starts = [np.minimum(np.arange(self.most), count - 1) for count in counts]
        self.starts = np.array(starts, int).reshape(-1, self.most)
        self.after = np.array([(s + 1) % n for s, n in zip(starts, counts, strict=True)], int).reshape(-1, self.most)

    def edges(self, corners: Array, which: Any = slice(None)) -> tuple[Array, Array]:
        """Both ends of all edges of some polygons (N, n, 3)."""
        row = np.arange(len(corners))[:, None]
        return corners[row, self.starts[which]], corners[row, self.after[which]]

    def middles(self, corners: Array, which: Any = slice(None)) -> Array:
        """(N, 3) means of the corners."""
        return (corners * self.weights[which]).sum(1)


def _faces(x: Any, corners: Array, centers: Array, shapes: _Shapes) -> tuple[Array, Array, Array]:
    """Planes of polygons, turned away from their centers; corners in them; and planes through center and sides."""
    middles = shapes.middles(corners)
    a, b = shapes.edges(corners - corners[:, :1])
    normals = x.sum(x.cross(a, b) * (shapes.weights > 0) * _first(shapes), 1)
    normals = normals / x.sqrt((normals * normals).sum(-1, keepdims=True))
    faces = x.concatenate([normals, -(normals * middles).sum(-1, keepdims=True)], -1)
    faces = x.where(_at(faces, centers)[:, None] > 0, -faces, faces)
    corners = corners - _at(faces[:, None], corners)[..., None] * faces[:, None, :3]
    a, b = shapes.edges(corners)
    normals = x.cross(a - centers[:, None], b - centers[:, None])
    normals = normals / x.sqrt((normals * normals).sum(-1, keepdims=True))
    sides = x.concatenate([normals, -(normals * centers[:, None]).sum(-1, keepdims=True)], -1)
    return faces, corners, x.where(_at(sides, middles[:, None])[..., None] > 0, -sides, sides)


def _first(shapes: _Shapes) -> np.ndarray:
    """(P, n, 1) whether an edge is there for the first time."""
    return (np.arange(shapes.most)[None, :, None] < np.array(shapes.counts, int).reshape(-1, 1, 1)) * 1.0


def _edges(x: Any, straight: Array, entered: np.ndarray, shapes: _Shapes) -> Array:
    """Lines through the edges of unbent faces (N, n, 3), seen from the root, positive inside."""
    a, b = shapes.edges(straight, entered)
    lines = x.cross(a, b)
    lines = lines / x.sqrt((lines * lines).sum(-1, keepdims=True))
    inside = (lines * shapes.middles(straight, entered)[:, None]).sum(-1, keepdims=True)
    return x.where(inside < 0, -lines, lines)


def _limits(x: Any, turn: Array, shift: Array, given: list[Any]) -> tuple[Array, list[list[int]]]:
    """Planes of all ends in the root's frame, and the rows of each."""
    rows, found = [], []
    for ends in given:
        planes = end_planes(x, ends)
        rows.append(list(range(len(found), len(found) + len(planes))))
        found += planes
    if not found:
        return x.zeros((0, 4)), rows
    planes = x.stack(found)
    normals = planes[:, :3] @ turn.T
    return _unit_rows(x, x.concatenate([normals, (planes[:, 3] - normals @ shift)[:, None]], 1)), rows


def _merged(tree: Tree, node: int) -> bool:
    """Whether a frustum is one of several ways into it, or lies behind such: its own sides do not say all of it."""
    return node > 0 and tree.owners.count(tree.owners[node]) > 1


def image_sides(root: Pinhole) -> np.ndarray:
    """(4, 4) planes through the sides of the root's image, in its frame."""
    left, right = -root.cx / root.fx, (root.width - root.cx) / root.fx
    top, bottom = -root.cy / root.fy, (root.height - root.cy) / root.fy
    rows = [(-1.0, 0.0, left, 0.0), (1.0, 0.0, -right, 0.0), (0.0, -1.0, top, 0.0), (0.0, 1.0, -bottom, 0.0)]
    return _unit_rows(np, np.array(rows))


def _unit_rows(x: Any, planes: Array) -> Array:
    return planes / x.sqrt((planes[:, :3] ** 2).sum(-1, keepdims=True))


def _at(planes: Array, points: Array) -> Array:
    """n . x + o of planes (..., 4) and points (..., 3)."""
    return (planes[..., :3] * points).sum(-1) + planes[..., 3]
