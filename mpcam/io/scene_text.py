"""TOML text to typed tables, with every mistake reported by file, line and key."""

import difflib
import json
import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import msgspec
from msgspec import inspect

from mpcam.errors import InputError, KeyProblem
from mpcam.io.toml_lines import KeyPath, key_lines, line_of

T = TypeVar("T", bound=msgspec.Struct)

_LARGEST = 1e30  # beyond this, products of three lengths and float32 overflow

_WHERE = re.compile(r" - at `\$(?P<path>.*)`$")
_STEP = re.compile(r"\.(\w+)|\[(\d+)\]")
_UNKNOWN = re.compile(r"Object contains unknown field `(.*)`$")
_MISSING = re.compile(r"Object missing required field `(.*)`$")


class SceneError(InputError):
    """An InputError whose message names the file and the line."""


class SceneText:
    """A parsed TOML text that remembers where things stand.

    name: the file's name, for messages. Raises InputError if the text is not TOML, or holds numbers that are not finite
    or beyond 1e30.
    """

    def __init__(self, name: str, text: str):
        self.name = name
        self.top: list[str] = []  # keys that may stand above the first [table]
        try:
            self.data: dict[str, Any] = tomllib.loads(text)
            self.lines = key_lines(text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(self._syntax(str(error), text)) from None
        except RecursionError:
            raise InputError(f"{name}: arrays or tables are nested too deeply to be a scene") from None
        except ValueError as error:  # numbers with thousands of digits
            raise InputError(f"{name}: not valid TOML: {error}") from None
        for path, value in _leaves(self.data, ()):
            if isinstance(value, (int, float)) and not abs(value) <= _LARGEST:
                raise self.error(path, f"give a number between {-_LARGEST:g} and {_LARGEST:g}")

    def error(self, path: KeyPath, problem: str) -> InputError:
        """The exception for a mistake at a key: file, line, key, its value if it is a plain one, and the problem."""
        return SceneError(f"{self.name}:{line_of(self.lines, path)}: {_dotted(path)}{self._given(path)}: {problem}")

    @contextmanager
    def at(self, *path: str | int) -> Iterator[None]:
        """Reports an InputError from inside the block as one of this key, unless its message has a line already."""
        try:
            yield
        except SceneError:
            raise
        except KeyProblem as error:
            raise self.error((*path, error.key), error.problem) from None
        except InputError as error:
            raise self.error(path, str(error)) from None

    def read(self, kind: type[T], table: str | None = None) -> T:
        """The text, or one table of it, as a record.

        Raises InputError for unknown or missing keys and for values of the wrong kind.
        """
        if table is None:
            self.top = _keys(inspect.type_info(kind))
        data = self.data if table is None else self.data[table]
        try:
            return msgspec.convert(data, kind)
        except msgspec.ValidationError as error:
            raise self._explained(str(error), kind, data, () if table is None else (table,)) from None

    def _explained(self, message: str, kind: type, data: Any, base: KeyPath) -> InputError:
        where = _WHERE.search(message)
        message = message[: where.start()] if where else message
        path = tuple(key or int(index) for key, index in _STEP.findall(where["path"])) if where else ()
        allowed, data = _kind_at(inspect.type_info(kind), data, path)
        path = (*base, *path)
        if unknown := _UNKNOWN.match(message):
            top = self.top if path else []
            return self.error((*path, unknown[1]), _suggestion(unknown[1], _keys(allowed), top))
        if missing := _MISSING.match(message):
            wanted, _ = _kind_at(allowed, data, (missing[1],))
            return self.error((*path, missing[1]), f"this key is missing: give {_described(wanted)}")
        if isinstance(allowed, inspect.LiteralType):
            return self.error(path, f"allowed are {', '.join(str(value) for value in allowed.values)}")
        return self.error(path, f"give {_described(allowed)}")

    def _given(self, path: KeyPath) -> str:
        value: Any = self.data
        try:
            for step in path:
                value = value[step]
        except (LookupError, TypeError):  # a key that is missing
            return ""
        if isinstance(value, dict) or (isinstance(value, list) and any(isinstance(item, dict) for item in value)):
            return ""
        text = json.dumps(value, default=str, ensure_ascii=False)
        return f" = {text if len(text) <= 60 else text[:57] + '...'}"

    def _syntax(self, message: str, text: str) -> str:
        found = re.match(r"(.*) \(at line (\d+), column (\d+)\)$", message, re.DOTALL)
        if found:
            return f"{self.name}:{found[2]}: not valid TOML: {found[1]} (column {found[3]})"
        line = text.rstrip().count("\n") + 1
        problem = message.removesuffix(" (at end of document)")
        return f"{self.name}:{line}: not valid TOML: {problem} at the end of the file"


def _leaves(value: Any, path: KeyPath) -> Iterator[tuple[KeyPath, Any]]:
    if isinstance(value, (dict, list)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _leaves(item, (*path, key))
    else:
        yield path, value


def _dotted(path: KeyPath) -> str:
    """The path as in TOML; keys that need quotes have them."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            plain = re.fullmatch(r"[A-Za-z0-9_-]+", step)
            text += ("." if text else "") + (step if plain else json.dumps(step, ensure_ascii=False))
    return text


def _kind_at(kind: inspect.Type, data: Any, path: KeyPath) -> tuple[inspect.Type, Any]:
    """The type that is allowed at a path, and the data there."""
    for step in path:
        kind = _narrowed(kind, data)
        data = data.get(step) if isinstance(data, dict) else data[int(step)]
        if isinstance(kind, inspect.TupleType):
            kind = kind.item_types[int(step)]
        elif isinstance(kind, inspect.ListType):
            kind = kind.item_type
        elif isinstance(kind, inspect.StructType):
            kind = next(field.type for field in kind.fields if field.encode_name == step)
        elif isinstance(kind, inspect.UnionType):  # not narrowed: the step is the key that tells the members apart
            kind = inspect.LiteralType(tuple(_tags(kind)))
    return _narrowed(kind, data), data


def _narrowed(kind: inspect.Type, data: Any) -> inspect.Type:
    """The member of a union that the data can only mean; the union without None where that is open."""
    if not isinstance(kind, inspect.UnionType):
        return kind
    members = [member for member in kind.types if not isinstance(member, inspect.NoneType)]
    if isinstance(data, dict):
        tables = [member for member in members if isinstance(member, inspect.StructType)]
        fitting = [table for table in tables if table.tag is None or data.get(str(table.tag_field)) == table.tag]
    else:
        fitting = [member for member in members if isinstance(data, list) and isinstance(member, inspect.TupleType)]
    return fitting[0] if len(fitting) == 1 else members[0] if len(members) == 1 else inspect.UnionType(tuple(members))


def _tags(kind: inspect.UnionType) -> list[str]:
    return [str(member.tag) for member in kind.types if isinstance(member, inspect.StructType)]


def _keys(kind: inspect.Type) -> list[str]:
    if not isinstance(kind, inspect.StructType):
        return []
    return ([kind.tag_field] if kind.tag_field else []) + [field.encode_name for field in kind.fields]


def _suggestion(name: str, allowed: list[str], top: list[str]) -> str:
    near = difflib.get_close_matches(name, allowed, 1)
    hint = ""
    if near:
        hint = f"did you mean {near[0]}? "
    elif name in top:  # TOML gives every key to the last [table] before it
        hint = f"put {name} above the first [table]; "
    return f"there is no such key: {hint}allowed here are {', '.join(allowed)}"


def _described(kind: inspect.Type) -> str:
    """What a value of that type may be, in words."""
    if isinstance(kind, inspect.LiteralType):
        return "one of " + ", ".join(str(value) for value in kind.values)
    if isinstance(kind, (inspect.IntType, inspect.FloatType)):
        limits = (("above", kind.gt), ("from", kind.ge), ("up to", kind.le), ("below", kind.lt))
        parts = [f"{word} {limit:g}" for word, limit in limits if limit is not None]
        return " ".join(["a whole number" if isinstance(kind, inspect.IntType) else "a number", *parts])
    if isinstance(kind, inspect.BoolType):
        return "true or false"
    if isinstance(kind, inspect.StrType):
        return "a text in quotes"
    if isinstance(kind, inspect.TupleType):
        return f"a list of {len(kind.item_types)}, each {_described(kind.item_types[0])}"
    if isinstance(kind, inspect.ListType) and isinstance(kind.item_type, inspect.StructType):
        return f"tables in double brackets, with the keys {', '.join(_keys(kind.item_type))}"
    if isinstance(kind, inspect.ListType):
        return f"a list, each item {_described(kind.item_type)}" + (", at least one" if kind.min_length else "")
    if isinstance(kind, inspect.StructType):
        return f"a table with the keys {', '.join(_keys(kind))}"
    if isinstance(kind, inspect.UnionType) and _tags(kind):
        return f"a table, of kind {' or '.join(_tags(kind))}"
    if isinstance(kind, inspect.UnionType):
        return " or ".join(_described(member) for member in kind.types)
    return f"a value of the type {type(kind).__name__.removesuffix('Type').lower()}"  # of a camera of one's own
