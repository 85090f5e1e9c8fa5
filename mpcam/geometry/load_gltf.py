"""glTF 2.0, text and binary: the triangles of its scene, each mesh where its nodes place it."""

from pathlib import Path

import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.load_gltf_data import read_accessor
from mpcam.geometry.load_gltf_file import GltfFile
from mpcam.geometry.load_gltf_looks import Look, Looks
from mpcam.geometry.load_gltf_nodes import Places, skinned
from mpcam.geometry.load_gltf_parts import MeshPart, Node, Primitive
from mpcam.geometry.load_ply import unit_normals
from mpcam.geometry.load_text import Say
from mpcam.geometry.mesh import Mesh

_MODES = {0: "points", 1: "lines", 2: "lines", 3: "lines"}
_WRAPS = {33071: "clamped", 33648: "mirrored"}


def load_gltf(path: Path, say: Say) -> Mesh:
    """Reads the scene of a .gltf or .glb file.

    Integers are decoded, sparse accessors filled in, instances repeated; skins and morph targets stand as the file
    leaves them, animations at rest. Colors are linear. Raises InputError or ValueError for what cannot be read; say is
    told of what is missing or not used.
    """
    file = GltfFile(path, say)
    places, looks = Places(file), Looks(file)
    parts: list[Mesh] = []
    plain: dict[int, list[Mesh]] = {}
    for number in places.shown():
        node = file.root.nodes[number]
        if node.mesh is None:
            continue
        if not 0 <= node.mesh < len(file.root.meshes):
            raise ValueError(f"mesh {node.mesh} of {len(file.root.meshes)} is named")
        mesh = file.root.meshes[node.mesh]
        if node.skin is not None:
            # joints place a skin; the node does not
            parts += [_part(file, mesh, node, primitive, looks, places) for primitive in _triangles(mesh, say)]
            continue
        if node.weights or node.mesh not in plain:
            own = [_part(file, mesh, node, primitive, looks, None) for primitive in _triangles(mesh, say)]
            if not node.weights:
                plain[node.mesh] = own
        else:
            own = plain[node.mesh]
        parts += [part.transformed(matrix) for matrix in places.instances(number) for part in own]
    return Mesh.concatenate(parts)


def _triangles(mesh: MeshPart, say: Say) -> list[Primitive]:
    for primitive in mesh.primitives:
        if primitive.mode in _MODES:
            say(f"{_MODES[primitive.mode]} of mesh {mesh.name!r} are not drawn")
        elif primitive.mode not in (4, 5, 6):
            raise ValueError(f"a primitive of mode {primitive.mode}")
    return [primitive for primitive in mesh.primitives if primitive.mode not in _MODES]


def _part(
    file: GltfFile, mesh: MeshPart, node: Node, primitive: Primitive, looks: Looks, places: Places | None
) -> Mesh:
    """One primitive in the axes of its node; with places, by its skin in those of the world."""
    attributes = primitive.attributes
    if "POSITION" not in attributes:
        raise ValueError("a primitive without POSITION")
    _check_compression(file, primitive)
    weights = node.weights or mesh.weights
    position = _attribute(file, primitive, "POSITION", weights)
    normals = _attribute(file, primitive, "NORMAL", weights) if "NORMAL" in attributes else None
    if places is not None and "JOINTS_0" in attributes:
        sets = [k for k in range(len(attributes)) if f"JOINTS_{k}" in attributes]
        joints = [read_accessor(file, attributes[f"JOINTS_{k}"], (4,)).astype(np.int64) for k in sets]
        shares = [read_accessor(file, attributes[f"WEIGHTS_{k}"], (4,)).astype(np.float64) for k in sets]
        matrices = places.joints(node)
        position, normals = skinned(position, normals, np.hstack(joints), np.hstack(shares), matrices)
    elif places is not None:
        raise ValueError("a skin without JOINTS_0")
    faces = _faces(file, primitive, len(position))
    if normals is not None:
        normals = unit_normals(normals, position, faces)
    look = looks[primitive.material]
    uv, material = _texcoord(file, primitive, look)
    colors = None
    if "COLOR_0" in attributes:
        colors = np.clip(read_accessor(file, attributes["COLOR_0"], (3, 4))[:, :3].astype(np.float64), 0.0, None)
    used = np.unique(faces)
    if len(mesh.primitives) > 1 and len(used) < len(position):
        # primitives often share one table of vertices, of which each needs a part
        faces = np.searchsorted(used, faces)
        position = position[used]
        normals, uv, colors = (None if values is None else values[used] for values in (normals, uv, colors))
    return Mesh(position, faces, normals, uv, colors, material)


def _check_compression(file: GltfFile, primitive: Primitive) -> None:
    """Raises InputError where numbers are there in a compressed form alone."""
    named = file.root.accessors[primitive.attributes["POSITION"]]
    for name in primitive.extensions:
        if name.endswith("draco_mesh_compression") and named.buffer_view is None:
            raise InputError(f"{file.path} is compressed with {name}: export it again without compression")


def _attribute(file: GltfFile, primitive: Primitive, name: str, weights: list[float]) -> np.ndarray:
    """(V, 3) numbers of an attribute, with those of its morph targets added by their weights."""
    values = read_accessor(file, primitive.attributes[name], (3,)).astype(np.float64)
    for target, weight in zip(primitive.targets, weights, strict=False):
        if name in target and weight != 0:
            values = values + weight * read_accessor(file, target[name], (3,))
    return values


def _faces(file: GltfFile, primitive: Primitive, count: int) -> np.ndarray:
    """(F, 3) vertices of triangles, strips or fans."""
    index = np.arange(count) if primitive.indices is None else read_accessor(file, primitive.indices, (1,))[:, 0]
    index = index.astype(np.int64)
    if len(index) and (index.min() < 0 or index.max() >= count):
        raise ValueError(f"indices to {index.max()} for {count} vertices")
    if primitive.mode == 4:
        if len(index) % 3:
            raise ValueError(f"{len(index)} indices, which are no triangles")
        return index.reshape(-1, 3)
    if primitive.mode == 6:
        return np.stack([index[1:-1], index[2:], np.full(max(len(index) - 2, 0), index[0])], axis=1)
    faces = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    faces[1::2] = faces[1::2][:, [0, 2, 1]]
    return faces


def _texcoord(file: GltfFile, primitive: Primitive, look: Look):
    """Texture coordinates, v up, or None; and the material, without its texture where that has no coordinates."""
    name, material = f"TEXCOORD_{look.texcoord}", look.material
    if name not in primitive.attributes:
        if look.material.texture is not None:
            file.say(f"faces of material {material.name!r} have no {name}: they are drawn without its texture")
        return None, look.bare
    uv = look.placed(read_accessor(file, primitive.attributes[name], (2,)).astype(np.float64))
    if material.texture is not None and len(uv):
        for mode, values in zip(look.wrap, uv.T, strict=True):
            if mode in _WRAPS and (values.min() < -1e-6 or values.max() > 1 + 1e-6):
                file.say(
                    f"the texture of material {material.name!r} is {_WRAPS[mode]}, but texture coordinates run outside "
                    "of 0 to 1: it is repeated there"
                )
    return uv * (1.0, -1.0) + (0.0, 1.0), material
