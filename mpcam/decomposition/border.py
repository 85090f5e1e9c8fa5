"""The border of an open reflector."""

import numpy as np
from scipy.spatial import KDTree

from mpcam.cameras.triangle_nodes import EDGES
from mpcam.decomposition.reflector import Reflector
from mpcam.decomposition.shooting import neighbors

_CANDIDATES = 6


class Border:
    """The border of an open reflector, and its creases: edges with a face on one side alone."""

    def __init__(self, reflector: Reflector):
        faces = np.flatnonzero(reflector.usable)
        own, corner = np.nonzero(neighbors(reflector.faces[faces]) < 0)
        self.count, self.face = len(own), faces[own]
        ends = np.array(EDGES)[corner]
        self.weights = np.eye(3)[ends]  # (E, 2, 3)
        self.ends = np.einsum("eij,ejx->eix", self.weights, reflector.vertices[reflector.faces[self.face]])
        self.tree = KDTree(self.ends.mean(axis=1)) if self.count else None

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Distance (N,) to the nearest place on it, its face (N,), and weights 2 and 3 (N,)."""
        assert self.tree is not None
        some = min(_CANDIDATES, self.count)
        rows = self.tree.query(points, some)[1].reshape(len(points), some)
        start, along = self.ends[rows, 0], self.ends[rows, 1] - self.ends[rows, 0]
        square = np.maximum((along * along).sum(axis=-1), 1e-300)
        part = np.clip(((points[:, None] - start) * along).sum(axis=-1) / square, 0.0, 1.0)
        gap = np.linalg.norm(start + part[..., None] * along - points[:, None], axis=-1)
        best = gap.argmin(axis=1)[:, None]
        row, part = (np.take_along_axis(values, best, axis=1)[:, 0] for values in (rows, part))
        inner = (1.0 - part)[:, None] * self.weights[row, 0] + part[:, None] * self.weights[row, 1]
        return np.take_along_axis(gap, best, axis=1)[:, 0], self.face[row], inner[:, 1], inner[:, 2]
