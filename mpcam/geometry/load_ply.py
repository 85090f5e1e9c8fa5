"""PLY: faces as polygons or strips, colors, normals, and texture coordinates per vertex or per corner."""

from pathlib import Path

import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.load_colors import linear_colors
from mpcam.geometry.load_image import read_texture
from mpcam.geometry.load_ply_tables import Table, read_ply
from mpcam.geometry.load_text import Say, find_file
from mpcam.geometry.mesh import Material, Mesh
from mpcam.geometry.polygons import triangulate

_COLORS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
_NORMAL = ("nx", "ny", "nz")
_UV = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))


def load_ply(path: Path, say: Say) -> Mesh:
    """Reads a PLY file: text, or binary of either byte order.

    Vertices are those of the file in order, unless texture coordinates stand at the corners of faces or colors on the
    faces: then one per combination that occurs. Colors are taken as sRGB. Raises InputError or ValueError for what
    cannot be read; say is told of what is missing or not used.
    """
    comments, tables = read_ply(path, say)
    vertex, face = tables.get("vertex", Table(0)), tables.get("face", Table(0))
    unused = [name for name, table in tables.items() if table.count and name not in ("vertex", "face", "tristrips")]
    if unused:
        say(f"the elements {', '.join(unused)} are not used")
    _say_unused("vertices", vertex, say)
    _say_unused("faces", face, say)
    position = _columns(vertex, ("x", "y", "z"))
    if position is None:
        raise InputError(f"{path} has no vertices with x, y and z: it is of another kind")
    faces, corners, polygon = _polygons(face, position, path, say)
    strips = _strips(tables.get("tristrips", Table(0)))
    _check_numbers(np.concatenate([faces.ravel(), strips.ravel()]), len(position), path)
    color, tint = _color(vertex, say), _color(face, say)
    if color is not None and tint is not None:
        say("vertices have colors, and faces too: those of the faces are not used")
        tint = None
    uv, corner_uv = _first(vertex, _UV), _corner_uv(face, corners, polygon)
    materials, material_of = _materials(path, comments, face, polygon, color is not None or tint is not None, say)
    if any(material.texture is not None for material in materials):
        bare = np.full(len(faces), uv is None) if corner_uv is None else np.isnan(corner_uv).any(axis=(1, 2))
        if bare.any():
            count = len(np.unique(polygon[bare]))
            say(f"{count} faces have no texture coordinates: they are drawn without the texture")
            material_of = np.where(bare, len(materials), material_of)
            materials += (Material((1.0, 1.0, 1.0)),)
    material_of = np.concatenate([material_of, np.zeros(len(strips), np.int64)]) if len(materials) > 1 else None
    everything = np.concatenate([faces, strips])
    normals = _normals(vertex, position, everything)
    own, numbers = np.arange(len(position)), everything
    if corner_uv is not None or tint is not None:
        own, numbers, uv, color = _split(everything, corner_uv, tint, polygon, uv, color)
    shading = None if normals is None else normals[own]
    return Mesh(position[own], numbers, shading, uv, color, materials, material_of)


def _split(
    triangles: np.ndarray,
    corner_uv: np.ndarray | None,
    tint: np.ndarray | None,
    polygon: np.ndarray,
    uv: np.ndarray | None,
    color: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, np.ndarray | None]:
    """One vertex per combination of place, texture coordinate at the corner and color of the face that occurs.

    triangles: (F, 3) vertices, those of polygons first. corner_uv: (P, 3, 2) of those. tint: a color for each polygon;
    polygon: (P,) that of each triangle. uv, color: of the file's vertices. Returns the file's vertex of each new one,
    the triangles in new ones, and uv and color of those.
    """
    keys = np.full((triangles.size, 3), -1, np.int64)
    keys[:, 0] = triangles.ravel()
    table = np.zeros((1, 2))
    if corner_uv is not None:
        table, numbers = np.unique(np.nan_to_num(corner_uv).reshape(-1, 2), axis=0, return_inverse=True)
        keys[: len(polygon) * 3, 1] = numbers.reshape(-1)
    if tint is not None:
        tint, numbers = np.unique(tint, axis=0, return_inverse=True)
        keys[: len(polygon) * 3, 2] = np.repeat(numbers.reshape(-1)[polygon], 3)
    rows, inverse = np.unique(keys, axis=0, return_inverse=True)
    own = rows[:, 0]
    if corner_uv is not None:
        uv = np.where(rows[:, 1:2] >= 0, table[rows[:, 1]], 0.0)
    elif uv is not None:
        uv = uv[own]
    if tint is not None:
        color = np.where(rows[:, 2:] >= 0, tint[rows[:, 2]], 1.0)
    elif color is not None:
        color = color[own]
    return own, inverse.reshape(-1, 3), uv, color


def _say_unused(what: str, table: Table, say: Say) -> None:
    """Say what else vertices or faces have; faces need no normals, and an alpha that is opaque is none."""
    used = {"x", "y", "z", *_NORMAL, "texnumber"}.union(*_COLORS, *_UV)
    for name, values in table.columns.items():
        top = np.iinfo(table.kinds[name]).max if table.kinds[name].kind in "iu" else 1
        if name == "alpha" and np.all(values == top):
            used.add(name)
    others = [name for name in table.columns if name not in used]
    names = [name for name in table.lists if name not in ("vertex_indices", "vertex_index", "texcoord")]
    others += names[1:] if len(names) == len(table.lists) and what == "faces" else names
    if others and table.count:
        say(f"numbers of {what} are not used: {', '.join(others)}")


def _columns(table: Table, names: tuple[str, ...]) -> np.ndarray | None:
    if not all(name in table.columns for name in names):
        return None
    return np.stack([table.columns[name] for name in names], axis=1).astype(np.float64)


def _first(table: Table, choices: tuple[tuple[str, ...], ...]) -> np.ndarray | None:
    return next((found for names in choices if (found := _columns(table, names)) is not None), None)


def _color(table: Table, say: Say) -> np.ndarray | None:
    values = _first(table, _COLORS)
    if values is None or table.count == 0:
        return None
    kind = next(table.kinds[names[0]] for names in _COLORS if set(names) <= table.columns.keys())
    return linear_colors(values, say, kind)


def _normals(vertex: Table, position: np.ndarray, faces: np.ndarray) -> np.ndarray | None:
    """Unit normals; those of the faces where the file's have no direction."""
    normals = _columns(vertex, _NORMAL)
    return None if normals is None else unit_normals(normals, position, faces)


def unit_normals(normals: np.ndarray, position: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 3) normals of a file at length 1; those without direction become the mean of their faces."""
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm(normals, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > 0)
    unit = np.where(usable, normals, 0.0) / np.where(usable, length, 1.0)
    return unit if usable.all() else np.where(usable, unit, Mesh(position, faces).smooth_normals())


def _polygons(face: Table, position: np.ndarray, path: Path, say: Say) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(F, 3) vertices of the triangles of all faces, (F, 3) the corners that they are, (F,) the face of each."""
    counts, flat = _corners(face)
    _check_numbers(flat, len(position), path)
    short = counts < 3
    if short.any():
        say(f"{np.count_nonzero(short)} faces have fewer than 3 corners: they are left out")
    number = np.flatnonzero(~short)
    kept = np.flatnonzero(np.repeat(~short, counts))
    corners, polygon = triangulate(counts[number], position[flat[kept]], say)
    corners = kept[corners]
    return flat[corners], corners, number[polygon]


def _corners(face: Table) -> tuple[np.ndarray, np.ndarray]:
    """How many corners each face has, and the vertices that they are, face after face."""
    names = [name for name in face.lists if face.kinds[name].kind in "iu"]
    names.sort(key=lambda name: name not in ("vertex_indices", "vertex_index"))
    none = np.zeros(face.count, np.int64), np.zeros(0, np.int64)
    counts, flat = face.lists[names[0]] if names else none
    return counts, flat.astype(np.int64)


def _check_numbers(numbers: np.ndarray, count: int, path: Path) -> None:
    if len(numbers) and (numbers.min() < 0 or numbers.max() >= count):
        raise InputError(
            f"{path}: faces name vertices {numbers.min()} to {numbers.max()}, but it has {count}, numbered from 0"
        )


def _strips(table: Table) -> np.ndarray:
    """The triangles (F, 3) of strips, which -1 parts; every other one is turned, so that all face one way."""
    faces = []
    for counts, flat in list(table.lists.values())[:1]:
        ends = np.cumsum(counts)
        for row in np.split(flat.astype(np.int64), ends[:-1]):
            for strip in np.split(row, np.flatnonzero(row == -1)):
                strip = strip[strip != -1]
                triangles = np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)
                triangles[1::2] = triangles[1::2][:, [0, 2, 1]]
                a, b, c = triangles.T
                # those without area that join two strips
                faces.append(triangles[(a != b) & (b != c) & (c != a)])
    return np.concatenate(faces) if faces else np.zeros((0, 3), np.int64)


def _corner_uv(face: Table, corners: np.ndarray, polygon: np.ndarray) -> np.ndarray | None:
    """(F, 3, 2) texture coordinates at the corners of triangles; NaN for faces whose list is of another length."""
    if "texcoord" not in face.lists or len(polygon) == 0:
        return None
    lengths, flat = face.lists["texcoord"]
    counts, _ = _corners(face)
    whole = lengths == 2 * counts
    if not whole.any():
        return None
    # corners count over all faces; within its face a corner has the same place in both lists
    place = corners - (np.cumsum(counts) - counts)[polygon][:, None]
    at = (np.cumsum(lengths) - lengths)[polygon][:, None] + 2 * place
    at = np.where(whole[polygon][:, None], at, 0)
    uv = np.stack([flat[at], flat[np.minimum(at + 1, len(flat) - 1)]], axis=2)
    return np.where(whole[polygon][:, None, None], uv, np.nan)


def _materials(
    path: Path, comments: list[str], face: Table, polygon: np.ndarray, colored: bool, say: Say
) -> tuple[tuple[Material, ...], np.ndarray]:
    """One material per texture that comments name, and (F,) that of each triangle."""
    names = [comment[11:].strip() for comment in comments if comment.lower().startswith("texturefile")]
    materials = []
    for name in names:
        file = find_file(path.parent, name)
        try:
            if file is None:
                raise InputError(f"texture {name} does not exist: put the image there or correct the header")
            materials.append(Material((1.0, 1.0, 1.0), read_texture(file)[0], name))
        except InputError as error:
            say(f"{error}; the mesh has no such texture")
            materials.append(Material((1.0, 1.0, 1.0), None, name))
    if not materials:
        return (Material((1.0, 1.0, 1.0)) if colored else Material(),), np.zeros(len(polygon), np.int64)
    number = np.zeros(len(polygon), np.int64)
    if "texnumber" in face.columns and len(materials) > 1:
        number = face.columns["texnumber"].astype(np.int64)[polygon]
        if len(number) and (number.min() < 0 or number.max() >= len(materials)):
            say("faces without one of the textures that comments name (texnumber) have the first")
            number = np.where((number < 0) | (number >= len(materials)), 0, number)
    return tuple(materials), number
