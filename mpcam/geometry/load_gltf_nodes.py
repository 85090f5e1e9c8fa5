"""Where the meshes of a glTF file stand: nodes, instances, and skins in their rest pose."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.load_gltf_data import read_accessor
from mpcam.geometry.load_gltf_file import GltfFile
from mpcam.geometry.load_gltf_parts import Node


class Places:
    """The nodes that are shown, and the matrix of each node (world from node)."""

    def __init__(self, file: GltfFile):
        self._file, self._nodes = file, file.root.nodes
        parents = [(child, k) for k, node in enumerate(self._nodes) for child in node.children]
        self._parent = dict(parents)
        if len(self._parent) < len(parents):
            raise ValueError("a node with two parents")
        if any(not 0 <= child < len(self._nodes) for child in self._parent):
            raise ValueError("a node has a child that is not there")
        self._known: dict[int, np.ndarray] = {}

    def shown(self) -> Iterator[int]:
        """Numbers of the nodes of the scene, parents first."""
        scenes = self._file.root.scenes
        if scenes:
            number = self._file.root.scene or 0
            if not 0 <= number < len(scenes):
                raise ValueError(f"scene {number} of {len(scenes)} is named")
            if len(scenes) > 1:
                self._file.say(f"it holds {len(scenes)} scenes: scene {number} alone is read")
            waiting = list(reversed(scenes[number].nodes))
        else:
            waiting = [k for k in reversed(range(len(self._nodes))) if k not in self._parent]
        seen = set()
        while waiting:
            number = waiting.pop()
            if number in seen or not 0 <= number < len(self._nodes):
                raise ValueError("nodes that are no tree")
            seen.add(number)
            node = self._nodes[number]
            if node.extensions.get("KHR_node_visibility", {}).get("visible", True):
                yield number
                waiting += reversed(node.children)

    def world(self, number: int) -> np.ndarray:
        """The (4, 4) matrix of a node, world from node."""
        path = []
        while number not in self._known and len(path) <= len(self._nodes):
            path.append(number)
            if number not in self._parent:
                break
            number = self._parent[number]
        if len(path) > len(self._nodes):
            raise ValueError("nodes that are no tree")
        for k in reversed(path):
            above = self._known[self._parent[k]] if k in self._parent else np.eye(4)
            self._known[k] = above @ self._local(k)
        return self._known[path[0] if path else number]

    def _local(self, number: int) -> np.ndarray:
        node = self._nodes[number]
        if node.matrix is not None:
            matrix = np.array(node.matrix, np.float64).reshape(4, 4).T
        else:
            rows = (np.array(values, np.float64)[None] for values in (node.translation, node.rotation, node.scale))
            matrix = _placements(*rows)[0]
        if not np.all(np.isfinite(matrix)) or not np.array_equal(matrix[3], (0, 0, 0, 1)):
            raise InputError(
                f"{self._file.path}: the matrix of node {number} is not affine: its last row is {matrix[3]}"
            )
        return matrix

    def instances(self, number: int) -> list[np.ndarray]:
        """The matrices at which the mesh of a node stands: its own, or one for each of its instances."""
        node, own = self._nodes[number], self.world(number)
        table: dict[str, Any] | None = node.extensions.get("EXT_mesh_gpu_instancing")
        if table is None:
            return [own]
        attributes = table["attributes"]
        defaults = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}
        found = {
            name: read_accessor(self._file, attributes[name], (len(value),)).astype(np.float64)
            for name, value in defaults.items()
            if name in attributes
        }
        if not found or len({len(rows) for rows in found.values()}) != 1:
            raise ValueError(f"instances of node {number} of different counts")
        count = len(next(iter(found.values())))
        rows = (found.get(name, np.tile(value, (count, 1))) for name, value in defaults.items())
        return list(own @ _placements(*rows))

    def joints(self, node: Node) -> np.ndarray:
        """(J, 4, 4) matrices of the joints of a node's skin, world from the mesh as it was bound."""
        skin = self._file.root.skins[node.skin or 0]
        if not all(0 <= joint < len(self._nodes) for joint in skin.joints):
            raise ValueError("a joint that is not there")
        worlds = np.array([self.world(joint) for joint in skin.joints]).reshape(-1, 4, 4)
        if skin.inverse_bind_matrices is None:
            return worlds
        bound = read_accessor(self._file, skin.inverse_bind_matrices, (16,)).reshape(-1, 4, 4).transpose(0, 2, 1)
        return worlds @ bound[: len(worlds)]


def _placements(translation: np.ndarray, rotation: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(N, 4, 4) matrices that scale, turn by quaternions x, y, z, w, then move."""
    length = np.linalg.norm(rotation, axis=1)
    if not np.all(length > 0):
        raise ValueError("a rotation without length")
    x, y, z, w = (rotation / length[:, None]).T
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)
    matrices = np.tile(np.eye(4), (len(turn), 1, 1))
    matrices[:, :3, :3] = turn * scale[:, None, :]
    matrices[:, :3, 3] = translation
    return matrices


def skinned(
    position: np.ndarray, normals: np.ndarray | None, joints: np.ndarray, weights: np.ndarray, matrices: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None]:
    """Positions and normals (V, 3) moved by joints (V, K) with weights (V, K); matrices: (J, 4, 4)."""
    if joints.min(initial=0) < 0 or joints.max(initial=0) >= len(matrices):
        raise ValueError("a joint that the skin has not")
    total = weights.sum(axis=1, keepdims=True)
    weights = weights / np.where(total == 0, 1.0, total)
    mixed = np.zeros((len(position), 4, 4))
    for k in range(joints.shape[1]):
        mixed += weights[:, k, None, None] * matrices[joints[:, k]]
    moved = np.einsum("vij,vj->vi", mixed[:, :3, :3], position) + mixed[:, :3, 3]
    if normals is None:
        return moved, None
    rows = mixed[:, :3, :3]
    cofactor = np.cross(rows[:, [1, 2, 0]], rows[:, [2, 0, 1]])
    return moved, np.einsum("vij,vj->vi", cofactor, normals)
