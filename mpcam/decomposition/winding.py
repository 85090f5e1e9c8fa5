"""Faces that people bring: which way round they run, made the same over each connected part where it can be."""

import warnings

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

MOST_NAMED = 5


def first_of_each(faces: np.ndarray) -> np.ndarray:
    """(F,) False for faces (F, 3) with the vertices of an earlier one, whichever way round."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    result = np.zeros(len(faces), bool)
    result[first] = True
    return result


def reversed_faces(faces: np.ndarray, areas: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """(F,) which faces (F, 3) are to be turned around, so that neighbors across an edge run it in opposite directions.

    areas: (F,), of which the larger part stays as it is in each connected part. Faces that are not usable (F,) count
    for nothing. Parts that have only one side, and edges of three or more faces, keep what they have: a warning names
    their faces.
    """
    numbers = np.flatnonzero(usable)
    first, second, same, crowded = _neighbors(faces[numbers])
    count = len(numbers)
    # Each face twice, as it is and turned around; neighbors that fit are joined as they are, others crosswise.
    start = np.concatenate([first, first + count])
    end = np.concatenate([second + np.where(same, count, 0), second + np.where(same, 0, count)])
    graph = coo_array((np.ones(len(start), np.int8), (start, end)), shape=(2 * count, 2 * count))
    _, label = connected_components(graph, directed=False)
    as_is, turned = label[:count], label[count:]
    one_sided = as_is == turned
    weight = np.bincount(as_is, areas[numbers], minlength=label.max(initial=0) + 1)
    result = np.zeros(len(faces), bool)
    result[numbers] = ~one_sided & (
        (weight[as_is] < weight[turned]) | ((weight[as_is] == weight[turned]) & (as_is > turned))
    )
    _warn(numbers[one_sided], "belong to a part with one side only")
    _warn(numbers[crowded], "share an edge with two or more others")
    return result


def _neighbors(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of faces (P,) that alone share an edge, whether both run it the same way, and which faces are at others."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    owner, forward = np.repeat(np.arange(len(faces)), 3), edges[:, 0] < edges[:, 1]
    _, edge, shared = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.ravel()
    order = np.argsort(edge, kind="stable")
    pairs = order[shared[edge[order]] == 2].reshape(-1, 2)
    crowded = np.zeros(len(faces), bool)
    crowded[owner[shared[edge] > 2]] = True
    one, other = pairs.T
    return owner[one], owner[other], forward[one] == forward[other], crowded


def _warn(faces: np.ndarray, what: str) -> None:
    if len(faces) == 0:
        return
    named = ", ".join(map(str, faces[:MOST_NAMED])) + (", ..." if len(faces) > MOST_NAMED else "")
    warnings.warn(
        f"reflector: {len(faces)} faces {what} ({named}), so which way they look is taken from their winding",
        UserWarning,
        stacklevel=5,
    )
