"""glTF written by pygltflib: every type of number, sparse and quantized, instances, skins; and damaged files."""

import base64
import itertools
import json
import struct
from typing import Any

import numpy as np
import pygltflib as gl
import pytest
from gltf_kit import Writer, triangle
from scipy.spatial.transform import Rotation

from mpcam import InputError, load_mesh

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


FORMS = ("glb", "data", "bin")
INDEX = ("u1", "u2", "u4", None)
UV = (("f4", False), ("u1", True), ("u2", True), None)
COLOR = (("f4", False, 3), ("u1", True, 4), ("u2", True, 3), ("u2", True, 4), None)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("index", INDEX)
def test_every_type_of_number(tmp_path, form, index):
    """Forty files of each: types of indices, texture coordinates and colors, with normals or without, with gaps."""
    rng = np.random.default_rng(3)
    for uv, color, normals in itertools.product(UV, COLOR, (False, True)):
        writer, padding = Writer(), int(rng.integers(2)) * 4
        count = 12
        positions = rng.integers(-100, 100, (count, 3)) / 8
        faces = np.arange(count).reshape(-1, 3) if index is None else rng.integers(0, count, (7, 3))
        attributes = {"POSITION": writer.add(positions, padding=padding)}
        directions = rng.standard_normal((count, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        if normals:
            attributes["NORMAL"] = writer.add(directions, padding=padding)
        coordinates = colors = None
        if uv is not None:
            kind, normalized = uv
            top = np.iinfo(kind).max if normalized else 1
            raw = rng.integers(0, top + 1, (count, 2)) if normalized else rng.integers(-9, 9, (count, 2)) / 4
            coordinates = raw / top
            attributes["TEXCOORD_0"] = writer.add(raw, kind, normalized, padding)
        if color is not None:
            kind, normalized, width = color
            top = np.iinfo(kind).max if normalized else 1
            raw = rng.integers(0, top + 1, (count, width)) if normalized else rng.integers(0, 9, (count, width)) / 8
            colors = (raw / top)[:, :3]
            attributes["COLOR_0"] = writer.add(raw, kind, normalized, padding)
        indices = None if index is None else writer.add(faces.reshape(-1, 1), index)
        writer.node(writer.mesh(attributes, indices))
        mesh: Any = load_mesh(writer.save(tmp_path / ("a.glb" if form == "glb" else "a.gltf"), form))
        np.testing.assert_array_equal(mesh.corners, positions[faces])
        for found, expected in ((mesh.normals, directions if normals else None), (mesh.colors, colors)):
            assert (found is None) == (expected is None)
            if expected is not None:
                np.testing.assert_allclose(found[mesh.faces], expected[faces], rtol=0, atol=1e-7)
        assert (mesh.uv is None) == (coordinates is None)
        if coordinates is not None:
            np.testing.assert_allclose(mesh.uv[mesh.faces], (coordinates * (1, -1) + (0, 1))[faces], rtol=0, atol=1e-12)
        # what a material is where the file has none
        assert mesh.materials[0].color == (1, 1, 1)


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2"])
@pytest.mark.parametrize("normalized", [False, True])
def test_quantized_positions_and_normals(tmp_path, kind, normalized):
    writer = Writer()
    raw = np.array([[0, 0, 0], [100, 0, 0], [0, 100, 7], [3, 4, 5]])
    size = np.dtype(kind).itemsize
    directions = np.array([[127, 0, 0], [0, -127, 0], [0, -128, 0], [0, 0, 127]])
    attributes = {"POSITION": writer.add(raw, kind, normalized, padding=size if size == 1 else 2)}
    attributes["NORMAL"] = writer.add(directions, "i1", True, padding=1)
    writer.node(writer.mesh(attributes, writer.add([[0], [1], [2], [0], [2], [3]], "u1")), scale=[2, 2, 2])
    writer.file.extensionsUsed = writer.file.extensionsRequired = ["KHR_mesh_quantization"]
    mesh = load_mesh(writer.save(tmp_path / "a.gltf"))
    expected = 2 * raw / (np.iinfo(kind).max if normalized else 1)
    np.testing.assert_allclose(mesh.vertices, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mesh.normals, [[1, 0, 0], [0, -1, 0], [0, -1, 0], [0, 0, 1]], atol=1e-12)


@pytest.mark.parametrize("places", ["u1", "u2", "u4"])
@pytest.mark.parametrize("over_zeros", [False, True])
def test_sparse(tmp_path, places, over_zeros):
    writer = Writer()
    position = writer.add([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    accessor = writer.file.accessors[position]
    where = writer.view(np.array([0, 2], f"<{places}").tobytes())
    values = writer.view(np.array([[5, 6, 7], [0, 9, 0]], "<f4").tobytes())
    accessor.sparse = gl.Sparse(
        count=2,
        indices=gl.AccessorSparseIndices(bufferView=where, componentType=writer_type(places)),
        values=gl.AccessorSparseValues(bufferView=values),
    )
    if over_zeros:
        accessor.bufferView = None
    writer.node(writer.mesh({"POSITION": position}))
    mesh = load_mesh(writer.save(tmp_path / "a.gltf"))
    np.testing.assert_array_equal(mesh.corners, [[[5, 6, 7], [0 if over_zeros else 1, 0, 0], [0, 9, 0]]])


def writer_type(kind: str) -> int:
    return {"u1": 5121, "u2": 5123, "u4": 5125}[kind]


def test_strips_and_fans(tmp_path):
    # a strip turns every other triangle, a fan begins each at its first (glTF 2.0, 3.7.2.1)
    faces = {5: [[0, 1, 2], [1, 3, 2], [2, 3, 4]], 6: [[1, 2, 0], [2, 3, 0], [3, 4, 0]], 4: [[0, 1, 2]]}
    positions = np.random.default_rng(0).integers(-9, 9, (5, 3))
    for mode, expected in faces.items():
        writer = Writer()
        indices = writer.add(np.arange(3 if mode == 4 else 5)[:, None], "u2")
        writer.node(writer.mesh({"POSITION": writer.add(positions)}, indices, mode=mode))
        mesh = load_mesh(writer.save(tmp_path / "a.gltf"))
        np.testing.assert_array_equal(mesh.corners, positions[expected])


def test_points_and_lines_are_said(tmp_path):
    writer = Writer()
    writer.node(triangle(writer))
    writer.node(triangle(writer, mode=1))
    with pytest.warns(UserWarning, match="lines of mesh '' are not drawn"):
        assert load_mesh(writer.save(tmp_path / "a.gltf")).triangle_count == 1


def test_instances(tmp_path):
    writer = Writer()
    half = np.sqrt(0.5)
    attributes = {
        "TRANSLATION": writer.add([[0, 0, 5], [10, 0, 0]]),
        "ROTATION": writer.add([[0, 0, 0, 127], [0, 0, 127 * half, 127 * half]], "i1", True),
        "SCALE": writer.add([[1, 1, 1], [2, 3, 4]]),
    }
    extension = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    writer.node(triangle(writer), extensions=extension, translation=[0, 100, 0])
    writer.file.extensionsUsed = writer.file.extensionsRequired = ["EXT_mesh_gpu_instancing"]
    mesh = load_mesh(writer.save(tmp_path / "a.glb", "glb"))
    np.testing.assert_allclose(mesh.corners[0], CORNERS + [0, 100, 5])
    # a quarter turn: x to y, y to -x
    np.testing.assert_allclose(mesh.corners[1], [[10, 100, 0], [10, 102, 0], [7, 100, 0]], atol=1e-12)


def test_turns_are_those_of_quaternions(tmp_path):
    """About any axis, of any length, on nodes and on instances: as SciPy turns."""
    turns = np.random.default_rng(3).normal(size=(6, 4))
    writer = Writer()
    number = triangle(writer)
    for turn in turns[:3]:
        writer.node(number, rotation=(turn / np.linalg.norm(turn)).tolist())
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": writer.add(turns[3:])}}}
    writer.node(number, extensions=extension)
    expected = [Rotation.from_quat(turn).apply(CORNERS) for turn in turns]
    np.testing.assert_allclose(load_mesh(writer.save(tmp_path / "a.glb", "glb")).corners, expected, atol=1e-6)


def test_mirrored_nodes_keep_the_outside_outside(tmp_path):
    """The winding is turned with the space, as glTF has it; normals follow the surface."""
    writer = Writer()
    normals = np.array([[0.6, 0, 0.8]] * 3)
    attributes = {"POSITION": writer.add(CORNERS), "NORMAL": writer.add(normals)}
    mirrored, turn = [-1, 2, 1], Rotation.from_rotvec([0.3, -0.4, 0.5])
    writer.node(writer.mesh(attributes), scale=mirrored, rotation=turn.as_quat().tolist())
    mesh: Any = load_mesh(writer.save(tmp_path / "a.glb", "glb"))
    np.testing.assert_allclose(mesh.corners[0], turn.apply(CORNERS * mirrored)[[0, 2, 1]], atol=1e-6)
    expected = turn.apply(normals[0] / mirrored) / np.linalg.norm(normals[0] / mirrored)
    np.testing.assert_allclose(mesh.normals, [expected] * 3, atol=1e-6)


def test_skins_are_placed_by_their_joints(tmp_path):
    """A joint moved by (0, 0, 3) from where it was bound; the node of the mesh is far away, and does not count."""
    writer = Writer()
    weights = [[255, 0, 0, 0], [0, 255, 0, 0], [51, 204, 0, 0]]
    attributes = {
        "POSITION": writer.add(CORNERS),
        "NORMAL": writer.add([[0, 0, 1]] * 3),
        "JOINTS_0": writer.add([[0, 1, 0, 0]] * 3, "u1"),
        "WEIGHTS_0": writer.add(weights, "u1", True),
    }
    bound = np.tile(np.eye(4), (2, 1, 1))
    bound[1, 2, 3] = -2
    matrices = writer.add(bound.transpose(0, 2, 1).reshape(2, 16))
    still = writer.node()
    moved = writer.node(root=False, translation=[0, 0, 5])
    writer.file.nodes[still].children = [moved]
    writer.file.skins = [gl.Skin(joints=[still, moved], inverseBindMatrices=matrices)]
    writer.node(writer.mesh(attributes), skin=0, translation=[50, 0, 0])
    mesh = load_mesh(writer.save(tmp_path / "a.gltf"))
    np.testing.assert_allclose(mesh.vertices, CORNERS + np.outer([0, 3, 2.4], [0, 0, 1]))
    np.testing.assert_allclose(mesh.normals, [[0, 0, 1]] * 3)


def test_morph_targets_by_their_weights(tmp_path):
    writer = Writer()
    targets = [{"POSITION": writer.add([[0, 0, 4]] * 3)}, {"POSITION": writer.add([[7, 7, 7]] * 3)}]
    number = triangle(writer, targets=targets)
    writer.file.meshes[number].weights = [0.25, 0]
    writer.node(number)
    writer.node(number)
    data = json.loads(writer.save(tmp_path / "a.gltf").read_text())
    data["nodes"][1]["weights"] = [0.5, 0]  # pygltflib's nodes have none
    (tmp_path / "a.gltf").write_text(json.dumps(data))
    np.testing.assert_array_equal(load_mesh(tmp_path / "a.gltf").corners, [CORNERS + [0, 0, 1], CORNERS + [0, 0, 2]])


def test_nodes(tmp_path):
    """Children in their parents, a matrix by columns, a hidden branch, a node outside of the scene, a second scene."""
    writer = Writer()
    number = triangle(writer)
    child = writer.node(number, root=False, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1])
    hidden = writer.node(number, root=False)
    writer.node(number, root=False)
    writer.node(scale=[2, 2, 2], children=[child])
    writer.node(children=[hidden], extensions={"KHR_node_visibility": {"visible": False}})
    np.testing.assert_array_equal(load_mesh(writer.save(tmp_path / "a.gltf")).corners, [2 * CORNERS + [2, 4, 6]])
    writer.file.scenes.append(gl.Scene(nodes=[hidden]))
    writer.file.scene = 1
    with pytest.warns(UserWarning, match="2 scenes: scene 1 alone is read"):
        np.testing.assert_array_equal(load_mesh(writer.save(tmp_path / "a.gltf")).corners, [CORNERS])


def test_primitives_that_share_vertices_keep_their_own(tmp_path):
    writer = Writer()
    position = writer.add(np.random.default_rng(1).integers(-9, 9, (3000, 3)))
    primitives = [
        gl.Primitive(
            attributes=gl.Attributes(POSITION=position),
            indices=writer.add([[k], [k + 1], [k + 2]], "u2"),
            material=k % 2,
        )
        for k in range(6)
    ]
    writer.file.meshes = [gl.Mesh(primitives=primitives)]
    writer.file.materials = [gl.Material(name="a"), gl.Material(name="b")]
    writer.node(0)
    mesh: Any = load_mesh(writer.save(tmp_path / "a.glb", "glb"))
    assert len(mesh.vertices) == 18
    assert [mesh.materials[k].name for k in mesh.face_material] == ["a", "b"] * 3


def header(**changes) -> dict:
    data = base64.b64encode(np.array(CORNERS, "<f4").tobytes()).decode()
    return {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64," + data}],
    } | changes


def test_a_byte_order_mark_and_a_glb_without_one(tmp_path):
    (tmp_path / "a.gltf").write_bytes(b"\xef\xbb\xbf" + json.dumps(header()).encode())
    np.testing.assert_array_equal(load_mesh(tmp_path / "a.gltf").corners, [CORNERS])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"asset": {"version": "1.0"}}, "glTF version 1.0: export it as glTF 2.0"),
        ({"asset": {"version": "2.1", "minVersion": "2.1"}}, "glTF version 2.1"),
        ({"asset": {}}, "version none"),
        ({"buffers": [{"byteLength": 36, "uri": "gone%20away.bin"}]}, "needs gone%20away.bin, which is not there"),
        ({"buffers": [{"byteLength": 99, "uri": "data:,abc"}]}, "3 bytes of 99"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 99}]}, "ends outside"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 9, "type": "VEC3"}]}, "before its last row"),
        ({"accessors": [{"componentType": 5126, "count": 10**12, "type": "VEC3"}]}, "accessor 0 holds"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"}]}, "accessor 0 holds"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "no tree"),
        ({"nodes": [{"mesh": 5}]}, "mesh 5 of 1"),
        ({"nodes": [{"mesh": 0, "matrix": [1.0] * 16}]}, "not affine"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 9}]}]}, "mode 9"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 3}]}]}, "material 3 of 0"),
        ({"meshes": 3}, "Expected `array`"),
    ],
)
def test_damaged(tmp_path, changes, said):
    (tmp_path / "a.gltf").write_text(json.dumps(header(**changes)))
    with pytest.raises(InputError, match=said):
        load_mesh(tmp_path / "a.gltf")


def test_a_glb_that_was_cut_off(tmp_path):
    writer = Writer()
    writer.node(triangle(writer))
    data = writer.save(tmp_path / "a.glb", "glb").read_bytes()
    (tmp_path / "a.glb").write_bytes(data[:-4])
    with pytest.raises(InputError, match="cut off"):
        load_mesh(tmp_path / "a.glb")
    (tmp_path / "a.glb").write_bytes(struct.pack("<4sII", b"glTF", 1, 20) + b"\0" * 8)
    with pytest.raises(InputError, match="glTF version 1"):
        load_mesh(tmp_path / "a.glb")
