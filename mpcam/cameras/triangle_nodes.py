"""Nodes of camera triangles, and what lies between them: written once for NumPy, JAX and Dr.Jit.

A triangle of degree 1 has its three corners for nodes. One of degree 2 has six: node 3 + i is that of the edge opposite
to corner i, and its value is met halfway along the edge. What lies on an edge depends on the nodes of that edge alone,
so triangles that share them meet without a gap.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mpcam.math import Array, Vector

NODES = {1: 3, 2: 6}
"""Nodes of a triangle by degree."""
EDGES = ((1, 2), (2, 0), (0, 1))
"""Corners at the ends of the edge opposite to each corner."""


def weights(second: Array, third: Array, nodes: int) -> list[Array]:
    """Of each node, at weights of corners 2 and 3: 1 at the node itself and 0 at the others; their sum is 1."""
    first = 1.0 - second - third
    if nodes == 3:
        return [first, second, third]
    return [
        first * (2.0 * first - 1.0),
        second * (2.0 * second - 1.0),
        third * (2.0 * third - 1.0),
        4.0 * second * third,
        4.0 * third * first,
        4.0 * first * second,
    ]


def slopes(second: Array, third: Array, nodes: int) -> tuple[list[Array], list[Array]]:
    """Derivatives of `weights` by the weight of corner 2, and by that of corner 3."""
    zero = 0.0 * (second + third)
    if nodes == 3:
        return [zero - 1.0, zero + 1.0, zero], [zero - 1.0, zero, zero + 1.0]
    first = 1.0 - second - third
    away = 1.0 - 4.0 * first
    return (
        [away, 4.0 * second - 1.0, zero, 4.0 * third, -4.0 * third, 4.0 * (first - second)],
        [away, zero, 4.0 * third - 1.0, 4.0 * second, 4.0 * (first - third), -4.0 * second],
    )


def mixed(values: Sequence[Vector], second: Array, third: Array) -> Any:
    """What values at the nodes (3 or 6 vectors) are at weights of corners 2 and 3."""
    first, *others = values
    result = first
    for weight, value in zip(weights(second, third, len(values))[1:], others, strict=True):
        result = result + weight * (value - first)  # from the first: exact where all agree
    return result


def sides(values: Sequence[Vector], second: Array, third: Array) -> tuple[Any, Any]:
    """Derivatives of `mixed` by the weight of corner 2, and by that of corner 3."""
    first, *others = values
    if len(values) == 3:
        return others[0] - first, others[1] - first
    found = []
    for parts in slopes(second, third, len(values)):
        found.append(sum(slope * (value - first) for slope, value in zip(parts[1:], others, strict=True)))
    return found[0], found[1]


def corners_only(faces: np.ndarray) -> np.ndarray:
    """Flat triangles (F', 3) through all nodes of faces (F, 3) or (F, 6): these themselves, or each in four."""
    if faces.shape[1] == 3:
        return faces
    a, b, c, bc, ca, ab = faces.T
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
    return np.stack([np.stack(part, axis=1) for part in four], axis=1).reshape(-1, 3)
