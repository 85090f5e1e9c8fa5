"""Frozen kernels: recorded at the first call, replayed without Python after."""

import dataclasses
import functools
import gc
from collections.abc import Callable
from typing import Any

import drjit as dr

RECORDINGS = 64


def frozen(function: Callable[..., Any]) -> Callable[..., Any]:
    """`dr.freeze` for kernels that serve many cameras and meshes.

    One recording is made per camera model, per pattern of equal array lengths, and per value of the numbers and words
    among the arguments, which is more than Dr.Jit takes for a mistake by default; the 64 used last are kept. The
    garbage collector rests meanwhile: if it freed an array that borrows NumPy's memory while a recording runs, Dr.Jit
    would abort the process ("enqueue_host_func(): this function cannot be recorded").
    """

    def run(constants: str, *arguments: Any) -> Any:
        return function(*arguments)

    replay = dr.freeze(run, limit=RECORDINGS, warn_after=1 << 30)

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        collecting = gc.isenabled()
        gc.disable()
        try:
            return replay(constants(arguments), *arguments)
        finally:
            if collecting:
                gc.enable()

    return call


def constants(arguments: Any) -> str:
    """Numbers and words among the arguments, in one text.

    Of an object that it has met before among the arguments, Dr.Jit only keeps that it has. Small numbers are such
    objects: after a 1 and a 2 it would take one of them for the other, and replay the wrong kernel.
    """
    found: list[Any] = []
    _collect(arguments, found)
    return str(found)


def _collect(value: Any, found: list[Any]) -> None:
    kind = type(value)
    way = _WAYS.get(kind)
    if way is None:
        way = _WAYS[kind] = _members(kind)
    way(value, found)


def _constant(value: Any, found: list[Any]) -> None:
    found.append(value)


def _several(values: Any, found: list[Any]) -> None:
    for value in values:
        _collect(value, found)


def _table(values: dict[Any, Any], found: list[Any]) -> None:
    _several(values.values(), found)


def _nothing(value: Any, found: list[Any]) -> None:
    """Arrays, and whatever else Dr.Jit tells apart itself."""


def _members(kind: type) -> Callable[[Any, list[Any]], None]:
    """How the constants of a type's objects are found."""
    if not dataclasses.is_dataclass(kind):
        return _several if issubclass(kind, (tuple, list)) else _nothing
    names = [field.name for field in dataclasses.fields(kind)]

    def members(value: Any, found: list[Any]) -> None:
        for name in names:
            _collect(getattr(value, name), found)

    return members


_WAYS: dict[type, Callable[[Any, list[Any]], None]] = {
    **dict.fromkeys((bool, int, float, str, type(None)), _constant),
    **dict.fromkeys((tuple, list), _several),
    dict: _table,
}
