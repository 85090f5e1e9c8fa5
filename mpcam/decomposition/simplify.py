"""Coarse meshes for camera triangles: edge collapses that keep positions and normals (Garland and Heckbert 1998).

A vertex is a point of six numbers, its position and its weighted normal; the quadrics then measure how far a flat
triangle with interpolated normals is from the surface in both, which is what bends its rays. Collapses go in rounds of
edges that do not touch each other, cheapest first.
"""

import numpy as np
from scipy.sparse import csr_array

BORDER = 30.0
"""Weight of distances from the border of an open mesh, against those from its faces."""
_ROUNDS = ((0.2, 0.2), (1.0, 0.2), (1.0, 0.02))
"""Part of the edges, the cheapest, that a round chooses from, and the smallest cosine between a triangle before and
after a collapse, and between it and its vertices' normals; the next pair where no collapse is left."""
_OUTLINE = 0.15
"""How far a collapse may shift the border of an open mesh on average, in units of the vertices."""
_EARLY = 0.5
"""Part of the edges where many times the triangles wanted are left."""


def simplify(
    vertices: np.ndarray,
    normals: np.ndarray,
    faces: np.ndarray,
    triangles: int,
    weights: np.ndarray | None = None,
    bend: float = 1.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (V, 3), normals (V, 3; of any length) and faces (F, 3) of a mesh with at most so many triangles.

    More are left where every collapse would fold the surface, change its topology, or cut off what it covers. weights:
    (F,) of the faces' errors, or None. bend: what a difference of 1 between unit normals counts as, in units of the
    vertices, which should fill a ball of radius 1.
    """
    places = np.concatenate([vertices, bend * normals], axis=1).astype(np.float64)
    rims = _rims(places, faces)
    quadrics = _quadrics(places, faces, np.ones(len(faces)) if weights is None else weights, rims)
    effort, random = 0, np.random.default_rng(0)
    while len(faces) > triangles:
        edges, sides = _edges(faces)
        border = np.zeros(len(places), bool)
        border[edges[sides != 2]] = True
        target, cost = _targets(places, quadrics, rims, edges, sides, border)
        allowed, (share, turn) = int(np.isfinite(cost).sum()), _ROUNDS[effort]
        share = max(share, _EARLY) if len(faces) > 8 * triangles else share
        chosen = np.argsort(cost, kind="stable")[: max(int(share * allowed), min(32, allowed))]
        # Costs that rise steadily along the surface would leave one edge of a whole row: shaken, they leave many.
        chosen = chosen[np.argsort(cost[chosen] * random.uniform(0.5, 2.0, len(chosen)))]
        chosen = chosen[_possible(places, faces, edges[chosen], sides[chosen], target[chosen], turn)]
        chosen = chosen[_apart(len(places), edges, edges[chosen])]
        if len(chosen) == 0:
            effort += 1
            if effort == len(_ROUNDS):
                break
            continue
        effort = 0
        chosen = chosen[np.argsort(cost[chosen], kind="stable")]
        chosen = chosen[: int(np.searchsorted(np.cumsum(sides[chosen]), len(faces) - triangles)) + 1]
        keep, drop = edges[chosen].T
        places[keep] = target[chosen]
        quadrics[keep] += quadrics[drop]
        rims[keep] += rims[drop]
        number = np.arange(len(places))
        number[drop] = keep
        faces = number[faces]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        used, faces = np.unique(faces, return_inverse=True)
        places, quadrics, rims, faces = places[used], quadrics[used], rims[used], faces.reshape(-1, 3)
    return places[:, :3], places[:, 3:] / bend, faces


def _quadrics(places: np.ndarray, faces: np.ndarray, weights: np.ndarray, rims: np.ndarray) -> np.ndarray:
    """(V, 7, 7) squared distances from the planes of each vertex's faces, and from the lines of its border edges."""
    result = np.zeros((len(places), 7, 7))
    a, b, c = (places[faces[:, i]] for i in range(3))
    first, length = _unit(b - a)
    second, height = _unit(c - a - ((c - a) * first).sum(1, keepdims=True) * first)
    area = 0.5 * length[:, 0] * height[:, 0]
    flat = _distance(a, [first, second]) * (weights * area / 3)[:, None, None]
    for i in range(3):
        np.add.at(result, faces[:, i], flat)
    # Of the position alone: the outline must be kept before what the normals ask for.
    kept = np.array([0, 1, 2, 6])
    result[:, kept[:, None], kept] += BORDER * rims
    return result


def _rims(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 4, 4) squared distances from the lines of each vertex's border edges, times the edges' squared lengths."""
    result = np.zeros((len(places), 4, 4))
    edges, sides = _edges(faces)
    ends = edges[sides == 1]
    start = places[ends[:, 0], :3]
    along, length = _unit(places[ends[:, 1], :3] - start)
    line = _distance(start, [along]) * (length**2)[:, :, None]
    for i in range(2):
        np.add.at(result, ends[:, i], line)
    return result


def _distance(point: np.ndarray, axes: list[np.ndarray]) -> np.ndarray:
    """(N, D + 1, D + 1) squared distances from the flats through points (N, D) along orthonormal axes (N, D)."""
    size = point.shape[1]
    across = np.eye(size) - sum(axis[:, :, None] * axis[:, None] for axis in axes)
    shift = -np.einsum("nij,nj->ni", across, point)
    result = np.zeros((len(point), size + 1, size + 1))
    result[:, :size, :size], result[:, :size, size], result[:, size, :size] = across, shift, shift
    result[:, size, size] = -(shift * point).sum(axis=1)
    return result


def _unit(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0), length


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (E, 2), smaller number first, and how many faces each has (E,)."""
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    count = int(faces.max()) + 1
    keys, sides = np.unique(ends[:, 0] * count + ends[:, 1], return_counts=True)
    return np.stack([keys // count, keys % count], axis=1), sides


def _targets(
    places: np.ndarray,
    quadrics: np.ndarray,
    rims: np.ndarray,
    edges: np.ndarray,
    sides: np.ndarray,
    border: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Where each edge would collapse to (E, 6), and at what cost (E,), infinite where it must not."""
    a, b = edges.T
    whole = quadrics[a] + quadrics[b]
    square, shift = whole[:, :6, :6], whole[:, :6, 6]
    middle = 0.5 * (places[a] + places[b])
    # Held to the middle of the edge where the quadric says nothing, as along a flat mirror.
    held = square + (1e-4 * np.trace(square, axis1=1, axis2=2)[:, None, None] + 1e-30) * np.eye(6)
    slope = np.einsum("eij,ej->ei", square, middle) + shift
    target = middle - np.linalg.solve(held, slope[..., None])[..., 0]
    only_a, only_b = border[a] & ~border[b], border[b] & ~border[a]
    target = np.where(only_a[:, None], places[a], np.where(only_b[:, None], places[b], target))
    full = np.concatenate([target, np.ones((len(target), 1))], axis=1)
    cost = np.maximum(np.einsum("ei,eij,ej->e", full, whole, full), 0.0)
    # Short edges first among those that cost nothing.
    cost = cost + 1e-12 * np.trace(square, axis1=1, axis2=2) * ((places[a] - places[b]) ** 2).sum(axis=1)
    pinched = (border[a] & border[b] & (sides == 2)) | (sides > 2)
    rim = rims[a] + rims[b]
    full = np.concatenate([target[:, :3], np.ones((len(target), 1))], axis=1)
    away, weight = np.einsum("ei,eij,ej->e", full, rim, full), 0.5 * np.trace(rim[:, :3, :3], axis1=1, axis2=2)
    return target, np.where(pinched | (away > _OUTLINE**2 * weight), np.inf, cost)


def _possible(
    places: np.ndarray, faces: np.ndarray, edges: np.ndarray, sides: np.ndarray, target: np.ndarray, turn: float
) -> np.ndarray:
    """Which edges (E, 2) can collapse to targets (E, 6) with the topology kept and no triangle turned over."""
    count = len(places)
    if len(edges) == 0:
        return np.zeros(0, bool)
    ends = faces[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2)
    near = csr_array((np.ones(len(ends)), ends.T), (count, count))
    near.data[:] = 1.0
    near.sum_duplicates()
    near.data[:] = 1.0
    a, b = edges.T
    common = np.asarray((near[a].multiply(near[b])).sum(axis=1)).ravel()
    fine = common == sides
    # Faces around either end, edge by edge.
    order = np.argsort(faces.ravel(), kind="stable")
    start = np.searchsorted(faces.ravel()[order], np.arange(count + 1))
    lengths = np.stack([start[a + 1] - start[a], start[b + 1] - start[b]], axis=1).ravel()
    owner = np.repeat(np.repeat(np.arange(len(edges)), 2), lengths)
    first = np.repeat(np.stack([start[a], start[b]], axis=1).ravel(), lengths)
    offset = np.arange(len(first)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    face = order[first + offset] // 3
    moved = (faces[face] == a[owner, None]) | (faces[face] == b[owner, None])
    stays = moved.sum(axis=1) == 1
    owner, face, moved = owner[stays], face[stays], moved[stays]
    before = places[faces[face]]
    after = np.where(moved[..., None], target[owner, None], before)
    old, new = (_unit(np.cross(t[:, 1, :3] - t[:, 0, :3], t[:, 2, :3] - t[:, 0, :3])) for t in (before, after))
    looks = after[..., 3:] / np.maximum(np.linalg.norm(after[..., 3:], axis=-1, keepdims=True), 1e-300)
    upright = (new[0][:, None] * looks).sum(-1).min(axis=1) > turn
    good = ((old[0] * new[0]).sum(axis=1) > turn) & upright
    fine[owner[~good]] = False
    return fine


def _apart(count: int, edges: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Which of the chosen edges, best first, touch no better one, nor a neighbor of one."""
    rank = np.full(count, len(chosen))
    np.minimum.at(rank, chosen.ravel(), np.repeat(np.arange(len(chosen)), 2))
    around = rank.copy()
    np.minimum.at(around, edges[:, 0], rank[edges[:, 1]])
    np.minimum.at(around, edges[:, 1], rank[edges[:, 0]])
    return np.flatnonzero((around[chosen] == np.arange(len(chosen))[:, None]).all(axis=1))
