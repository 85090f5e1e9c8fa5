"""What of a frozen kernel's arguments decides which recording serves, and Dr.Jit does not tell apart itself.

Of an object that it has met before among the arguments, Dr.Jit only keeps that it has, not which one it was. Small
numbers are such objects: after a 1 and a 2, one of them would be taken for the other, and the wrong kernel replayed.
So would an array that is given twice.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import drjit as dr


def constants(arguments: Any) -> str:
    """Numbers and words among the arguments, and which arrays are the same as earlier ones, in one text."""
    found = _Found()
    _collect(arguments, found)
    return str(found.values)


class _Found:
    """values: constants, and for arrays that came before their place among the arrays. arrays: places by number."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.arrays: dict[int, int] = {}


def _collect(value: Any, found: _Found) -> None:
    kind = type(value)
    way = _WAYS.get(kind)
    if way is None:
        way = _WAYS[kind] = _way(kind)
    way(value, found)


def _constant(value: Any, found: _Found) -> None:
    found.values.append(value)


def _several(values: Any, found: _Found) -> None:
    for value in values:
        _collect(value, found)


def _table(values: dict[Any, Any], found: _Found) -> None:
    _several(values.values(), found)


def _array(value: Any, found: _Found) -> None:
    arrays, number = found.arrays, value.index
    if number in arrays:
        found.values.append(f"array {arrays[number]}")
    else:
        arrays[number] = len(arrays)


def _nothing(value: Any, found: _Found) -> None:
    """Dr.Jit goes by the object's hash."""


def _way(kind: type) -> Callable[[Any, _Found], None]:
    """How the constants of a type's objects are found."""
    if dr.is_array_v(kind):
        return _array if dr.depth_v(kind) == 1 else _several
    if not dataclasses.is_dataclass(kind):
        return _several if issubclass(kind, (tuple, list)) else _nothing
    names = [field.name for field in dataclasses.fields(kind)]

    def members(value: Any, found: _Found) -> None:
        for name in names:
            _collect(getattr(value, name), found)

    return members


_WAYS: dict[type, Callable[[Any, _Found], None]] = {
    **dict.fromkeys((bool, int, float, str, type(None)), _constant),
    **dict.fromkeys((tuple, list), _several),
    dict: _table,
}
