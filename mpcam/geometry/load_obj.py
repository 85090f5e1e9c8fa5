"""Wavefront OBJ, read line by line: the file's own order of vertices and faces is kept, and no face is lost."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.load_colors import linear_colors
from mpcam.geometry.load_obj_looks import dress
from mpcam.geometry.load_text import Say, decode_text
from mpcam.geometry.mesh import Material, Mesh
from mpcam.geometry.polygons import triangulate

_WORDS = {"v": "vertex", "vt": "texture coordinate", "vn": "normal"}
# Lines that say nothing of the shape and the color of faces.
_SILENT = {"g", "o", "s", "vp", "lod", "mg", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj"}


@dataclass
class _Rows:
    """The lines of a file by kind; used: the number of the name in force at each face, -1 before the first."""

    v: list[list[str]] = field(default_factory=list)
    vt: list[list[str]] = field(default_factory=list)
    vn: list[list[str]] = field(default_factory=list)
    corners: list[str] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    used: list[int] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)


def load_obj(path: Path, say: Say) -> Mesh:
    """Reads an OBJ file with its materials.

    Without vt and vn, vertices are those of the file in order; with them, one vertex per combination that occurs, in
    the order of the positions. Vertex colors are taken as sRGB, Kd as linear. Raises InputError, with the line, for
    what cannot be read; say is told of what is missing or not used.
    """
    rows = _rows(path, say)
    position = _columns(rows.v, 3, path, "v")
    texcoord = _columns(rows.vt, 2, path, "vt", fill=0.0)
    normal = _columns(rows.vn, 3, path, "vn")
    colors = _colors(rows.v, path, say)
    index = _indices(rows.corners, path)
    for column, (name, table) in enumerate((("v", position), ("vt", texcoord), ("vn", normal))):
        named = index[:, column]
        if name == "vn" and len(table) and np.all(named == -1):
            say(f"no face names a normal: the {len(table)} vn lines are not used")
        if column and len(table) == 0 and np.any(named != -1):
            say(f"faces name {name} numbers, but the file has no {name} lines: they are left out")
            named[:] = -1
        if named.max() >= len(table):
            raise InputError(f"{path}: a face names {name} number {named.max() + 1}, but the file has {len(table)}")
        if named.min() < -1:
            raise InputError(f"{path}: a face counts back past the first {_WORDS[name]} of the file")
    if index[:, 0].min() < 0:
        raise InputError(f"{path}: a face corner has no vertex number, or 0; OBJ vertex numbers start at 1")

    counts = np.array(rows.counts)
    corner_of_face, face_of = triangulate(counts, position[index[:, 0]], say)
    plain = Material() if colors is None else Material((1.0, 1.0, 1.0))
    texcoord, materials, material_of = dress(
        path, rows.libraries, rows.names, rows.used, counts, texcoord, index, plain, say
    )
    look = {"materials": materials, "face_material": material_of[face_of] if len(materials) > 1 else None}
    if index[:, 1:].max() < 0:
        return Mesh(position, index[corner_of_face, 0], colors=colors, **look)
    return _combined(position, texcoord, normal, colors, index, corner_of_face, look)


def _combined(position, texcoord, normal, colors, index, corner_of_face, look) -> Mesh:
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
    faces = inverse.reshape(-1)[corner_of_face]
    tint = None if colors is None else colors[rows[:, 0]]
    return Mesh(position[rows[:, 0]], faces, normals=normals, uv=uv, colors=tint, **look)


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines with their numbers; one that ends in a backslash goes on in the next, unless it is a comment."""
    held = ""
    for number, line in enumerate(text.split("\n"), 1):
        line = held + line
        bare = line.rstrip()
        if bare.endswith("\\") and not bare.lstrip().startswith("#"):
            held = bare[:-1] + " "
            continue
        held = ""
        yield number, line
    if held:
        yield number, held


def _rows(path: Path, say: Say) -> _Rows:
    rows = _Rows()
    tables = {"v": rows.v, "vt": rows.vt, "vn": rows.vn}
    current, unknown = -1, {}
    for number, line in _lines(decode_text(path.read_bytes())):
        parts = line.split()
        if not parts or parts[0].startswith("#"):
            continue
        key = parts[0]
        if key == "usemtl":
            current = rows.names.setdefault(line.split(None, 1)[1].strip() if len(parts) > 1 else "", len(rows.names))
        elif key == "mtllib":
            rows.libraries.append(line.split(None, 1)[1].strip() if len(parts) > 1 else "")
        elif key in tables or key in ("f", "fo"):
            if "#" in line:
                parts = line.partition("#")[0].split()
            if key in tables:
                tables[key].append(parts[1:])
                continue
            if len(parts) < 4:
                raise InputError(f"{path} line {number}: a face has {len(parts) - 1} corners; it needs at least 3")
            rows.corners += _from_start(parts[1:], tuple(tables.values())) if "-" in line else parts[1:]
            rows.counts.append(len(parts) - 1)
            rows.used.append(current)
        elif key not in _SILENT:
            unknown.setdefault(key, number)
    if not rows.counts:
        what = "only points" if rows.v else "no geometry"
        raise InputError(f"{path} holds {what}: a mesh needs faces, in OBJ the lines that begin with f")
    if unknown:
        lines = ", ".join(f"{key[:20]!r} (line {number})" for key, number in list(unknown.items())[:5])
        say(f"lines that begin with {lines} are not used")
    return rows


def _from_start(parts: list[str], tables: tuple[list, ...]) -> list[str]:
    """Corners with indices that count back from the latest row, rewritten to count from the start of the file."""
    result = []
    for part in parts:
        pieces = part.split("/")
        for k, table in zip(range(len(pieces)), tables, strict=False):
            if re.fullmatch(r"-\d+", pieces[k]):
                number = len(table) + 1 - int(pieces[k][1:])
                # 0 stands for none; before the first row is below
                pieces[k] = str(number if number > 0 else number - 1)
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
        wrong = next((c for c in corners if not re.fullmatch(r"[+-]?\d+(/[+-]?\d*){0,2}", c)), max(corners, key=len))
        raise InputError(
            f"{path}: the face corner {wrong[:40]!r} is not of the form v, v/vt, v//vn or v/vt/vn"
        ) from None
    return index


def _columns(rows: list[list[str]], width: int, path: Path, name: str, fill: float | None = None) -> np.ndarray:
    """(N, width) floats from the first columns of each row; short rows are filled up, or are an error."""
    if not rows:
        return np.zeros((0, width))
    shortest = min(len(row) for row in rows)
    if shortest < width:
        if fill is None or shortest == 0:
            line = " ".join([name, *min(rows, key=len)])
            raise InputError(f"{path}: the line {line!r} has {shortest} numbers; it needs {width}")
        rows = [row + [str(fill)] * (width - len(row)) for row in rows]
    try:
        return np.array([row[:width] for row in rows], dtype=np.float64)
    except ValueError:
        wrong = next(word for row in rows for word in row[:width] if not _is_number(word))
        raise InputError(f"{path}: a {name} line holds {wrong[:40]!r}, which is not a number") from None


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _colors(rows: list[list[str]], path: Path, say: Say) -> np.ndarray | None:
    """Linear colors (V, 3) where vertex lines have three more numbers than a place; those that have none are white."""
    colored = np.array([len(row) >= 6 for row in rows])
    if not colored.any():
        return None
    if not colored.all():
        say(f"{np.count_nonzero(~colored)} of {len(rows)} vertices have no color: they are white")
    colors = np.ones((len(rows), 3))
    colors[colored] = linear_colors(_columns([row[3:6] for row in rows if len(row) >= 6], 3, path, "v"), say)
    return colors
