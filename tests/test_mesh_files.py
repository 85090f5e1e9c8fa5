"""Meshes written by other programs' libraries, in every form that they write, read back equal."""

import itertools
from dataclasses import dataclass
from typing import Any

import cv2
import meshio
import numpy as np
import plyfile
import pytest
import trimesh
from trimesh.visual import ColorVisuals, TextureVisuals

from mpcam import Mesh, load_mesh


@dataclass
class Truth:
    """What is in a file: faces as lists of vertices, and numbers per vertex that float32 and decimals keep."""

    vertices: np.ndarray
    faces: list[list[int]]
    normals: np.ndarray
    uv: np.ndarray
    colors: np.ndarray  # bytes, sRGB

    @property
    def triangles(self) -> np.ndarray:
        return np.array([[face[0], face[k], face[k + 1]] for face in self.faces for k in range(1, len(face) - 1)])


def truth(kind: str, seed: int = 0) -> Truth:
    """A bumpy grid of triangles, of quads or of both; or regular polygons of 3 to 8 corners that lie about."""
    rng = np.random.default_rng(seed)
    faces: list[list[int]] = []
    if kind == "polygons":
        rings = []
        for corners in (3, 8, 5, 4, 6, 7):
            basis = np.linalg.qr(rng.standard_normal((3, 3)))[0][:2]
            angle = np.arange(corners) * (2 * np.pi / corners)
            faces.append([sum(map(len, rings)) + k for k in range(corners)])
            rings.append(np.stack([np.cos(angle), np.sin(angle)], axis=1) @ basis + rng.integers(-5, 5, 3))
        vertices = np.concatenate(rings).astype(np.float32).astype(np.float64)
    else:
        count = 5
        x, y = (values.ravel() for values in np.meshgrid(np.arange(count), np.arange(count)))
        vertices = np.stack([x, y, rng.integers(-8, 8, count * count) / 64], axis=1).astype(np.float64)
        for number in range((count - 1) ** 2):
            k = number + number // (count - 1)
            quad = [k, k + 1, k + count + 1, k + count]
            whole = kind == "quads" or (kind == "mixed" and number % 3)
            faces += [quad] if whole else [quad[:3], [quad[0], quad[2], quad[3]]]
    normals = rng.standard_normal((len(vertices), 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    uv = rng.integers(0, 64, (len(vertices), 2)) / 64
    return Truth(vertices, faces, normals, uv, rng.integers(0, 256, (len(vertices), 3)).astype(np.uint8))


def linear(encoded: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, one number at a time."""
    one = np.vectorize(lambda c: c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4, otypes=[float])
    return one(encoded)


def check(mesh: Mesh, given: Truth, normals: Any = None, uv: Any = None, colors: Any = None) -> None:
    """The same triangles in the same order, with the same numbers at their corners."""
    corners = given.triangles
    np.testing.assert_allclose(mesh.corners, given.vertices[corners], rtol=0, atol=1e-6)
    for found, expected, tolerance in ((mesh.normals, normals, 1e-6), (mesh.uv, uv, 1e-6), (mesh.colors, colors, 1e-6)):
        if expected is None:
            assert found is None
            continue
        assert found is not None
        expected = expected if expected.ndim == 3 else expected[corners]
        np.testing.assert_allclose(found[mesh.faces], expected, rtol=0, atol=tolerance)


YES_NO = (False, True)
KINDS = ("triangles", "quads", "mixed", "polygons")


@pytest.mark.parametrize("encoding", ["text", "<", ">"])
@pytest.mark.parametrize("kind", KINDS)
def test_ply_by_plyfile(tmp_path, encoding, kind):
    """Thirty files of each: with and without normals, texture coordinates, and colors of every type."""
    given = truth(kind)
    for number, (normals, uv, colors) in enumerate(
        itertools.product(YES_NO, ("", "vertex", "corner"), ("", "u1", "u2", "f4", "face"))
    ):
        fields = [("x", "f8"), ("y", "f4"), ("z", "f8")] + [(name, "f4") for name in ("nx", "ny", "nz") if normals]
        fields += [(name, "f4") for name in ("s", "t") if uv == "vertex"]
        names = ("red", "green", "blue")
        fields += [(name, colors) for name in names if colors not in ("", "face")]
        rows = np.zeros(len(given.vertices), fields)
        for k, name in enumerate("xyz"):
            rows[name] = given.vertices[:, k]
            if normals:
                rows["n" + name] = given.normals[:, k]
        if uv == "vertex":
            rows["s"], rows["t"] = given.uv.T
        encoded = given.colors / 255
        if colors == "u2":
            encoded = given.colors.astype(np.uint16) * 256 / 65535
        for k, name in enumerate(names):
            if colors == "u1":
                rows[name] = given.colors[:, k]
            elif colors == "u2":
                rows[name] = given.colors[:, k].astype(np.uint16) * 256
            elif colors == "f4":
                rows[name] = given.colors[:, k] / 255
        face_fields: list[tuple[str, Any]] = [("vertex_indices", "O")]
        face_fields += [("texcoord", "O")] if uv == "corner" else []
        face_fields += [(name, "u1") for name in names if colors == "face"]
        faces = np.zeros(len(given.faces), face_fields)
        faces["vertex_indices"] = [None] * len(faces)
        corner_uv, face_color = [], []
        for k, face in enumerate(given.faces):
            faces["vertex_indices"][k] = np.array(face, "i4")
            own = given.uv[face] + k
            corner_uv += [[own[0], own[j], own[j + 1]] for j in range(1, len(face) - 1)]
            face_color += [given.colors[k % 20]] * (len(face) - 2)
            if uv == "corner":
                faces["texcoord"][k] = own.ravel().astype("f4")
            if colors == "face":
                for j, name in enumerate(names):
                    faces[name][k] = given.colors[k % 20, j]
        elements = [
            plyfile.PlyElement.describe(rows, "vertex"),
            plyfile.PlyElement.describe(faces, "face", len_types={"texcoord": "u1"}, val_types={"texcoord": "f4"}),
        ]
        file = tmp_path / f"{number}.ply"
        plyfile.PlyData(elements, text=encoding == "text", byte_order="=" if encoding == "text" else encoding).write(
            str(file)
        )
        expected = None
        if colors == "face":
            expected = np.repeat(linear(np.array(face_color) / 255)[:, None], 3, axis=1)
        elif colors:
            expected = linear(encoded)
        coordinates = {"": None, "vertex": given.uv, "corner": np.array(corner_uv)}[uv]
        check(load_mesh(file), given, given.normals if normals else None, coordinates, expected)


def as_trimesh(given: Truth, normals: bool, uv: bool, colors: bool) -> Any:
    mesh = trimesh.Trimesh(
        given.vertices, given.triangles, vertex_normals=given.normals if normals else None, process=False
    )
    if uv:
        mesh.visual = TextureVisuals(uv=given.uv)
    elif colors:
        mesh.visual = ColorVisuals(mesh, vertex_colors=given.colors)
    return mesh


@pytest.mark.filterwarnings("ignore:.*material:UserWarning")
@pytest.mark.parametrize("kind", ["ply", "ply-text", "obj", "glb", "gltf"])
def test_by_trimesh(tmp_path, kind):
    for seed, normals, uv, colors in itertools.product(range(2), YES_NO, YES_NO, YES_NO):
        given = truth("triangles", seed)
        mesh = as_trimesh(given, normals, uv, colors)
        file = tmp_path / f"a.{kind[:4].rstrip('-')}"
        if kind.startswith("ply"):
            encoding = "ascii" if kind == "ply-text" else "binary"
            data = mesh.export(file_type="ply", encoding=encoding, vertex_normal=normals)
        elif kind == "gltf":
            for name, data in mesh.export(file_type="gltf", include_normals=normals).items():
                (tmp_path / name).write_bytes(data)
            data = (tmp_path / "model.gltf").read_bytes()
        else:
            data = mesh.export(file_type=kind, include_normals=normals)
        file.write_bytes(data if isinstance(data, bytes) else data.encode())
        tint = None
        if colors and not uv:
            # glTF's colors are linear, and trimesh writes what it has
            tint = given.colors / 255 if kind.startswith("gl") else linear(given.colors / 255)
        check(load_mesh(file), given, given.normals if normals else None, given.uv if uv else None, tint)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_stl_by_trimesh(tmp_path, kind):
    for seed in range(5):
        given = truth("triangles", seed)
        data = as_trimesh(given, False, False, False).export(file_type=kind)
        (tmp_path / "a.stl").write_bytes(data if isinstance(data, bytes) else data.encode())
        check(load_mesh(tmp_path / "a.stl"), given)


@pytest.mark.parametrize("kind", KINDS[:3])
@pytest.mark.parametrize("form", ["ply-text", "ply", "stl-text", "stl", "obj"])
def test_by_meshio(tmp_path, form, kind, capsys):
    for seed in range(3):
        given = truth(kind, seed)
        groups = itertools.groupby(given.faces, key=len)
        cells = [({3: "triangle", 4: "quad"}[size], np.array(list(faces))) for size, faces in groups]
        if form.startswith("stl"):
            cells = [("triangle", given.triangles)]
        mesh = meshio.Mesh(given.vertices, cells)
        file = tmp_path / f"a.{form[:3]}"
        options: dict[str, Any] = {} if form == "obj" else {"binary": not form.endswith("text")}
        meshio.write(file, mesh, **options)
        capsys.readouterr()
        check(load_mesh(file), given)


@pytest.mark.parametrize("kind", ["obj", "ply"])
def test_by_opencv(tmp_path, kind):
    for seed, normals in itertools.product(range(5), YES_NO):
        given = truth("triangles", seed)
        file = tmp_path / f"a.{kind}"
        points, directions = (values.astype(np.float32)[None] for values in (given.vertices, given.normals))
        options = {"normals": directions} if normals else {}
        cv2.saveMesh(str(file), points, given.triangles.astype(np.int32), **options)
        if kind == "obj" and normals:
            # its faces do not name the normals that it writes
            with pytest.warns(UserWarning, match="no face names a normal: the 25 vn lines"):
                check(load_mesh(file), given)
        else:
            check(load_mesh(file), given, given.normals if normals else None)


def test_ply_by_mitsuba(tmp_path):
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    for seed, normals, uv in itertools.product(range(3), YES_NO, YES_NO):
        given = truth("triangles", seed)
        counts = len(given.vertices), len(given.triangles)
        mesh: Any = mitsuba.Mesh("a", *counts, has_vertex_normals=normals, has_vertex_texcoords=uv)
        parts = mitsuba.traverse(mesh)
        parts["vertex_positions"] = given.vertices.astype(np.float32).ravel()
        parts["faces"] = given.triangles.astype(np.uint32).ravel()
        if normals:
            parts["vertex_normals"] = given.normals.astype(np.float32).ravel()
        if uv:
            parts["vertex_texcoords"] = given.uv.astype(np.float32).ravel()
        parts.update()
        mesh.write_ply(str(tmp_path / "a.ply"))
        check(load_mesh(tmp_path / "a.ply"), given, given.normals if normals else None, given.uv if uv else None)
