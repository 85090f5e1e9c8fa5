"""PLY as its header describes it: elements, their rows, and the columns of those, in text or binary of either order."""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.load_text import Say

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("long", "int64"), "i8"),
    **dict.fromkeys(("ulong", "uint64"), "u8"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}


@dataclass
class Table:
    """The rows of an element. columns: (count,) float64 or integers by name; kinds: the type that the header gives.

    lists: for each list property the (count,) lengths, and all entries one row after another.
    """

    count: int
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    kinds: dict[str, np.dtype] = field(default_factory=dict)
    lists: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)


@dataclass
class _Element:
    name: str
    count: int
    # name, type, and the type of the length where it is a list
    properties: list[tuple[str, str, str | None]] = field(default_factory=list)


@dataclass
class _Body:
    """What is behind the header, as units: bytes, or the numbers of a text file. order: of bytes, none in text."""

    units: np.ndarray
    order: str

    def size(self, kind: str) -> int:
        return np.dtype(kind).itemsize if self.order else 1

    def length(self, at: int, kind: str) -> int:
        """The length of a list, which stands at a unit."""
        units = self.units[at : at + self.size(kind)]
        value = units.view(self.order + kind)[0] if self.order else units[0]
        if not 0 <= value <= len(self.units):
            raise ValueError("a list without a length")
        return int(value)

    def rows(self, starts: np.ndarray, kinds: list[tuple[str, int]]) -> list[np.ndarray]:
        """Rows of one shape: for each field, of that many numbers of a type, an array (R, how many)."""
        ends = np.cumsum([0] + [self.size(kind) * count for kind, count in kinds])
        regular = len(starts) == 1 or np.all(np.diff(starts) == ends[-1])
        if regular:
            table = self.units[starts[0] : starts[0] + ends[-1] * len(starts)].reshape(len(starts), ends[-1])
        else:
            table = self.units[starts[:, None] + np.arange(ends[-1])]
        fields = [table[:, a:b] for a, b in zip(ends[:-1], ends[1:], strict=True)]
        if not self.order:
            return fields
        return [np.ascontiguousarray(f).view(self.order + kind) for f, (kind, _) in zip(fields, kinds, strict=True)]


def read_ply(path: Path, say: Say) -> tuple[list[str], dict[str, Table]]:
    """The comments of a PLY file, and its elements by name, all names of elements and properties in small letters.

    Raises InputError for types and encodings that are not known, ValueError for what does not follow its header.
    """
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data, re.IGNORECASE)
    last = re.search(rb"[\r\n]end_header[ \t]*(?=[\r\n]|$)", data)
    if first is None or last is None:
        raise ValueError("no header")
    comments, elements, encoding = _header(data[: last.start()].decode("latin-1"), path)
    body = data[last.end() :]
    body = body[len(first[1]) :] if body.startswith(first[1]) else body.lstrip(b"\r\n")
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    if encoding not in orders:
        raise InputError(f"{path}: its format is {encoding!r}; PLY files are {', '.join(orders)}")
    order = orders[encoding]
    units = np.frombuffer(body, np.uint8) if order else np.array(body.split(), np.float64)
    content, at, tables = _Body(units, order), 0, {}
    for element in elements:
        tables[element.name], at = _table(content, at, element)
    left = len(units) - at if not order else len(bytes(units[at:]).strip(b"\0\r\n\t \x1a"))
    if left:
        say(f"{left} {'bytes' if order else 'numbers'} behind the last element are not used")
    return comments, tables


def _header(text: str, path: Path) -> tuple[list[str], list[_Element], str]:
    comments, elements, encoding = [], [], ""
    for line in re.split(r"\r\n|\n|\r", text)[1:]:
        words = line.split()
        key = words[0].lower() if words else ""
        if key == "format":
            encoding = words[1].lower()
        elif key in ("comment", "obj_info"):
            comments.append(line.strip()[len(key) :].strip())
        elif key == "element":
            elements.append(_Element(words[1].lower(), int(words[2])))
        elif key == "property":
            kinds = words[2:4] if words[1].lower() == "list" else words[1:2]
            for kind in kinds:
                if kind.lower() not in _TYPES:
                    raise InputError(f"{path}: the header names the type {kind!r}; PLY has {', '.join(_TYPES)}")
            *length, kind = (_TYPES[kind.lower()] for kind in kinds)
            elements[-1].properties.append((words[-1].lower(), kind, length[0] if length else None))
        elif key:
            raise ValueError("a header line of no kind")
    return comments, elements, encoding


def _table(body: _Body, at: int, element: _Element) -> tuple[Table, int]:
    """The rows of an element that begins at a unit, and the unit behind it."""
    table = Table(element.count)
    fixed = sum(body.size(length or kind) for _, kind, length in element.properties)
    if element.count < 0 or element.count * fixed > len(body.units) - at:
        raise ValueError("rows are missing")
    starts, shapes, end = _shapes(body, at, element)
    if end > len(body.units):
        raise ValueError("rows are missing")
    groups, which = np.unique(shapes, axis=0, return_inverse=True)
    which = which.reshape(-1)
    order = np.argsort(which, kind="stable")
    found: dict[str, list[np.ndarray]] = {name: [] for name, _, _ in element.properties}
    for number, shape in enumerate(groups):
        lengths, kinds = iter(shape.tolist()), []
        for _, kind, length in element.properties:
            kinds += [(kind, 1)] if length is None else [(length, 1), (kind, next(lengths))]
        fields = iter(body.rows(starts[which == number], kinds))
        for name, _, length in element.properties:
            if length is not None:
                next(fields)
            found[name].append(next(fields))
    column = 0
    for name, kind, length in element.properties:
        parts = [part.astype(np.float64 if kind[0] == "f" or not body.order else np.int64) for part in found[name]]
        table.kinds[name] = np.dtype(kind)
        if length is None:
            values = np.concatenate([part[:, 0] for part in parts]) if parts else np.zeros(0)
            table.columns[name] = np.empty_like(values)
            table.columns[name][order] = values
        else:
            table.lists[name] = (shapes[:, column], _in_order(parts, shapes[:, column], which))
            column += 1
    return table, end


def _shapes(body: _Body, at: int, element: _Element) -> tuple[np.ndarray, np.ndarray, int]:
    """Where each row begins, (count, lists) the lengths of its lists, and the end of the last."""
    sizes = [(body.size(kind), length) for _, kind, length in element.properties]

    def walk(start: int) -> tuple[list[int], int]:
        shape = []
        for size, length in sizes:
            if length is None:
                start += size
                continue
            shape.append(body.length(start, length))
            start += body.size(length) + size * shape[-1]
        return shape, start

    if element.count == 0:
        return np.zeros(0, np.int64), np.zeros((0, sum(length is not None for _, length in sizes)), np.int64), at
    # most files have rows of one shape: taken so if the lengths of all rows agree
    shape, end = walk(at)
    size = end - at
    if at + size * element.count <= len(body.units):
        starts = at + size * np.arange(element.count)
        if _same(body, element, starts, shape):
            return (
                starts,
                np.tile(np.array(shape, np.int64).reshape(1, -1), (element.count, 1)),
                at + size * element.count,
            )
    places, shapes = [], []
    for _ in range(element.count):
        places.append(at)
        shape, at = walk(at)
        shapes.append(shape)
    return np.array(places), np.array(shapes, np.int64).reshape(element.count, -1), at


def _same(body: _Body, element: _Element, starts: np.ndarray, shape: list[int]) -> bool:
    """Whether all rows, if they began there, had lists of these lengths."""
    at, lengths = 0, iter(shape)
    for _, kind, length in element.properties:
        if length is None:
            at += body.size(kind)
            continue
        count = next(lengths)
        units = body.units[(starts + at)[:, None] + np.arange(body.size(length))]
        found = units.view(body.order + length)[:, 0] if body.order else units[:, 0]
        if not np.all(found == count):
            return False
        at += body.size(length) + body.size(kind) * count
    return True


def _in_order(parts: list[np.ndarray], lengths: np.ndarray, which: np.ndarray) -> np.ndarray:
    """The entries of lists, sorted by shape, one row after another."""
    starts = np.cumsum(lengths) - lengths
    result = np.zeros(int(lengths.sum()), parts[0].dtype if parts else np.int64)
    for number, part in enumerate(parts):
        result[starts[which == number][:, None] + np.arange(part.shape[1])] = part
    return result
