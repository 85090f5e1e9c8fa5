"""Where each key of a TOML text stands, so that a mistake can be reported with its line."""

import re
import tomllib
from bisect import bisect_right

KeyPath = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*"{3,5}'  # a multi-line string may end in up to two quotes of its own
    r"|'''(?:[^']|'(?!''))*'{3,5}"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^,\]}#\n]*")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Line (from 1) of every table, key and array element of a valid TOML text, by its path.

    A path is made of keys and array indices: `[[mesh]]` with `rotate.axis = [0, 0, 1]` gives ("mesh",), ("mesh", 0),
    ("mesh", 0, "rotate"), ("mesh", 0, "rotate", "axis") and ("mesh", 0, "rotate", "axis", 0) to (..., 2). A table has
    the line of its header, or of its first key where it has none; an array of tables that of its first header. The text
    must have been accepted by tomllib; what tomllib rejects is located wrongly or raises ValueError.
    """
    return _Locator(text).lines


def line_of(lines: dict[KeyPath, int], path: KeyPath) -> int:
    """Line of a path, or of the nearest table around it that is written down; 1 if there is none."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return 1


class _Locator:
    def __init__(self, text: str):
        self.text = text
        self.position = 0
        self.newlines = [match.start() for match in re.finditer("\n", text)]
        self.lines: dict[KeyPath, int] = {}
        self.elements: dict[KeyPath, int] = {}  # how many [[tables]] an array has so far
        table: KeyPath = ()
        self._skip(_BLANK)
        while self.position < len(text):
            if text[self.position] == "[":
                table = self._header()
            else:
                self._key_value(table)
            self._skip(_BLANK)

    def _header(self) -> KeyPath:
        line = self._line()
        array = self.text.startswith("[[", self.position)
        self.position += 2 if array else 1
        path: KeyPath = ()
        keys = self._keys()
        self.position += 2 if array else 1
        for key in keys[:-1]:
            path = self._last_element((*path, key))
            self.lines.setdefault(path, line)
        path = (*path, keys[-1])
        if array:
            self.lines.setdefault(path, line)
            self.elements[path] = self.elements.get(path, 0) + 1
            path = self._last_element(path)
        self.lines[path] = line
        return path

    def _last_element(self, path: KeyPath) -> KeyPath:
        return (*path, self.elements[path] - 1) if path in self.elements else path

    def _key_value(self, table: KeyPath) -> None:
        line = self._line()
        path = table
        for key in self._keys():
            path = (*path, key)
            self.lines.setdefault(path, line)
        self.position += 1  # the equals sign
        self._skip(_SPACE)
        self._value(path)

    def _value(self, path: KeyPath) -> None:
        start = self.text[self.position : self.position + 1]
        if start in ("[", "{"):
            close = "]" if start == "[" else "}"
            self.position += 1
            self._skip(_BLANK)
            index = 0
            while self.text[self.position : self.position + 1] != close:
                before = self.position
                if start == "[":
                    self.lines[(*path, index)] = self._line()
                    self._value((*path, index))
                else:
                    self._key_value(path)
                index += 1
                if self.position == before:
                    raise ValueError(f"line {self._line()}: not valid TOML")
                self._skip(_BLANK)
                if self.text.startswith(",", self.position):
                    self.position += 1
                    self._skip(_BLANK)
            self.position += 1
        elif not self._skip(_STRING):
            self._skip(_SCALAR)

    def _keys(self) -> list[str]:
        """The parts of a dotted key; the position is then at what follows it."""
        keys = []
        while True:
            self._skip(_SPACE)
            quoted = self._skip(_STRING)
            keys.append(tomllib.loads(f"key = {quoted}")["key"] if quoted else self._skip(_BARE_KEY))
            self._skip(_SPACE)
            if not self.text.startswith(".", self.position):
                return keys
            self.position += 1

    def _skip(self, pattern: re.Pattern) -> str:
        match = pattern.match(self.text, self.position)
        if match is None:
            return ""
        self.position = match.end()
        return match.group()

    def _line(self) -> int:
        return bisect_right(self.newlines, self.position - 1) + 1
