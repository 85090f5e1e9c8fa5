"""Vectors with the component first: `x, y, z = p` unpacks a (3, N) NumPy or JAX array and a Dr.Jit Array3f alike."""

import sys
from collections.abc import Sequence

import numpy as np

from mpcam.math.arrays import Array, detach, library, maximum, sqrt, where

Vector = Array  # unpacks into 2 or 3 components of equal shape


def vector(*components: Array) -> Vector:
    """Join components into one vector of the library that they belong to."""
    name = library(*components)
    if name == "drjit":
        leaf = next(c for c in components if library(c) == "drjit")
        drjit = sys.modules["drjit"]
        suffix = "f64" if drjit.type_v(leaf) == drjit.VarType.Float64 else "f"
        kind = getattr(sys.modules[type(leaf).__module__], f"Array{len(components)}{suffix}")
        return kind(*components)
    if name == "jax":
        import jax.numpy as jnp

        return jnp.stack(jnp.broadcast_arrays(*components))
    return np.stack(np.broadcast_arrays(*components))


def dot(a: Vector, b: Vector) -> Array:
    """Inner product of two 3-vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Cross product of two 3-vectors."""
    return vector(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _scaled(a: Vector) -> tuple[Array, Vector]:
    """Largest component (a constant to gradients), and the vector divided by it, whose squares cannot overflow."""
    largest = detach(maximum(maximum(abs(a[0]), abs(a[1])), abs(a[2])))
    safe = where(largest > 0, largest, 1.0)
    return largest, vector(a[0] / safe, a[1] / safe, a[2] / safe)


def norm(a: Vector) -> Array:
    """Length of a 3-vector of any magnitude; its gradient at the zero vector is zero."""
    largest, scaled = _scaled(a)
    squared = dot(scaled, scaled)
    nonzero = squared > 0
    return where(nonzero, largest * sqrt(where(nonzero, squared, 1.0)), 0.0)


def normalize(a: Vector) -> Vector:
    """The 3-vector at length 1, whatever its magnitude; the zero vector stays zero."""
    _, scaled = _scaled(a)
    squared = dot(scaled, scaled)
    return scaled * (1.0 / sqrt(where(squared > 0, squared, 1.0)))


def entry(matrix: Array, row: int, column: int) -> Array:
    """One entry of a matrix; as a Python float if it is a NumPy number, which would seize the arithmetic."""
    return plain(matrix[row][column])


def plain(value: Array) -> Array:
    """A NumPy number as a Python float, since it would seize the arithmetic; anything else as it is."""
    return float(value) if isinstance(value, (np.floating, np.integer)) else value


def rotate(matrix: Array, p: Vector) -> Vector:
    """Upper left 3x3 block of a 4x4 matrix times p."""
    rows = [[entry(matrix, i, j) for j in range(3)] for i in range(3)]
    return vector(*(row[0] * p[0] + row[1] * p[1] + row[2] * p[2] for row in rows))


def rotate_back(matrix: Array, p: Vector) -> Vector:
    """Transpose of the upper left 3x3 block of a 4x4 matrix times p."""
    rows = [[entry(matrix, j, i) for j in range(3)] for i in range(3)]
    return vector(*(row[0] * p[0] + row[1] * p[1] + row[2] * p[2] for row in rows))


def translation(matrix: Array) -> Sequence[Array]:
    """The three entries of the last column of a 4x4 matrix."""
    return [entry(matrix, i, 3) for i in range(3)]
