"""The layout of the code: no circle of imports, no arrow up between rooms, short files. Sources are read, never run."""

import statistics
from pathlib import Path

import pytest
from test_repository import text_files

from tools.rooms import ROOMS, SOURCES, arrows, circles, modules, room_of, upward

MOST_LINES, MEDIAN_LINES = 400, 160
FILES = modules(SOURCES)


@pytest.fixture(scope="module")
def all_arrows():
    return arrows(FILES)


def lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def test_no_circle_of_files(all_arrows):
    assert circles(all_arrows) == []


def test_no_arrow_up_between_rooms(all_arrows):
    assert upward(all_arrows) == []


def test_every_file_has_a_room_and_every_room_files():
    assert {room_of(name) for name in FILES} == set(ROOMS)
    assert len(FILES) > 200


def test_kernels_know_nothing_of_mpcam(all_arrows):
    kernels = {name: others for name, others in all_arrows.items() if name.startswith("mpcam_kernels")}
    assert all(other.startswith("mpcam_kernels") for others in kernels.values() for other in others)


def test_no_file_is_too_long():
    lengths = {str(path): lines(path) for path in text_files()}
    assert len(lengths) > 50
    assert not {path: count for path, count in lengths.items() if count > MOST_LINES}


def test_most_files_are_short():
    assert statistics.median(lines(path) for path in FILES.values()) < MEDIAN_LINES


IMPORTS = {
    "at the top": "from mpcam.b import x",
    "as a module": "from mpcam import b",
    "plain": "import mpcam.b",
    "inside of a function": "def f():\n    from mpcam.b import x",
    "for type checkers": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from mpcam.b import x",
    "by name": "from importlib import import_module\nimport_module('mpcam.b')",
    "in part by name": "from importlib import import_module\nimport_module(f'mpcam.b{1}')",
}


@pytest.mark.parametrize("kind", IMPORTS)
def test_the_checks_can_fail(tmp_path, kind):
    """A circle of two files in two rooms, closed by each kind of import."""
    package = tmp_path / "mpcam"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "a.py").write_text(IMPORTS[kind])
    (package / "b.py").write_text("from mpcam.a import y\n")
    found = arrows(modules({"mpcam": tmp_path}))
    rooms = {"ground": ("mpcam.a", "mpcam"), "upper": ("mpcam.b",)}
    assert circles(found) == [["mpcam.a", "mpcam.b"]]
    assert upward(found, rooms) == ["mpcam.a -> mpcam.b"]
    (package / "a.py").write_text("")
    found = arrows(modules({"mpcam": tmp_path}))
    assert circles(found) == upward(found, rooms) == []


def test_a_long_circle_is_found():
    ring = {f"m{number}": {f"m{(number + 1) % 5}"} for number in range(5)} | {"m9": {"m0"}}
    assert circles(ring) == [["m0", "m1", "m2", "m3", "m4"]]


def test_a_module_without_a_room_is_refused():
    with pytest.raises(KeyError, match="mpcam.attic is in no room"):
        room_of("mpcam.attic")
