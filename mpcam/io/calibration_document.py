"""A calibration file before anything of it is understood: bytes, text, and the tree of a YAML, JSON or XML document."""

import functools
import gzip
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.errors import InputError
from mpcam.io.calibration_xml import read_xml
from mpcam.io.calibration_yaml import read_yaml

Size = tuple[int, int]

_UTF16 = (b"\xff\xfe", b"\xfe\xff")  # how such text begins


class Document:
    """A file, or a folder, and what the caller says of its images.

    path: where it is. where: how messages call it. size: width and height for cameras whose file says none.
    Raises InputError where it cannot be read.
    """

    def __init__(self, path: str | Path, size: Size | None = None):
        self.path, self.where, self.size = Path(path), str(path), size
        try:
            self.folder = self.path.is_dir()
            self.data = b"" if self.folder else self.path.read_bytes()
            if self.data.startswith(b"\x1f\x8b"):  # OpenCV's .yml.gz
                self.data = gzip.decompress(self.data)
        except (OSError, EOFError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise InputError(f"{path}: cannot be read: {reason}") from None
        except ValueError as error:  # a zero byte in the name
            raise InputError(f"{str(path)!r}: cannot be read: {error}") from None

    @functools.cached_property
    def binary(self) -> bool:
        """Whether it is no text."""
        try:
            return "\0" in self.text
        except InputError:
            return True

    @functools.cached_property
    def text(self) -> str:
        """The file as text; raises InputError where it is none."""
        encoding = "utf-16" if self.data[:2] in _UTF16 else "utf-8-sig"
        try:
            text = self.data.decode(encoding)
        except UnicodeDecodeError:
            text = "\0"
        if "\0" in text:
            raise InputError(f"{self.where}: is not text: give a calibration file (see read_calibration)")
        return text

    @functools.cached_property
    def tree(self) -> Any:
        """The document as nested dictionaries and lists; raises InputError, with the line, where it is none."""
        if self.data[:4] == b"PK\x03\x04":
            return self._arrays()
        start = self.text.lstrip()[:1]
        if start == "<":
            return read_xml(self.text, self.where)
        if start in ("{", "["):
            return self._json()
        return read_yaml(self.text, self.where)

    def mapping(self) -> dict[Any, Any]:
        """The tree where it is a mapping; empty where it is none, or cannot be parsed."""
        try:
            return self.tree if isinstance(self.tree, dict) else {}
        except InputError:
            return {}

    def beside(self, name: str) -> "Document":
        """Another file, by its name from this one's folder."""
        return Document((self.path if self.folder else self.path.parent) / name, self.size)

    def _json(self) -> Any:
        try:
            return json.loads(self.text)
        except (json.JSONDecodeError, RecursionError) as error:
            if self.path.suffix.lower() in (".yaml", ".yml"):
                return read_yaml(self.text, self.where)
            raise InputError(f"{self.where}: not JSON: {error}") from None

    def _arrays(self) -> dict[str, Any]:
        try:
            with np.load(io.BytesIO(self.data), allow_pickle=False) as arrays:
                return {name: arrays[name].tolist() for name in arrays.files}
        except (ValueError, OSError, zipfile.BadZipFile) as error:
            raise InputError(f"{self.where}: not arrays of numbers (.npz): {error}") from None
