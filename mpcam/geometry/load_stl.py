"""STL: triangles alone, in text or binary, some with a color each."""

import re
import struct
from pathlib import Path

import numpy as np

from mpcam.checks import reads_as_number
from mpcam.errors import InputError
from mpcam.geometry.load_text import Say, decode_text
from mpcam.geometry.mesh import Material, Mesh
from mpcam.geometry.polygons import triangulate
from mpcam.math.srgb import linear_from_srgb

# numbers stand on the line of their vertex; a name may hold any of these words
_PARTS = re.compile(r"\b(facet)\s+normal\b|\bvertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)|\bend\s*(facet)\b")
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])


def load_stl(path: Path, say: Say) -> Mesh:
    """Reads an STL file: every triangle has three vertices of its own; normals are those of the corners' order.

    A file is binary if it has the length that its count of triangles asks for, or more of it than of text. Colors are
    those of Materialise Magics where the header has COLOR=, else those of VisCAM. Raises ValueError for what was cut
    off.
    """
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    length = 84 + 50 * count
    if len(data) >= 84 and len(data) == length:
        return _binary(data, count)
    text = decode_text(data).lower()
    if re.search(r"^\s*(solid|facet)", text) and re.search(r"\bfacet\s+normal\b|\bend\s*solid\b", text):
        return _text(text, path, say)
    if count and len(data) > length:
        if data[length:].strip(b"\0\r\n\t \x1a"):
            say(f"{len(data) - length} bytes behind the last triangle are not used")
        return _binary(data, count)
    raise ValueError("neither a whole binary nor a whole text file")


def _binary(data: bytes, count: int) -> Mesh:
    facets = np.frombuffer(data, _FACET, count, 84)
    corners = facets["corners"].astype(np.float64).reshape(-1, 3)
    faces = np.arange(3 * count).reshape(-1, 3)
    word = facets["color"].astype(np.int64)
    magics = data[:80].find(b"COLOR=")
    if 0 <= magics <= 70:
        # the bit says that a triangle has the color of the whole; red has the lowest bits
        own, shifts = word & 0x8000 == 0, (0, 5, 10)
        whole = np.frombuffer(data, np.uint8, 3, magics + 6) / 255.0
    else:
        own, shifts = word & 0x8000 != 0, (10, 5, 0)
        whole = np.array([0.906, 0.906, 0.906])  # sRGB of the gray that uncolored meshes have
        if not own.any():
            return Mesh(corners, faces)
    colors = np.stack([word >> shift & 31 for shift in shifts], axis=1) / 31.0
    colors = linear_from_srgb(np.where(own[:, None], colors, whole))
    return Mesh(corners, faces, colors=np.repeat(colors, 3, axis=0), materials=Material((1.0, 1.0, 1.0)))


def _text(text: str, path: Path, say: Say) -> Mesh:
    name = re.match(r"\s*solid[^\n]*\n(?=.*facet)", text, re.DOTALL)
    parts = _PARTS.findall(text, name.end() if name else 0)
    opened, closed = (np.array([part[k] != "" for part in parts], bool) for k in (0, 4))
    if opened.sum() != closed.sum() or not re.search(r"\bend\s*solid\b", text[max(text.rfind("facet"), 0) :]):
        raise ValueError("the text was cut off")
    corner = ~opened & ~closed
    try:
        points = np.array([part[1:4] for part in parts if part[1]], np.float64).reshape(-1, 3)
    except ValueError:
        bad = next(
            part for part in _PARTS.finditer(text) if part[2] and not all(map(reads_as_number, part.group(2, 3, 4)))
        )
        line = text.count("\n", 0, bad.start()) + 1
        raise InputError(f"{path} line {line}: {' '.join(bad[0].split())[:60]!r} is not three numbers") from None
    counts = np.bincount((np.cumsum(opened) - 1)[corner], minlength=int(opened.sum()))
    if (counts < 3).any():
        raise ValueError("a facet without three corners")
    faces, _ = triangulate(counts, points, say)
    return Mesh(points, faces)
