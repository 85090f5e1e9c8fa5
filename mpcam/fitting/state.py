"""Camera triangles and true rays as the arrays that a fit works on: in radii from the center, shapes padded."""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.triangle_nodes import sides
from mpcam.decomposition.crossing import FAR, NEAR, crossing
from mpcam.decomposition.ray_error import bent, vertex_normals
from mpcam.decomposition.reflector import Reflector
from mpcam.decomposition.shooting import Locator, Place, neighbors
from mpcam.decomposition.views import SeenPoints
from mpcam.fitting.blocks import Mesh
from mpcam.fitting.rays import LEAST, Eye, Kind, Sample

_LEAST_COSINE = 0.1
SMALLEST = 32, 48, 1536
"""Nodes, faces and samples at least, by padding: small fits are all of one size."""
_SHARES = np.array([0.2, 0.8])
"""Of the cost at the start: the near plane's, and the far one's."""


class State(NamedTuple):
    """Everything that a fit needs, as NumPy arrays: nodes (V, 6), face and place of each sample, and what is fixed.

    real: how many of the nodes, faces and samples are none of the padding.
    """

    nodes: np.ndarray
    face: np.ndarray
    place: np.ndarray
    mesh: Mesh
    samples: Sample
    eye: Eye
    kind: Kind
    real: tuple[int, int, int]


def padded(count: int) -> int:
    """The next of 16, 24, 32, 48, 64, 96 ...: fits of like size share what was compiled."""
    size = 16
    while size < count:
        size = size * 3 // 2 if size & (size - 1) == 0 else size * 4 // 3
    return size


def state_of(
    cams: CameraTriangles, reflector: Reflector, view: SeenPoints, most: int, found: Place | None = None
) -> State:
    """The state at camera triangles in the world, beside points that their eye sees.

    found: where the points lie in the camera triangles, if that is known. most: samples at most, taken from triangles
    that have many: the small ones keep theirs, and none is fitted by a few. Weights make up for that. Scales make the
    cost 1 where camera triangles are now, if they are not exact.
    """
    scale, center = reflector.radius or 1.0, reflector.center
    values = cams.normals if cams.normals is not None else cams.directions
    if cams.directions is not None and cams.ray_scale == "unit":
        values = values / np.linalg.norm(values, axis=1, keepdims=True)
    kind = Kind(cams.nodes, cams.kind)
    ties = vertex_normals(cams, reflector)
    ties = ties / np.linalg.norm(ties, axis=1, keepdims=True)
    true, passes = bent(view.points - view.eye, view.normals, cams.index)
    if found is None:
        found = Locator(cams.vertices, ties, cams.faces).locate(view.points, view.normals)
    going = np.flatnonzero(passes)
    chosen, weights = thinned(found.face[going], len(cams.faces), most)
    rows = going[chosen]
    face, points, true = found.face[rows], view.points[rows], true[rows]
    place = np.stack([found.second[rows], found.third[rows], np.zeros(len(rows))], axis=1)
    vertices, points = (cams.vertices - center) / scale, (points - center) / scale
    origin, along, _ = cams.ray_at(face, place[:, 0], place[:, 1])
    origin = (origin - center[:, None]) / scale
    met = [crossing(origin, along, points.T, true.T, distance, LEAST) for distance in (NEAR, FAR)]
    scales = [np.sqrt((weights * (one.miss**2).sum(axis=0)).sum()) for one in met]
    helper = np.where(np.abs(true[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    right = np.cross(true, helper)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    across = np.stack([right, np.cross(true, right)], axis=1)
    cosine = _cosines(vertices, ties, cams.faces)
    side = np.where(cosine.sum(axis=1) < 0, -1.0, 1.0)
    cosine = cosine * side[:, None]
    least = np.where(cosine > 1e-3, np.minimum(_LEAST_COSINE, 0.5 * cosine), 0.0)
    nodes = np.concatenate([vertices, values], axis=1)
    real = len(nodes), len(cams.faces), len(points)
    v, f, n = (padded(max(count, least)) for count, least in zip(real, SMALLEST, strict=True))
    mesh = Mesh(
        _filled(cams.faces.astype(np.int32), f),
        _filled(neighbors(cams.faces[:, :3]).astype(np.int32), f, -1),
        _filled(ties, v, 1.0),
        np.arange(f) < real[1],
        _filled(least, f),
        _filled(side, f, 1.0),
    )
    samples = Sample(_filled(points, n), _filled(true, n, 1.0), _filled(across, n), _filled(weights, n))
    eye = np.zeros(3) if cams.eye is None else (np.asarray(cams.eye, np.float64) - center) / scale
    index = 1.0 if cams.index is None else float(cams.index)
    seen = Eye(eye, np.float64(index), np.maximum(np.array(scales), 1e-12) / np.sqrt(_SHARES))
    return State(_filled(nodes, v, 1.0), _filled(face, n), _filled(place, n, 1 / 3), mesh, samples, seen, kind, real)


def _cosines(vertices: np.ndarray, ties: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3) between what faces look to at their corners, and the ties there."""
    nodes, found = [vertices[column].T for column in faces.T], []
    for corner, place in enumerate(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))):
        right, down = sides(nodes, *(np.full(len(faces), weight) for weight in place))
        across = np.cross(right.T, down.T)
        length = np.linalg.norm(across, axis=1)
        found.append((across * ties[faces[:, corner]]).sum(axis=1) / np.where(length > 0, length, 1.0))
    return np.stack(found, axis=1)


def thinned(face: np.ndarray, faces: int, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of samples of faces (N,), `most` of them or a few more, and their weights, which sum up to 1.

    All faces keep as many, or all that they have.
    """
    counts = np.bincount(face, minlength=faces)
    low, high = 0, int(counts.max(initial=0))
    while high - low > 1:  # the largest number for each that is not too many in all
        middle = (low + high) // 2
        low, high = (middle, high) if np.minimum(counts, middle).sum() <= most else (low, middle)
    each = max(low if np.minimum(counts, high).sum() > most else high, 1)
    order = np.argsort(face, kind="stable")
    rank = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    kept = np.minimum(counts, each)
    # Evenly from those of a face: where rank times kept over count steps on.
    number = np.repeat(kept, counts), np.repeat(np.maximum(counts, 1), counts)
    chosen = (rank * number[0]) // number[1] != ((rank - 1) * number[0]) // number[1]
    rows = np.sort(order[chosen])
    weights = counts[face[rows]] / np.maximum(kept[face[rows]], 1)
    return rows, weights / max(len(face), 1)


def _filled(table: np.ndarray, count: int, value: Any = 0) -> np.ndarray:
    """Rows up to a count."""
    rest = np.full((count - len(table), *table.shape[1:]), value, table.dtype)
    return np.concatenate([table, rest])
