"""The numbers of glTF accessors: strided, normalized, sparse."""

import numpy as np

from mpcam.geometry.load_gltf_file import GltfFile
from mpcam.geometry.load_gltf_parts import Accessor

_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4", 5130: "f8"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def read_accessor(file: GltfFile, number: int, widths: tuple[int, ...]) -> np.ndarray:
    """The rows (count, width) of an accessor: integers as they are, or float64 where it has floats or is normalized.

    widths: those that are allowed. Raises ValueError for numbers that are not there.
    """
    if not 0 <= number < len(file.root.accessors):
        raise ValueError(f"accessor {number} of {len(file.root.accessors)} is named")
    accessor = file.root.accessors[number]
    width, kind = _WIDTHS.get(accessor.type, 0), _TYPES.get(accessor.component_type)
    if width not in widths or kind is None or not 0 <= accessor.count * width <= 1 << 30:
        raise ValueError(f"accessor {number} holds {accessor.count} {accessor.type} of type {accessor.component_type}")
    if accessor.buffer_view is None:
        rows = np.zeros((accessor.count, width), kind)
    else:
        rows = _rows(file, accessor.buffer_view, accessor.byte_offset, accessor.count, width, kind)
    if accessor.sparse is not None:
        rows = _replaced(file, accessor, rows, width, kind)
    if kind[0] == "f":
        return rows.astype(np.float64)
    if not accessor.normalized:
        return rows.astype(np.int64)
    return np.maximum(rows / float(np.iinfo(kind).max), -1.0)


def _rows(file: GltfFile, view: int, offset: int, count: int, width: int, kind: str) -> np.ndarray:
    data, stride = file.view(view)
    size = np.dtype(kind).itemsize * width
    step = stride or size
    if offset < 0 or step < 0 or (count and offset + step * (count - 1) + size > len(data)):
        raise ValueError(f"buffer view {view} ends before its last row")
    if count == 0:
        return np.zeros((0, width), kind)
    return np.ndarray((count, width), f"<{kind}", data, offset, (step, np.dtype(kind).itemsize))


def _replaced(file: GltfFile, accessor: Accessor, rows: np.ndarray, width: int, kind: str) -> np.ndarray:
    """The rows with those of a sparse accessor put in."""
    assert accessor.sparse is not None
    count, places, values = accessor.sparse.count, accessor.sparse.indices, accessor.sparse.values
    places_kind = _TYPES[places.component_type]
    where = _rows(file, places.buffer_view, places.byte_offset, count, 1, places_kind)[:, 0].astype(np.int64)
    if count and where.max() >= len(rows):
        raise ValueError(f"a sparse accessor replaces row {where.max()} of {len(rows)}")
    rows = rows.copy()
    rows[where] = _rows(file, values.buffer_view, values.byte_offset, count, width, kind)
    return rows
