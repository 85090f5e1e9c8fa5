"""Which of a node's six numbers may move, and along which axes."""

import itertools
from typing import Any

import numpy as np

from mpcam.decomposition.shooting import neighbors
from mpcam.errors import InputError
from mpcam.fitting.state import State

PARTS = ("along", "off", "turn", "length")
"""Of a node: its position along the surface and off it, its normal or ray turned, and the length of that."""
RIMS = ("free", "along", "fixed")
_CORNER = 0.5


def frames_of(state: State, fixed: dict[str, np.ndarray], rim: str) -> np.ndarray:
    """(V, 6, 6) axes of each node in columns: two along the surface, one off it, two that turn, one of the length.

    Columns of what is fixed are zero, and all of them where no sample is beside a node. rim: nodes at the border may
    move freely, along it, or not.
    """
    count, _, _ = state.real
    ties, values = np.asarray(state.mesh.ties), state.nodes[:, 3:]
    frames = np.zeros((len(state.nodes), 6, 6))
    first, second = _across(ties)
    faces = np.asarray(state.mesh.faces)[: state.real[1]]
    border, along, corner = _rim(faces, state.nodes[:, :3], count)
    if rim != "free":
        flat = along - (along * ties[:count]).sum(1, keepdims=True) * ties[:count]
        length = np.linalg.norm(flat, axis=1, keepdims=True)
        turned = border & (length[:, 0] > 1e-9)
        first[:count][turned] = (flat / np.where(length > 0, length, 1.0))[turned]
        second[:count][turned] = np.cross(ties[:count], first[:count])[turned]
    frames[:, :3, 0], frames[:, :3, 1], frames[:, :3, 2] = first, second, ties
    unit = values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-300)
    turn = _across(unit)
    frames[:, 3:, 3], frames[:, 3:, 4], frames[:, 3:, 5] = *turn, unit
    free = np.zeros((len(frames), 6), bool)
    free[np.unique(faces)] = True
    free[count:] = False
    columns = {"along": (0, 1), "off": (2,), "turn": (3, 4), "length": (5,)}
    for name, mask in fixed.items():
        rows = np.zeros(len(frames), bool)
        rows[:count] = mask
        for column in columns[name]:
            free[rows, column] = False
    if rim != "free":
        free[np.flatnonzero(border), 1] = False
    if rim == "fixed":
        free[np.flatnonzero(border), 0] = False
        free[np.flatnonzero(border), 2] = False
    if rim == "along":
        free[np.flatnonzero(border & corner), 0] = False
    return frames * free[:, None, :]


def fixed_parts(given: Any, count: int) -> dict[str, np.ndarray]:
    """Masks (V,) by part; raises InputError for others.

    given: None, a mask (V,) of vertices that keep everything, or a dictionary of masks, or True, by part; "positions"
    is "along" and "off" together, "rays" or "normals" is "turn" and "length".
    """
    both = {"positions": ("along", "off"), "normals": ("turn", "length"), "rays": ("turn", "length")}
    result = {name: np.zeros(count, bool) for name in PARTS}
    if given is None:
        return result
    parts = given if isinstance(given, dict) else {"positions": given, "normals": given}
    for name, value in parts.items():
        if name not in PARTS and name not in both:
            raise InputError(f"fixed={name!r}: allowed are {', '.join((*PARTS, *both))}")
        mask = np.asarray(value)
        if mask.dtype != bool or mask.shape not in ((), (count,)):
            raise InputError(
                f"fixed: {name} has shape {mask.shape} and type {mask.dtype}: give True, or {count} of them"
            )
        for part in both.get(name, (name,)):
            result[part] = result[part] | mask
    return result


def _across(ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (N, 3) at right angles to unit ones and to each other."""
    helper = np.where(np.abs(ways[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(ways, helper)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
    return first, np.cross(ways, first)


def _rim(faces: np.ndarray, places: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(V,) nodes on the border, (V, 3) which way it runs there, and (V,) whether it turns sharply."""
    face, corner = np.nonzero(neighbors(faces[:, :3]) < 0)
    line = [faces[face, (corner + 1) % 3], faces[face, (corner + 2) % 3]]
    if faces.shape[1] == 6:
        line.insert(1, faces[face, 3 + corner])
    border = np.zeros(count, bool)
    along, lengths = np.zeros((count, 3)), np.zeros(count)
    for one, other in itertools.pairwise(line):
        edge = places[other] - places[one]
        length = np.linalg.norm(edge, axis=1)
        for ends in (one, other):
            border[ends] = True
            np.add.at(along, ends, edge / np.maximum(length, 1e-300)[:, None])
            np.add.at(lengths, ends, 1.0)
    straight = np.linalg.norm(along, axis=1) / np.maximum(lengths, 1.0)
    return border, along, (straight < 1.0 - _CORNER * 0.5) | (lengths != 2)
