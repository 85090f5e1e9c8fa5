"""PLY and STL in the forms that other readers call damaged, written byte by byte, and what is refused."""

import io
import struct
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mpcam import InputError, load_mesh

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def load(folder, name: str, data: bytes | str) -> Any:
    (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return load_mesh(folder / name)


def ply(body: str | bytes, *elements: str, encoding: str = "ascii", comments: str = "") -> bytes:
    lines = ["ply", f"format {encoding} 1.0", *comments.splitlines()]
    for element in elements:
        name, *properties = element.split(", ")
        lines += [f"element {name}", *(f"property {one}" for one in properties)]
    return "\n".join([*lines, "end_header", ""]).encode() + (body if isinstance(body, bytes) else body.encode())


VERTEX, FACE = "vertex 4, float x, float y, float z", "face 2, list uchar int vertex_indices"


@pytest.mark.parametrize(("encoding", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
@pytest.mark.parametrize(
    "types", [("uchar", "B", "int", "i"), ("uint8", "B", "ushort", "H"), ("int", "i", "uchar", "B")]
)
def test_binary_with_triangles_and_quads(tmp_path, encoding, order, types):
    length, c, number, n = types
    body = b"".join(struct.pack(f"{order}3f", *corner) for corner in SQUARE)
    for face in ((0, 1, 2, 3), (0, 1, 2), (3, 2, 1, 0), (1, 2, 3)):
        body += struct.pack(f"{order}{c}{len(face)}{n}", len(face), *face)
    face = f"face 4, list {length} {number} vertex_index"
    mesh = load(tmp_path, "a.ply", ply(body, VERTEX, face, encoding=encoding))
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2], [3, 2, 1], [3, 1, 0], [1, 2, 3]])


@pytest.mark.parametrize(("encoding", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
@pytest.mark.parametrize("length", "hi")
def test_lengths_of_lists_are_numbers_of_many_bytes(tmp_path, encoding, order, length):
    """3 and 259 differ in one byte alone, be it the first or the last."""
    corners = np.arange(259) * (2 * np.pi / 259)
    body = b"".join(struct.pack(f"{order}3f", np.cos(angle), np.sin(angle), 0) for angle in corners)
    for face in ((0, 100, 200), range(259), (0, 50, 100)):
        body += struct.pack(f"{order}{length}{len(face)}h", len(face), *face)
    face = f"face 3, list {'short' if length == 'h' else 'int'} short vertex_indices"
    mesh = load(tmp_path, "a.ply", ply(body, VERTEX.replace("4", "259"), face, encoding=encoding))
    assert mesh.triangle_count == 259
    np.testing.assert_array_equal(mesh.faces[[0, -1]], [[0, 100, 200], [0, 50, 100]])


@pytest.mark.parametrize("tail", [b"", b"\n", b"\0\0", b"\r\n\x1a"])
def test_a_tail_without_content(tmp_path, tail):
    body = b"".join(struct.pack("<3f", *corner) for corner in SQUARE) + struct.pack("<B3iB3i", 3, 0, 1, 2, 3, 0, 2, 3)
    data = ply(body, VERTEX, FACE, encoding="binary_little_endian")
    assert load(tmp_path, "a.ply", data + tail).triangle_count == 2
    with pytest.warns(UserWarning, match="5 bytes behind the last element"):
        load(tmp_path, "b.ply", data + b"extra")
    with pytest.raises(InputError, match="not a readable PLY file.*rows are missing"):
        load(tmp_path, "c.ply", data[:-3])


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_line_ends_of_headers(tmp_path, end, mark):
    # the first number begins with the byte of a newline
    body = struct.pack("<9f", *np.frombuffer(b"\n\n\n\n", "<f4"), *range(8)) + struct.pack("<B3i", 3, 0, 1, 2)
    data = ply(
        "",
        "vertex 3, float x, float y, float z",
        "face 1, list uchar int vertex_indices",
        encoding="binary_little_endian",
    )
    mesh = load(tmp_path, "a.ply", mark + data.replace(b"\n", end.encode()) + body)
    assert mesh.vertices.ravel().tolist() == [np.frombuffer(b"\n\n\n\n", "<f4")[0], *range(8)]


def test_texture_coordinates_at_corners_in_text(tmp_path):
    """MeshLab's way: two images, a list of 2 n numbers on each face, and a number that names the image."""
    for name, color in (("one.png", (255, 0, 0)), ("the two.png", (0, 255, 0))):
        stream = io.BytesIO()
        Image.new("RGB", (2, 2), color).save(stream, "PNG")
        (tmp_path / name).write_bytes(stream.getvalue())
    body = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 0.5 0 0.5 0.5 1\n3 0 2 3 6 0.25 0.25 1 1 0 1 0\n"
    face = FACE + ", list uchar float texcoord, int texnumber"
    data = ply(body, VERTEX, face, comments="comment TextureFile one.png\ncomment TextureFile the two.png")
    mesh = load(tmp_path, "a.ply", data)
    np.testing.assert_array_equal(mesh.uv[mesh.faces], [[[0, 0], [0.5, 0], [0.5, 0.5]], [[0.25, 0.25], [1, 1], [0, 1]]])
    np.testing.assert_array_equal(mesh.corners[1], [SQUARE[0], SQUARE[2], SQUARE[3]])
    assert [mesh.materials[k].texture[0, 0].tolist() for k in mesh.face_material] == [[0, 1, 0], [1, 0, 0]]
    with pytest.warns(UserWarning, match="texture gone.png does not exist"):
        load(tmp_path, "a.ply", data.replace(b"one.png", b"gone.png"))
    bare = ply("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n", VERTEX, FACE, comments="comment TextureFile one.png")
    with pytest.warns(UserWarning, match="2 faces have no texture coordinates: they are drawn without the texture"):
        mesh = load(tmp_path, "a.ply", bare)
    assert all(mesh.materials[k].texture is None for k in mesh.face_material)
    partly = data.replace(b"3 0 2 3 6 0.25 0.25 1 1 0 1", b"3 0 2 3 0")
    with pytest.warns(UserWarning, match="1 faces have no texture coordinates: they are drawn without the texture"):
        mesh = load(tmp_path, "a.ply", partly)
    assert [mesh.materials[k].texture is None for k in mesh.face_material] == [False, True]


def test_quads_and_concave_polygons_with_texture_coordinates_at_corners(tmp_path):
    u = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    body = "".join(f"{x} {x} {y}\n" for x, y in u)
    body += "4 0 1 2 7 8 9 9 8 9 8 8 9 8\n8 0 1 2 3 4 5 6 7 16 " + " ".join(f"{x} {y}" for x, y in u) + "\n"
    face = FACE + ", list uchar float texcoord"
    mesh = load(tmp_path, "a.ply", ply(body, "vertex 8, float x, float y, float z", face))
    np.testing.assert_array_equal(mesh.uv[mesh.faces[0]], [[9, 9], [8, 9], [8, 8]])
    corners, uv = mesh.corners[2:], mesh.uv[mesh.faces[2:]]
    np.testing.assert_array_equal(uv, corners[:, :, 1:])
    assert np.linalg.det(uv[:, 1:] - uv[:, :1]).sum() / 2 == pytest.approx(7)


@pytest.mark.parametrize("binary", [False, True])
def test_strips(tmp_path, binary):
    strip = [0, 1, 2, 3, -1, 3, 1, 0, -1, 2, 2, 3, 0]
    if binary:
        body = b"".join(struct.pack("<3f", *corner) for corner in SQUARE) + struct.pack("<14i", len(strip), *strip)
    else:
        body = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE) + f"{len(strip)} {' '.join(map(str, strip))}\n"
    encoding = "binary_little_endian" if binary else "ascii"
    mesh = load(tmp_path, "a.ply", ply(body, VERTEX, "tristrips 1, list int int vertex_indices", encoding=encoding))
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [1, 3, 2], [3, 1, 0], [2, 0, 3]])


def srgb(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize(
    ("kind", "values", "expected"),
    [
        ("ushort", "65535 32768 0", (1, srgb(32768 / 65535), 0)),
        ("uint16", "200 100 0", (srgb(200 / 65535), srgb(100 / 65535), 0)),
        ("uchar", "255 128 1", (1, srgb(128 / 255), srgb(1 / 255))),
        ("int", "255 128 1", (1, srgb(128 / 255), srgb(1 / 255))),
        ("float", "1 0.5 0", (1, srgb(0.5), 0)),
        ("float", "1.02 0.5 0", (1, srgb(0.5), 0)),
        ("double", "255 127.5 51", (1, srgb(0.5), srgb(0.2))),
    ],
)
@pytest.mark.parametrize("names", ["red green blue", "r g b", "diffuse_red diffuse_green diffuse_blue"])
def test_types_of_colors(tmp_path, kind, values, expected, names):
    vertex = VERTEX.replace("4", "3") + "".join(f", {kind} {name}" for name in names.split())
    body = "".join(f"{x} {y} {z} {values}\n" for x, y, z in CORNERS) + "3 0 1 2\n"
    mesh = load(tmp_path, "a.ply", ply(body, vertex, "face 1, list uchar int vertex_indices"))
    np.testing.assert_allclose(mesh.colors, [expected] * 3, atol=1e-12)
    assert mesh.materials[0].color == (1, 1, 1)


def test_what_of_a_ply_is_not_used_is_said(tmp_path):
    vertex, edge = VERTEX + ", uchar alpha, float quality", "edge 1, int vertex1, int vertex2"
    body = "".join(f"{x} {y} {z} 255 7\n" for x, y, z in SQUARE) + "3 0 1 2\n2 0 1\n0 1\n"
    with pytest.warns(UserWarning) as said:
        mesh = load(tmp_path, "a.ply", ply(body, vertex, FACE, edge))
    assert mesh.triangle_count == 1
    assert [str(one.message).partition("ply: ")[2] for one in said] == [
        "the elements edge are not used",
        "numbers of vertices are not used: quality",
        "1 faces have fewer than 3 corners: they are left out",
    ]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (ply("", "vertex 1, quaternion x"), "names the type 'quaternion'"),
        (ply("", VERTEX, encoding="zipped"), "its format is 'zipped'"),
        (ply("0 0\n", "vertex 1, float x, float y"), "no vertices with x, y and z"),
        (ply("0 0 0\n" * 4 + "3 0 1 4\n3 0 1 2\n", VERTEX, FACE), "faces name vertices 0 to 4, but it has 4"),
        (ply("0 0 0\n" * 4 + "3 0 1 -2\n3 0 1 2\n", VERTEX, FACE), "faces name vertices -2 to 2"),
        (ply("0 0 0\n" * 4 + "3 0 1 2\n3 0 1\n", VERTEX, FACE), "rows are missing"),
        (ply("0 0 0\n" * 4 + "3 0 1 2\n-3 0 1\n", VERTEX, FACE), "a list without a length"),
        (ply("0 0 x\n" * 4, VERTEX), "could not convert"),
        (ply("", "vertex 99999999999, float x, float y, float z"), "rows are missing"),
    ],
)
def test_ply_that_is_refused(tmp_path, data, said):
    with pytest.raises(InputError, match=said):
        load(tmp_path, "a.ply", data)


FACET = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n"


@pytest.mark.parametrize(
    "text",
    [
        f"solid a\n{FACET}endsolid a\n",
        f"solid a\n{FACET}endsolid a\n".upper(),
        f"solid a\n{FACET}end solid a",
        f"Solid vertex facet\n{FACET}EndSolid",
        f"solid vertex 1 2 3 facet normal\n{FACET}endsolid",
        f"solid {' '.join(FACET.split())} endsolid",
        f"solid\n{FACET}endsolid\n".replace("\n", "\r"),
        f"solid\n{FACET}endsolid\n".replace("\n", "\r\n\t"),
        f"\ufeffsolid\n{FACET}endsolid\n",
        f"solid\n{FACET}endsolid\n".replace("vertex 1 0 0", "vertex +1.000E+000 -0.0 0"),
        f"solid\n{FACET}endsolid\n".replace("endfacet", "end facet").replace("endloop", "end loop"),
        f"solid\n{FACET}endsolid\n\n\0\0\0",
    ],
)
def test_stl_as_text(tmp_path, text):
    np.testing.assert_array_equal(load(tmp_path, "a.stl", text).corners, [CORNERS])


def test_several_solids_and_facets_of_four(tmp_path):
    square = FACET.replace("  vertex 0 1 0\n", "  vertex 1 1 0\n  vertex 0 1 0\n")
    mesh = load(tmp_path, "a.stl", f"solid a\n{FACET}endsolid a\nsolid b\n{square}{FACET}endsolid b\n")
    np.testing.assert_array_equal(mesh.corners[0], CORNERS)
    np.testing.assert_array_equal(mesh.corners[1:3], [[SQUARE[k] for k in face] for face in ((0, 1, 2), (0, 2, 3))])
    assert mesh.triangle_count == 4


def stl(words, header: bytes = b"made by hand") -> bytes:
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *np.ravel(CORNERS), word) for word in words)
    return header.ljust(80, b"\0") + struct.pack("<I", len(words)) + body


@pytest.mark.parametrize("header", [b"made by hand", b"solid with facet normal in its name", b"\x00"])
def test_binary_stl(tmp_path, header):
    for tail in (b"", b"\n", b"\0" * 10):
        np.testing.assert_array_equal(load(tmp_path, "a.stl", stl([0, 0], b"made") + tail).corners, [CORNERS] * 2)
    assert load(tmp_path, "a.stl", stl([0], header)).colors is None
    with pytest.warns(UserWarning, match="3 bytes behind the last triangle"):
        load(tmp_path, "a.stl", stl([0, 0]) + b"abc")


def test_colors_of_binary_stl(tmp_path):
    """Five bits each: red above green above blue where the highest bit is set; Magics has them the other way round."""
    red, blue, none = 0x8000 | 31 << 10, 0x8000 | 31, 0
    mesh = load(tmp_path, "a.stl", stl([red, blue, none, 0x8000 | 15 << 5]))
    gray = 0.8
    expected = [(1, 0, 0), (0, 0, 1), (gray,) * 3, (0, srgb(15 / 31), 0)]
    np.testing.assert_allclose(mesh.colors, np.repeat(expected, 3, axis=0), atol=1e-3)
    mesh = load(tmp_path, "a.stl", stl([31, 31 << 10, 0x8000], b"COLOR=\x80\xff\x00\xff,MATERIAL="))
    expected = [(1, 0, 0), (0, 0, 1), (srgb(128 / 255), 1, 0)]
    np.testing.assert_allclose(mesh.colors, np.repeat(expected, 3, axis=0), atol=1e-12)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("solid a\nendsolid a\n", "no triangles"),
        (f"solid\n{FACET}", "cut off"),
        (f"solid\n{FACET}{FACET[:60]}", "cut off"),
        (f"solid\n{FACET.replace('  vertex 0 1 0', '')}endsolid\n", "without three corners"),
        (
            f"solid\n{FACET.replace('vertex 1 0 0', 'vertex 1 0,5 0')}endsolid\n",
            "line 5: 'vertex 1 0,5 0' is not three numbers",
        ),
        (stl([0, 0])[:-1], "neither a whole binary nor a whole text file"),
    ],
)
def test_stl_that_is_refused(tmp_path, data, said):
    with pytest.raises(InputError, match=said):
        load(tmp_path, "a.stl", data)
