"""Scenes that move, the same way for every method: each vertex swings, and a frame starts with new vertices."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

MOTION = 1e-3
"""How far the vertices of the moving scene swing, as a share of the scene's diagonal."""


def moving_vertices(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Two vertex arrays (V, 3) to alternate between: each vertex swings by a thousandth of the scene's diagonal, with a
    phase that depends on where it is, so that no rigid motion could stand in for new vertices."""
    low, high = mesh.bounds
    diagonal = float(np.linalg.norm(high - low))
    vertices = np.asarray(mesh.vertices, np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        phase = (vertices - low) @ np.array([5.0, 7.0, 11.0]) / (diagonal or 1.0)
        swing = MOTION * diagonal * np.stack([np.sin(phase), np.cos(phase), np.sin(2 * phase)], axis=-1)
        return vertices, vertices + swing


def moving_frame(prepared: Any, positions: Sequence[np.ndarray], **given: Any) -> Callable[[], object]:
    """A frame that starts with new vertices: each call takes the next of `positions`. given: to `update`, besides."""
    count = 0

    def frame() -> object:
        nonlocal count
        count += 1
        prepared.update(positions[count % len(positions)], **given)
        return prepared.frame()

    return frame
