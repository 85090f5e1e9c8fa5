"""Wavefront OBJ, read line by line: the file's own order of vertices and faces is kept, and no face is lost.

trimesh reads OBJ too, but (5.2.0) takes indices that count backwards from the end of the file, drops the texture
coordinates of all faces where some have none, and reorders faces by material; so this format has its own reader.
"""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.load_image import read_texture
from mpcam.geometry.mesh import Material, Mesh
from mpcam.math.srgb import linear_from_srgb

# how many values follow each option of a map_Kd line
_MAP_OPTIONS = {"-blendu": 1, "-blendv": 1, "-boost": 1, "-mm": 2, "-texres": 1, "-clamp": 1, "-bm": 1, "-imfchan": 1}


def load_obj(path: Path) -> Mesh:
    """Reads an OBJ file with its materials.

    Polygons become fans from their first corner. Without vt and vn, vertices are those of the file in order; with them,
    one vertex per combination that occurs, in the order of the positions. Vertex colors are taken as sRGB, Kd as
    linear. A missing material or texture file is a warning. Raises InputError, with the line, for what cannot be read.
    """
    text = path.read_bytes().decode("utf-8", errors="replace").replace("\\\r\n", " ").replace("\\\n", " ")
    rows: dict[str, list[list[str]]] = {"v": [], "vt": [], "vn": []}
    corners: list[str] = []
    counts: list[int] = []
    used: list[int] = []
    names: dict[str, int] = {}
    libraries: list[str] = []
    current = -1
    for number, line in enumerate(text.split("\n"), 1):
        parts = line.split()
        if not parts:
            continue
        key = parts[0]
        if key in rows:
            rows[key].append(parts[1:])
        elif key == "f":
            parts = _without_comment(parts)[1:]
            if len(parts) < 3:
                raise InputError(f"{path} line {number}: a face has {len(parts)} corners; it needs at least 3")
            corners += _from_start(parts, rows) if "-" in line else parts
            counts.append(len(parts))
            used.append(current)
        elif key == "usemtl":
            current = names.setdefault(" ".join(parts[1:]), len(names))
        elif key == "mtllib":
            libraries.append(line.split(None, 1)[1].strip() if len(parts) > 1 else "")
    if not counts:
        what = "only points" if rows["v"] else "no geometry"
        raise InputError(f"{path} holds {what}: a mesh needs faces, in OBJ the lines that begin with f")

    position, colors = _positions(rows["v"], path)
    texcoord = _columns(rows["vt"], 2, path, "vt", fill=0.0)
    normal = _columns(rows["vn"], 3, path, "vn")
    index = _indices(corners, path)
    for column, (name, table) in enumerate((("v", position), ("vt", texcoord), ("vn", normal))):
        if index[:, column].max(initial=-1) >= len(table):
            top = index[:, column].max() + 1
            raise InputError(f"{path}: a face names {name} number {top}, but the file has {len(table)}")
    if index[:, 0].min() < 0:
        raise InputError(f"{path}: a face corner has no vertex number, or 0; OBJ vertex numbers start at 1")

    corner_of_face, face_of = _fans(np.array(counts))
    material_of = np.array(used)[face_of]
    plain = Material() if colors is None else Material((1.0, 1.0, 1.0))
    materials, material_of = _materials(path, libraries, names, material_of, plain)
    if index[:, 1:].max() < 0:
        mesh = Mesh(position, index[corner_of_face, 0], colors=colors, materials=materials, face_material=material_of)
    else:
        mesh = _combined(position, texcoord, normal, colors, index, corner_of_face, materials, material_of)
    return mesh


def _combined(position, texcoord, normal, colors, index, corner_of_face, materials, material_of) -> Mesh:
    """The mesh with one vertex per combination of position, texture coordinate and normal that occurs."""
    normals = None
    if index[:, 2].max() >= 0:
        # corners without a normal get that of their face; so do normals of length 0
        lengths = np.linalg.norm(normal, axis=1)
        usable = np.isfinite(lengths) & (lengths > 0)
        missing = (index[:, 2] < 0) | ~usable[index[:, 2]]
        own = Mesh(position, index[corner_of_face, 0]).face_normals
        face_of_corner = np.zeros(len(index), np.int64)
        face_of_corner[corner_of_face] = np.arange(len(corner_of_face))[:, None]
        normal = np.concatenate([normal / np.where(usable, lengths, 1.0)[:, None], own])
        index = index.copy()
        index[missing, 2] = len(lengths) + face_of_corner[missing]
    rows, inverse = np.unique(index, axis=0, return_inverse=True)
    if index[:, 2].max() >= 0:
        normals = normal[rows[:, 2]]
    uv = None
    if index[:, 1].max() >= 0:
        uv = np.where(rows[:, 1:2] >= 0, texcoord[rows[:, 1]], 0.0)
    return Mesh(
        position[rows[:, 0]],
        inverse.reshape(-1)[corner_of_face],
        normals=normals,
        uv=uv,
        colors=None if colors is None else colors[rows[:, 0]],
        materials=materials,
        face_material=material_of,
    )


def _without_comment(parts: list[str]) -> list[str]:
    for k, part in enumerate(parts):
        if part.startswith("#"):
            return parts[:k]
    return parts


def _from_start(parts: list[str], rows) -> list[str]:
    """Corners with indices that count back from the latest row, rewritten to count from the start of the file."""
    tables = (rows["v"], rows["vt"], rows["vn"])
    result = []
    for part in parts:
        pieces = part.split("/")
        for k, table in zip(range(len(pieces)), tables, strict=False):
            if pieces[k].startswith("-") and pieces[k][1:].isdigit():
                pieces[k] = str(len(table) + 1 - int(pieces[k][1:]))
        result.append("/".join(pieces))
    return result


def _indices(corners: list[str], path: Path) -> np.ndarray:
    """(C, 3) zero-based numbers of position, texture coordinate and normal; -1 where a corner has none."""
    index = np.full((len(corners), 3), -1, np.int64)
    try:
        if not any("/" in corner for corner in corners):
            index[:, 0] = np.array(corners, dtype=np.int64) - 1
        else:
            pieces = [(corner + "//").split("/")[:3] for corner in corners]
            index[:] = np.array([[int(a), int(b or 0), int(c or 0)] for a, b, c in pieces]) - 1
    except (ValueError, OverflowError):
        raise InputError(f"{path}: a face corner is not of the form v, v/vt, v//vn or v/vt/vn") from None
    if index.min() < -1:
        raise InputError(f"{path}: a face counts back past the first vertex of the file")
    return index


def _columns(rows: list[list[str]], width: int, path: Path, name: str, fill: float | None = None) -> np.ndarray:
    """(N, width) floats from the first columns of each row; short rows are filled up, or are an error."""
    if not rows:
        return np.zeros((0, width))
    shortest = min(len(row) for row in rows)
    if shortest < width:
        if fill is None or shortest == 0:
            raise InputError(f"{path}: a {name} line has {shortest} numbers; it needs {width}")
        rows = [row + [str(fill)] * (width - len(row)) for row in rows]
    try:
        return np.array([row[:width] for row in rows], dtype=np.float64)
    except ValueError:
        raise InputError(f"{path}: a {name} line holds something that is not a number") from None


def _positions(rows: list[list[str]], path: Path) -> tuple[np.ndarray, np.ndarray | None]:
    """Positions (V, 3) and, where every vertex line has three more numbers, linear colors (V, 3)."""
    position = _columns(rows, 3, path, "v")
    if not rows or min(len(row) for row in rows) < 6 or any("#" in "".join(row[3:6]) for row in rows):
        return position, None
    color = _columns([row[3:6] for row in rows], 3, path, "v")
    return position, linear_from_srgb(color / 255.0 if color.max() > 1.0 else color)


def _fans(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corner numbers (F, 3) of the triangles of all polygons, and (F,) the polygon that each comes from."""
    triangles = counts - 2
    polygon = np.repeat(np.arange(len(counts)), triangles)
    first = (np.cumsum(counts) - counts)[polygon]
    step = np.arange(len(polygon)) - (np.cumsum(triangles) - triangles)[polygon]
    return np.stack([first, first + step + 1, first + step + 2], axis=1), polygon


def _materials(path: Path, libraries: list[str], names: dict[str, int], material_of: np.ndarray, plain: Material):
    """The materials in the order of names, and the face materials; the plain one for faces before any usemtl."""
    known: dict[str, Material] = {}
    for library in libraries:
        file = path.parent / library.replace("\\", "/")
        if not file.is_file():
            warnings.warn(f"{path}: material file {library} not found; the mesh is gray", stacklevel=4)
            continue
        known.update(_read_mtl(file))
    materials = [known.get(name, replace(plain, name=name)) for name in names]
    if (material_of < 0).any():
        materials.append(plain)
        material_of = np.where(material_of < 0, len(materials) - 1, material_of)
    return tuple(materials), (material_of if len(materials) > 1 else None)


def _read_mtl(file: Path) -> dict[str, Material]:
    colors: dict[str, tuple[float, ...]] = {}
    images: dict[str, str] = {}
    name = None
    for line in file.read_bytes().decode("utf-8", errors="replace").splitlines():
        parts = line.split()
        if len(parts) < 2:
            continue
        if parts[0] == "newmtl":
            name = " ".join(parts[1:])
            colors[name] = (0.8, 0.8, 0.8)
        elif name is not None and parts[0] == "Kd":
            try:
                values = [max(float(value), 0.0) for value in parts[1:4]]
            except ValueError:
                raise InputError(f"{file}: Kd of material {name} is not numbers: give Kd r g b") from None
            colors[name] = tuple(values) if len(values) == 3 else (values[0],) * 3
        elif name is not None and parts[0].lower() == "map_kd":
            images[name] = _map_file(parts[1:])
    materials = {}
    for name, color in colors.items():
        texture = None
        if images.get(name):
            try:
                texture = read_texture(file.parent / images[name].replace("\\", "/"))
            except InputError as error:
                warnings.warn(f"{error}; material {name} has no texture", stacklevel=5)
            # exporters write a black Kd beside an image and mean the image
            color = (1.0, 1.0, 1.0) if texture is not None and not any(color) else color
        materials[name] = Material((color[0], color[1], color[2]), texture, name)
    return materials


def _map_file(parts: list[str]) -> str:
    """The file name of a map_Kd line, after its options."""
    k = 0
    while k < len(parts) - 1 and parts[k].startswith("-"):
        if parts[k] in ("-o", "-s", "-t"):
            k += 1
            while k < len(parts) - 1 and _is_number(parts[k]):
                k += 1
        else:
            k += 1 + _MAP_OPTIONS.get(parts[k], 0)
    return " ".join(parts[k:])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
