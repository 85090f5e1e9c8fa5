"""Mesh files, written here byte by byte: what is in them, what becomes of it, and what is refused."""

import base64
import io
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mpcam import InputError, load_mesh

# sRGB byte 188 is 0.5029 linear, 99 is 0.1248 (IEC 61966-2-1)
LINEAR = {0: 0.0, 99: 0.12477, 188: 0.50289, 255: 1.0}


def png(*rows) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.array(rows, dtype=np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def test_obj_keeps_order_of_vertices_and_faces(tmp_path):
    file = tmp_path / "a.obj"
    file.write_text("v 0 0 0\nv 9 9 9\nv 1 0 0\nv 0 1 0\nf 1 3 4\nf 4 3 1\nf 1 1 1\nf 1 3 4\n")
    mesh = load_mesh(str(file))
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [9, 9, 9], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(mesh.faces, [[0, 2, 3], [3, 2, 0], [0, 0, 0], [0, 2, 3]])
    assert mesh.normals is None and mesh.uv is None and mesh.colors is None and mesh.name == "a"


def test_obj_polygons_and_backward_indices(tmp_path):
    file = tmp_path / "a.obj"
    file.write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nv -1 0.5 0 # tip\nf 1 2 3 4 5 # five\n\tf\t1 \\\n 2 3 4\n"
    )
    mesh = load_mesh(file)
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2], [0, 2, 3]])


def test_obj_with_separate_indices(tmp_path):
    file = tmp_path / "a.obj"
    file.write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 0.75\n"
        "vn 0 0 2\nvn 0 0.6 0.8\n"
        "f 1/1/1 2/2/1 3/3/1\nf 1/4/2 3/3/1 4/1/2\nf 2 3 4\n"
    )
    mesh = load_mesh(file)
    assert mesh.uv is not None and mesh.normals is not None
    uv, normals = mesh.uv[mesh.faces], mesh.normals[mesh.faces]
    np.testing.assert_array_equal(mesh.corners[:2, :, 0], [[0, 1, 1], [0, 1, 0]])
    np.testing.assert_array_equal(uv[0], [[0, 0], [1, 0], [1, 1]])
    np.testing.assert_array_equal(uv[1], [[0.25, 0.75], [1, 1], [0, 0]])
    np.testing.assert_array_equal(uv[2], np.zeros((3, 2)))
    np.testing.assert_allclose(normals[0], [[0, 0, 1]] * 3)
    np.testing.assert_allclose(normals[1], [[0, 0.6, 0.8], [0, 0, 1], [0, 0.6, 0.8]])
    # a face without normals gets its own
    np.testing.assert_allclose(normals[2], [[0, 0, 1]] * 3)
    assert len(mesh.vertices) < 9


def test_obj_materials_textures_and_colors(tmp_path):
    (tmp_path / "wood grain.png").write_bytes(png([[188, 0, 99], [255, 255, 255]], [[0, 0, 0], [0, 99, 0]]))
    (tmp_path / "a.mtl").write_text(
        "newmtl plain\nKd 0.25 0.5 0.75\nnewmtl wood\nKd 0 0 0\nmap_Kd -s 1 1 1 -clamp on wood grain.png\n"
    )
    file = tmp_path / "a.obj"
    file.write_text(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n"
        "f 1/1 2/1 3/1\nusemtl wood\nf 1/1 2/1 3/1\nusemtl plain\nf 3/1 2/1 1/1\nusemtl wood\nf 2/1 3/1 1/1\n"
    )
    mesh = load_mesh(file)
    assert mesh.face_material is not None
    used = [mesh.materials[k] for k in mesh.face_material]
    assert [m.name for m in used] == ["", "wood", "plain", "wood"]
    assert used[2].color == (0.25, 0.5, 0.75) and used[2].texture is None
    texture = used[1].texture
    assert texture is not None and texture.dtype == np.float32 and used[1].color == (1, 1, 1)
    np.testing.assert_allclose(texture[0, 0], [LINEAR[188], 0, LINEAR[99]], atol=1e-4)
    np.testing.assert_allclose(texture[1, 1], [0, LINEAR[99], 0], atol=1e-4)

    file.write_text("v 0 0 0 1 0 0.5\nv 1 0 0 0 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n")
    mesh = load_mesh(file)
    assert mesh.colors is not None and mesh.materials[0].color == (1, 1, 1)
    np.testing.assert_allclose(mesh.colors, [[1, 0, 0.21404], [0, 0, 0], [1, 1, 1]], atol=1e-4)


def test_obj_without_its_material_file_is_a_warning(tmp_path):
    file = tmp_path / "a.obj"
    file.write_text("mtllib gone.mtl\nusemtl x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.warns(UserWarning, match="gone.mtl"):
        assert load_mesh(file).materials[0].name == "x"
    (tmp_path / "gone.mtl").write_text("newmtl x\nKd 1 0 0\nmap_Kd gone.png\n")
    with pytest.warns(UserWarning, match="gone.png"):
        assert load_mesh(file).materials[0].color == (1, 0, 0)


PLY = """ply
format ascii 1.0
element vertex 5
property float x
property float y
property float z
property float nx
property float ny
property float nz
property uchar red
property uchar green
property uchar blue
element face 3
property list uchar int vertex_indices
end_header
0 0 0 0 0 1 188 0 255
1 0 0 0 0 1 99 0 0
1 1 0 0 0 1 0 0 0
0 1 0 0 0 2 0 0 0
-1 0.5 0 0 0 0 0 0 0
3 0 1 2
4 0 1 2 3
5 0 1 2 3 4
"""


def test_ply_polygons_colors_and_normals(tmp_path):
    file = tmp_path / "a.ply"
    file.write_text(PLY)
    mesh = load_mesh(file)
    assert mesh.triangle_count == 6 and len(mesh.vertices) == 5
    assert mesh.colors is not None and mesh.normals is not None
    np.testing.assert_allclose(mesh.colors[:2], [[LINEAR[188], 0, 1], [LINEAR[99], 0, 0]], atol=1e-4)
    # the normal of length 0 is made from the faces
    np.testing.assert_allclose(mesh.normals, [[0, 0, 1]] * 5)
    edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    assert area.sum() == pytest.approx(0.5 + 1.0 + 1.5)


def test_binary_ply_with_texture_coordinates(tmp_path):
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\n"
        "property double y\nproperty double z\n"
        "property float s\nproperty float t\nelement face 1\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    rows = [(0, 0, 0, 0.25, 0.5), (1, 0, 0, 1, 0), (0, 1e-9, 1 / 3, 0, 1)]
    body = b"".join(struct.pack("<dddff", *row) for row in rows) + struct.pack("<BIII", 3, 0, 1, 2)
    file = tmp_path / "a.PLY"
    file.write_bytes(header.encode() + body)
    mesh = load_mesh(file)
    assert mesh.uv is not None
    np.testing.assert_array_equal(mesh.corners[0], [row[:3] for row in rows])
    np.testing.assert_array_equal(mesh.uv[mesh.faces[0]], [row[3:] for row in rows])


def stl(triangles) -> bytes:
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *np.ravel(t), 0) for t in triangles)
    return b"made by hand".ljust(80, b" ") + struct.pack("<I", len(triangles)) + body


def test_stl_keeps_every_face(tmp_path):
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    triangles = [triangle, triangle, triangle + 1, np.zeros((3, 3))]
    file = tmp_path / "a.stl"
    file.write_bytes(stl(triangles))
    np.testing.assert_array_equal(load_mesh(file).corners, triangles)
    text = "solid a\n"
    for t in triangles:
        rows = "".join(f"vertex {x} {y} {z}\n" for x, y, z in t)
        text += f"facet normal 0 0 1\nouter loop\n{rows}endloop\nendfacet\n"
    file.write_text(text + "endsolid a\n")
    np.testing.assert_array_equal(load_mesh(file).corners, triangles)


def gltf(image: bytes) -> tuple[dict, bytes]:
    """One triangle with uv, colors and a texture, placed twice: moved, and mirrored."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    uv = np.array([[0, 0], [1, 0], [0, 0.25]], np.float32)
    colors = np.array([[255, 0, 0, 255], [0, 51, 0, 255], [0, 0, 255, 255]], np.uint8)
    index = np.array([0, 1, 2, 0], np.uint16)
    image = image.ljust(-(-len(image) // 4) * 4, b"\0")
    blocks = [positions.tobytes(), uv.tobytes(), colors.tobytes(), index.tobytes(), image]
    views, start = [], 0
    for block in blocks:
        views.append({"buffer": 0, "byteOffset": start, "byteLength": len(block)})
        start += len(block)
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0, "translation": [0, 0, 5]},
            {"scale": [-1, 1, 1], "children": [2]},
            {"mesh": 0, "translation": [10, 0, 0]},
        ],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2}, "indices": 3, "material": 0}
                ]
            }
        ],
        "materials": [
            {
                "name": "m",
                "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "baseColorTexture": {"index": 0}},
            }
        ],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 4, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5121, "normalized": True, "count": 3, "type": "VEC4"},
            {"bufferView": 3, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": start}],
    }
    return header, b"".join(blocks)


def glb(header: dict, data: bytes) -> bytes:
    text = json.dumps(header).encode()
    text = text.ljust(-(-len(text) // 4) * 4, b" ")
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize("kind", ["gltf", "glb"])
def test_gltf_nodes_materials_colors(tmp_path, kind):
    header, data = gltf(png([[188, 0, 99], [255, 255, 255]]))
    file = tmp_path / f"a.{kind}"
    if kind == "glb":
        file.write_bytes(glb(header, data))
    else:
        header["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        file.write_text(json.dumps(header))
    mesh = load_mesh(file)
    assert mesh.triangle_count == 2
    first, second = (0, 1) if mesh.corners[0, 0, 0] == 0 else (1, 0)
    np.testing.assert_allclose(mesh.corners[first], [[0, 0, 5], [1, 0, 5], [0, 1, 5]])
    # mirrored in x after moving by 10, and turned round so that the same side stays outside
    np.testing.assert_allclose(sorted(mesh.corners[second].tolist()), [[-11, 0, 0], [-10, 0, 0], [-10, 1, 0]])
    np.testing.assert_allclose(mesh.face_normals, [[0, 0, 1], [0, 0, 1]])
    assert mesh.uv is not None and mesh.colors is not None
    # v points up here and down in glTF
    np.testing.assert_allclose(mesh.uv[mesh.faces[first]], [[0, 1], [1, 1], [0, 0.75]])
    np.testing.assert_allclose(mesh.colors[mesh.faces[first]], [[1, 0, 0], [0, 0.2, 0], [0, 0, 1]], atol=1e-7)
    assert len(mesh.materials) == 1
    material = mesh.materials[0]
    np.testing.assert_allclose(material.color, (0.2, 0.4, 0.6), atol=0.002)
    assert material.texture is not None
    np.testing.assert_allclose(material.texture[0, 0], [LINEAR[188], 0, LINEAR[99]], atol=1e-4)


def test_gltf_that_is_compressed_is_refused(tmp_path):
    header, data = gltf(png([[0, 0, 0]]))
    header["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    (tmp_path / "small.glb").write_bytes(glb(header, data))
    with pytest.raises(InputError, match="without compression"):
        load_mesh(tmp_path / "small.glb")


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("a.obj", b"", "empty"),
        ("a.ply", b"", "empty"),
        ("a.obj", b"hello\n", "no geometry"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\n", "only points"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nf 1 2\n", "line 3"),
        ("a.obj", b"v 0 0 0\nf 1 2 3\n", "number 3"),
        ("a.obj", b"v 0 0 0\nf 0 1 1\n", "start at 1"),
        ("a.obj", b"v 0 0 0\nf -1 -2 -3\n", "first vertex"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nf -1 -2 -3\n", "first vertex"),
        ("a.obj", b"v 0 0 0\nvt 0 0\nf 1/-1 1/-2 1/-1\n", "first texture coordinate"),
        ("a.obj", b"v 0 0 0\nf 1/x 1 1\n", "corner '1/x' is not of the form v, v/vt"),
        ("a.obj", b"v 0 0 0\nf 1 1 1e9\n", "corner '1e9'"),
        ("a.obj", b"v 0 0 0\nf 1 1 99999999999999999999\n", "corner '99999999999999999999'"),
        ("a.obj", b"v 0 0\nf 1 1 1\n", "'v 0 0' has 2 numbers; it needs 3"),
        ("a.obj", b"v 0 0 zero\nf 1 1 1\n", "'zero', which is not a number"),
        ("a.ply", b"hello", "not a readable PLY"),
        ("a.ply", PLY.encode()[:-20], "not a readable PLY"),
        ("a.ply", PLY.replace("element face 3", "element face 0").encode()[:-31], "no triangles"),
        ("a.stl", b"hello", "not a readable STL"),
        ("a.stl", stl([np.eye(3)] * 3)[:-50], "not a readable STL"),
        ("a.stl", stl([]), "no triangles"),
        ("a.glb", b"hello", "not a readable GLB"),
        ("a.gltf", b"{", "not a readable GLTF"),
        ("a.gltf", b'{"asset": {"version": "2.0"}}', "no triangles"),
        ("a.xyz", b"0 0 0", "mesh files are"),
        ("mesh", b"0 0 0", "ending none"),
    ],
)
def test_files_that_are_no_mesh(tmp_path, name, content, word):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_mesh(tmp_path / name)
    assert word in str(caught.value) and "\n" not in str(caught.value)


def test_paths_that_are_no_file(tmp_path):
    (tmp_path / "folder.obj").mkdir()
    for path, word in (
        (tmp_path / "gone.obj", "does not exist"),
        (tmp_path / "folder.obj", "folder"),
        (3, "file name"),
    ):
        with pytest.raises(InputError, match=word):
            load_mesh(path)  # pyright: ignore[reportArgumentType]


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_damaged_files_never_show_a_parser_error(tmp_path):
    header, data = gltf(png([[0, 0, 0]]))
    files = {"ply": PLY.encode(), "stl": stl([np.eye(3)] * 2), "glb": glb(header, data), "obj": b"v 0 0 0\nf 1 1 1\n"}
    rng = np.random.default_rng(5)
    refused = 0
    for kind, content in files.items():
        for trial in range(40):
            damaged = bytearray(content)
            if trial % 2:
                damaged = damaged[: rng.integers(1, len(damaged))]
            else:
                damaged[rng.integers(min(len(damaged), 300))] = rng.integers(256)
            file = tmp_path / f"a.{kind}"
            file.write_bytes(damaged)
            try:
                assert load_mesh(file).triangle_count > 0
            except InputError:
                refused += 1
    assert refused > 40


SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.mark.parametrize(
    ("name", "triangles"), [("cow", 5_804), ("teapot", 6_320), ("spot", 5_856), ("stanford-bunny", 69_451)]
)
def test_well_known_meshes(name, triangles):
    file = SHARED / f"{name}.obj"
    if not file.exists():
        pytest.skip("the folder of public test meshes is not there")
    mesh = load_mesh(file)
    assert mesh.triangle_count == triangles
    assert (mesh.uv is not None) == (name == "spot")
    # the same corners as a reader that takes one line at a time
    positions, faces = [], []
    for line in file.read_text().splitlines():
        if line.startswith("v "):
            positions.append([float(value) for value in line.split()[1:4]])
        elif line.startswith("f "):
            faces.append([int(corner.split("/")[0]) - 1 for corner in line.split()[1:]])
    np.testing.assert_array_equal(mesh.corners, np.array(positions)[np.array(faces)])
