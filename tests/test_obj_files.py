"""OBJ and MTL as people have them: encodings, line ends, names, options, and what is missing from them."""

import codecs
import io
import warnings
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mpcam import InputError, load_mesh

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TEXTURED = TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\n"
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def png(color=(255, 255, 255)) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), color).save(stream, "PNG")
    return stream.getvalue()


def load(folder, text, **files) -> Any:
    """The mesh of a text; files: names with _ for the dot, and their content."""
    for name, content in files.items():
        data = content if isinstance(content, bytes) else content.encode()
        (folder / name.replace("_", ".")).write_bytes(data)
    (folder / "mesh.obj").write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_mesh(folder / "mesh.obj")


ENCODINGS = {
    "utf-8": lambda text: codecs.BOM_UTF8 + text.encode(),
    "utf-16-le": lambda text: codecs.BOM_UTF16_LE + text.encode("utf-16-le"),
    "utf-16-be": lambda text: codecs.BOM_UTF16_BE + text.encode("utf-16-be"),
    "utf-32-le": lambda text: codecs.BOM_UTF32_LE + text.encode("utf-32-le"),
    "utf-16-le, no mark": lambda text: text.encode("utf-16-le"),
    "utf-16-be, no mark": lambda text: text.encode("utf-16-be"),
    "latin-1": lambda text: text.encode("latin-1"),
    "cr": lambda text: text.replace("\n", "\r").encode(),
    "crlf": lambda text: text.replace("\n", "\r\n").encode(),
}


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_encodings_and_line_ends(tmp_path, encoding):
    encode = ENCODINGS[encoding]
    (tmp_path / "gr\u00fcn.png").write_bytes(png((0, 255, 0)))
    mesh = load(
        tmp_path,
        encode("v 9 9 9\n" + TEXTURED.replace("\n", " \n") + "mtllib a.mtl\nusemtl gr\u00fcn\nf 2/1 3/2 \\\n 4/3\n"),
        a_mtl=encode("newmtl gr\u00fcn\nKd 1 1 1\nmap_Kd gr\u00fcn.png\n"),
    )
    np.testing.assert_array_equal(mesh.corners, [CORNERS])
    np.testing.assert_array_equal(mesh.uv[mesh.faces], [[[0, 0], [1, 0], [0, 1]]])
    assert mesh.materials[0].name == "gr\u00fcn" and mesh.materials[0].texture[0, 0].tolist() == [0, 1, 0]


def test_a_comment_that_ends_in_a_backslash_is_one_line(tmp_path):
    mesh = load(tmp_path, "# C:\\models\\\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    np.testing.assert_array_equal(mesh.corners, [CORNERS])


def test_comments_touching_numbers(tmp_path):
    mesh = load(tmp_path, "v 0 0 0#a\nv 1 0 0 # b c d\nv 0 1 0\nvn 0 0 1#n\nf 1//1 2//1 3//1#end\n")
    np.testing.assert_array_equal(mesh.corners, [CORNERS])
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 3)
    assert mesh.colors is None


def srgb(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["1.02 0.9 0.8", "1 0.9 0.8", "1 0.9 0.8"], [srgb(1), srgb(0.9), srgb(0.8)]),
        (["0.5 0.25 0", "1 1 1", "0 0 0"], [srgb(0.5), srgb(0.25), 0]),
        (["0 0 1", "1 0 0", "0 1 0"], [0, 0, 1]),
        (["255 128 64", "255 0 0", "12 0 0"], [1, srgb(128 / 255), srgb(64 / 255)]),
        (["127.5 20.25 10.5", "99.5 11.5 12.5", "200.5 30.5 60.5"], [srgb(0.5), srgb(20.25 / 255), srgb(10.5 / 255)]),
        (["3 2 0", "0 1 0", "0 0 0"], [srgb(3 / 255), srgb(2 / 255), 0]),
        (["1 0.5 0 0.25", "1 1 1 1", "0 0 0 1"], [1, srgb(0.5), 0]),
    ],
)
def test_ranges_of_vertex_colors(tmp_path, rows, expected):
    text = "".join(f"v {corner[0]} {corner[1]} {corner[2]} {row}\n" for corner, row in zip(CORNERS, rows, strict=True))
    mesh = load(tmp_path, text + "f 1 2 3\n")
    np.testing.assert_allclose(mesh.colors[mesh.faces[0, 0]], expected, atol=1e-12)


def test_one_bright_color_does_not_darken_all(tmp_path):
    with pytest.warns(UserWarning, match="vertex colors run from 0 to 12.5"):
        mesh = load(tmp_path, "v 0 0 0 12.5 0 0\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0 0.5 0.5 0.5\nf 1 2 3\n")
    np.testing.assert_allclose(mesh.colors, [[1, 0, 0], [srgb(0.5)] * 3, [srgb(0.5)] * 3])


def test_vertices_without_color_are_said(tmp_path):
    with pytest.warns(UserWarning, match="1 of 3 vertices have no color"):
        mesh = load(tmp_path, "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0\nf 1 2 3\n")
    np.testing.assert_array_equal(mesh.colors, [[1, 0, 0], [0, 1, 0], [1, 1, 1]])


@pytest.mark.parametrize(
    "line",
    [
        "one.mtl two.mtl",
        '"one.mtl" two.mtl # both',
        "sub/../one.mtl .\\two.mtl",
        "ONE.mtl C:\\Users\\me\\two.mtl",
        "one.mtl\nmtllib two.mtl",
        "with space.mtl one.mtl two.mtl",
        '"with space.mtl" one.mtl two.mtl',
    ],
)
def test_names_on_mtllib(tmp_path, line):
    (tmp_path / "sub").mkdir()
    (tmp_path / "with space.mtl").write_text("newmtl green\nKd 0 1 0\n")
    files = {"one_mtl": "newmtl red\nKd 1 0 0\n", "two_mtl": "newmtl blue\nKd 0 0 1\n"}
    mesh = load(tmp_path, f"mtllib {line}\n{TRIANGLE}usemtl blue\nf 1 2 3\nusemtl red # too\nf 3 2 1\n", **files)
    assert [mesh.materials[k].color for k in mesh.face_material] == [(0, 0, 1), (1, 0, 0)]


def test_a_library_with_spaces_alone_on_its_line(tmp_path):
    (tmp_path / "my  own file.mtl").write_text("newmtl green\nKd 0 1 0\n")
    assert load(tmp_path, f"mtllib my  own file.mtl\n{TRIANGLE}usemtl green\nf 1 2 3\n").materials[0].color == (0, 1, 0)


def test_first_library_that_has_a_name_wins(tmp_path):
    files = {"one_mtl": "newmtl a\nKd 1 0 0\n", "two_mtl": "newmtl a\nKd 0 0 1\n"}
    mesh = load(tmp_path, f"mtllib one.mtl two.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n", **files)
    assert mesh.materials[0].color == (1, 0, 0)


@pytest.mark.parametrize("name", ["Material #25", "a#b", "two words", "red"])
def test_names_of_materials(tmp_path, name):
    library = f"newmtl other\nKd 0 0 1\nnewmtl {name}\t\nKd 1 0 0\nnewmtl Material #2\nKd 0 1 0\n"
    mesh = load(tmp_path, f"mtllib a.mtl\n{TRIANGLE}usemtl {name}  \nf 1 2 3\n", a_mtl=library)
    assert mesh.materials[0].color == (1, 0, 0)


def test_materials_that_are_in_no_library_are_said(tmp_path):
    for text, library in (("mtllib a.mtl\n", "newmtl a\nKd 1 0 0\n"), ("", "")):
        with pytest.warns(UserWarning, match="material nowhere is in no material file"):
            mesh = load(tmp_path, f"{text}{TRIANGLE}usemtl nowhere\nf 1 2 3\n", a_mtl=library)
        assert mesh.materials[0].color == (0.8, 0.8, 0.8) and mesh.materials[0].name == "nowhere"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ("-s 4 2 1 -o 0.5 0 0", (4, 2, 0.5, 0)),
        ("-o -0.25 0.5", (1, 1, -0.25, 0.5)),
        ("-s 3", (3, 1, 0, 0)),
        ("-S 2 3 -blendu off -blendv on -boost 2 -texres 512 -imfchan l -bm 1 -cc off", (2, 3, 0, 0)),
        ("-mm 0 1 -t 0 0 0 -s 2 2 2", (2, 2, 0, 0)),
        ("", (1, 1, 0, 0)),
    ],
)
@pytest.mark.parametrize("name", ["a b.png", '"a b.png"', "sub\\..\\a b.png", "A B.PNG # skin"])
def test_options_of_map_kd(tmp_path, options, expected, name):
    (tmp_path / "a b.png").write_bytes(png())
    (tmp_path / "sub").mkdir()
    su, sv, ou, ov = expected
    mesh = load(
        tmp_path,
        f"mtllib a.mtl\n{TEXTURED}usemtl plain\nf 1/1 2/2 3/3\nusemtl skin\nf 1/1 2/2 3/3\n"
        "usemtl plain\nf 3/3 2/2 1/1\n",
        a_mtl=f"newmtl plain\nnewmtl skin\nKd 1 1 1\nmap_Kd {options} {name}\n",
    )
    uv = mesh.uv[mesh.faces]
    np.testing.assert_array_equal(uv[0], [[0, 0], [1, 0], [0, 1]])
    np.testing.assert_array_equal(uv[1], [[ou, ov], [su + ou, ov], [ou, sv + ov]])
    np.testing.assert_array_equal(uv[2], [[0, 1], [1, 0], [0, 0]])
    assert mesh.materials[mesh.face_material[1]].texture is not None


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("map_Kd -clamp on -s 2 2 a.png", "clamped"),
        ("map_Kd -t 0.5 0 0 a.png", "turbulence"),
        ("map_Kd -mm 0.1 2 a.png", "-mm"),
        ("map_Kd -twist 3 a.png", "-twist, which is not known"),
        ("map_Kd gone.png", "texture gone.png does not exist"),
        ("map_Kd a.mtl", "a.mtl is not a readable image"),
        ("map_Kd a.png\nd 0.5", "transparent"),
        ("map_Kd a.png\nmap_d a.png", "transparent"),
    ],
)
def test_what_of_a_material_is_not_used_is_said(tmp_path, line, said):
    text = f"mtllib a.mtl\n{TEXTURED}usemtl skin\nf 1/1 2/2 3/3\n"
    with pytest.warns(UserWarning, match=said):
        load(tmp_path, text, a_png=png(), a_mtl=f"newmtl skin\n{line}\n")


def test_clamped_inside_and_opaque_say_nothing(tmp_path):
    text = f"mtllib a.mtl\n{TEXTURED}usemtl skin\nf 1/1 2/2 3/3\n"
    library = "newmtl skin # the only one\nmap_Kd -clamp on a.png\nd 1.0\nKs 1 1 1\nillum 2\n"
    mesh = load(tmp_path, text, a_png=png(), a_mtl=library)
    # an image without Kd is not made darker
    assert mesh.materials[0].color == (1, 1, 1)


def test_colors_that_are_none(tmp_path):
    for color in ("spectral a.rfl", "xyz 1 1 1", "", "0.5 red 0", "nan 0 0"):
        with pytest.raises(InputError, match=r"a\.mtl line 2: Kd is"):
            load(tmp_path, f"mtllib a.mtl\n{TRIANGLE}f 1 2 3\n", a_mtl=f"newmtl a\nKd {color}\n")
    mesh = load(tmp_path, f"mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n", a_mtl="NEWMTL a\n\tKD 0.5 # dark\n")
    assert mesh.materials[0].color == (0.5, 0.5, 0.5)


@pytest.mark.parametrize(
    ("face", "missing"),
    [("1/1/1 2/2/2 3/3/3", ["vt", "vn"]), ("1//1 2//2 3//3", ["vn"]), ("-3/-1 -2/-1 -1/-1", ["vt"])],
)
def test_faces_that_name_rows_which_are_not_there(tmp_path, face, missing):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mesh = load(tmp_path, f"{TRIANGLE}f {face}\n")
    texts = [f"faces name {name} numbers, but the file has no {name} lines: they are left out" for name in missing]
    assert [str(one.message).partition(": ")[2] for one in said] == texts
    assert all(one.filename == __file__ for one in said)  # where the file was asked for
    np.testing.assert_array_equal(mesh.corners, [CORNERS])
    assert mesh.uv is None and mesh.normals is None


def test_faces_without_texture_coordinates_are_drawn_without_the_texture(tmp_path):
    text = f"mtllib a.mtl\n{TEXTURED}usemtl skin\nf 1/1 2/2 3/3\nf 1 2 3\nf 3/3 2/2 1\n"
    with pytest.warns(UserWarning, match="2 faces of material skin have no texture coordinates"):
        mesh = load(tmp_path, text, a_png=png(), a_mtl="newmtl skin\nKd 0.5 0 0\nmap_Kd a.png\n")
    used = [mesh.materials[k] for k in mesh.face_material]
    assert [material.texture is None for material in used] == [False, True, True]
    assert {material.color for material in used} == {(0.5, 0, 0)}


def test_lines_that_are_not_used_are_said(tmp_path):
    text = f"{TRIANGLE}vn 0 0 1\ng a\ns 1\no b\nl 1 2\np 1\ncurv 0 1 1 2\nf 1 2 3\n"
    with pytest.warns(UserWarning, match="no face names a normal"):
        with pytest.warns(UserWarning, match=r"'l' \(line 8\), 'p' \(line 9\), 'curv' \(line 10\) are not used"):
            load(tmp_path, text)


def test_concave_polygon_keeps_what_stands_at_its_corners(tmp_path):
    corners = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    text = "".join(f"v {x} {y} {2 * x}\nvt {x / 4} {y / 4}\n" for x, y in corners)
    mesh = load(tmp_path, text + "f " + " ".join(f"{k}/{k}" for k in range(1, 9)) + "\n")
    np.testing.assert_array_equal(mesh.uv * 4, mesh.vertices[:, :2])
    edges = mesh.corners[:, 1:, :2] - mesh.corners[:, :1, :2]
    assert np.all(np.linalg.det(edges) > 0) and np.linalg.det(edges).sum() / 2 == pytest.approx(7)
