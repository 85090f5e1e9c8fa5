"""The documentation is true: its code runs and prints what it says, and it names what there is."""

import doctest
import importlib.util
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest

import mpcam
from mpcam.cli import EXIT_FAILURE, EXIT_INPUT, EXIT_INTERRUPT, app
from mpcam.comparison.columns import COLUMNS
from mpcam.geometry.builtin import builtin_mesh
from mpcam.io import scene_tables as tables
from mpcam.io.camera_tables import CameraFile, CameraTable, camera_table
from mpcam.rendering import cubemap, registry, vertex
from mpcam_kernels.backend import NAMES, VARIABLE

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```$(?:\n\n^```text\n(.*?)^```$)?", re.MULTILINE | re.DOTALL)
MARK = "--- end of block ---"


def text_of(name: str) -> str:
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def run(code: str | Path, folder: Path) -> str:
    """Standard output of a program in a process of its own; every warning is an error there."""
    (folder / "program.py").write_text(code, encoding="utf-8") if isinstance(code, str) else None
    program = "program.py" if isinstance(code, str) else str(code)
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(
        [sys.executable, "-W", "error", program],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


# Code of the pages


@pytest.mark.parametrize("page", [page for page in PAGES if BLOCK.search(page.read_text())], ids=lambda page: page.stem)
def test_code_runs_and_prints_what_the_page_says(page, tmp_path):
    """The blocks of a page are one program; a text block after one holds what it prints, with ... for anything."""
    text = page.read_text(encoding="utf-8")
    blocks = BLOCK.findall(text)
    for toml in re.findall(r"^```toml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)[:1]:  # others are parts of files
        (tmp_path / "still_life.toml").write_text(toml, encoding="utf-8")
    printed = run(f"\nprint({MARK!r})\n".join(source for source, _ in blocks), tmp_path).split(f"{MARK}\n")
    assert len(printed) == len(blocks)
    check = doctest.OutputChecker().check_output
    for (source, wanted), got in zip(blocks, printed, strict=True):
        assert not wanted or check(wanted, got, doctest.ELLIPSIS), f"{source}\nprinted\n{got}\ninstead of\n{wanted}"


def test_pages_with_code_are_found():
    assert {"README", "conventions", "cameras", "first_render"} <= {
        p.stem for p in PAGES if BLOCK.search(p.read_text())
    }


@pytest.mark.slow
@pytest.mark.parametrize("script", sorted((DOCS / "gallery").glob("plot_*.py")), ids=lambda path: path.stem)
def test_gallery_programs_run(script, tmp_path):
    assert run(script, tmp_path)


@pytest.mark.slow
def test_pages_build_without_a_warning(tmp_path):
    pytest.importorskip("sphinx_gallery", reason="the docs extra is not installed")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", str(DOCS), str(tmp_path / "html")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    pages = "".join(page.read_text(encoding="utf-8") for page in (tmp_path / "html").glob("*.html"))
    assert "<math" in pages
    assert not re.findall(r'<(?:script|img|link)[^>]*(?:src|href)="https?:', pages)


# Every page, figure and link target


def test_every_page_is_in_the_table_of_contents():
    listed = set(re.findall(r"^(\w+)$", text_of("index"), re.MULTILINE))
    assert {page.stem for page in DOCS.glob("*.md")} - {"index"} == listed & {page.stem for page in DOCS.glob("*.md")}


def test_every_figure_is_drawn_and_shown():
    shown = re.findall(r"^```\{plot\} (\w+)\n:alt: \S", "\n".join(page.read_text() for page in PAGES), re.MULTILINE)
    assert sorted(shown) == sorted(path.stem for path in (DOCS / "figures").glob("*.py"))


def test_the_figure_of_blocks_reads_the_kernels_lists(monkeypatch):
    """It looks into what the kernels hand on, which may change without notice."""
    monkeypatch.syspath_prepend(str(DOCS / "figures"))
    blocks = importlib.import_module("blocks")
    for name in blocks.TRIANGLES:
        shares = np.bincount(blocks.states(name)[0].astype(int).ravel(), minlength=4) / blocks.SIZE**2
        assert (shares[[blocks.OUTSIDE, blocks.TESTED, blocks.HIT]] > 0.004).all()


def test_nothing_is_fetched():
    sources = [path for path in DOCS.rglob("*") if path.suffix in {".md", ".py", ".css", ".rst"}]
    sources = [path for path in sources if "_build" not in path.parts]
    assert len(sources) > 20
    assert not [path for path in sources if re.search(r"https?://|@import|cdn\.", path.read_text(encoding="utf-8"))]


# The API reference


def load_docstrings():
    """docs/extensions/docstrings.py, which reads docstrings for the API reference."""
    spec = importlib.util.spec_from_file_location("docstrings", DOCS / "extensions" / "docstrings.py")
    assert spec and spec.loader
    module = sys.modules["docstrings"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def targets() -> dict[str, str]:
    """Name -> directive of all entries of the API reference."""
    found = re.findall(r"^\.\. auto(\w+):: ([\w.]+)", text_of("api"), re.MULTILINE)
    return {name: kind for kind, name in found}


def resolve(name: str) -> object:
    head, *rest = name.split(".")
    value: object = sys.modules[head]
    for number, part in enumerate(rest):
        try:
            value = getattr(value, part)
        except AttributeError:
            value = importlib.import_module(".".join([head, *rest[: number + 1]]))
    return value


def unknown_names(thing: object) -> list[str]:
    """Names that a docstring describes as parameters or fields, but that the signature and the class do not have."""
    known = set()
    if not inspect.isclass(thing) or not issubclass(thing, BaseException):
        known |= set(inspect.signature(thing).parameters)  # pyright: ignore[reportArgumentType]
    known |= {*dir(thing), *inspect.get_annotations(thing)} if inspect.isclass(thing) else set()
    parts = load_docstrings().take_apart(inspect.getdoc(thing) or "")
    return [name for entry in parts.entries for name in entry.names if name not in known]


def documented() -> list[tuple[str, object]]:
    """All callables of the API reference, and the public methods of its classes."""
    found = [(name, resolve(name)) for name, kind in targets().items() if kind != "data"]
    for name, thing in list(found):
        if inspect.isclass(thing):
            methods_of = inspect.getmembers(
                thing, lambda member: inspect.isfunction(member) or inspect.ismethod(member)
            )
            found += [(f"{name}.{key}", method) for key, method in methods_of if not key.startswith("_")]
    return found


def test_every_public_name_has_an_entry():
    assert {f"mpcam.{name}" for name in mpcam.__all__} <= set(targets())


def test_every_entry_has_a_docstring_and_no_unknown_names():
    things = documented()
    assert len(things) > 60
    for name, thing in things:
        assert inspect.getdoc(thing) or name not in targets(), name
        assert unknown_names(thing) == [], name


def test_docstrings_are_taken_apart():
    parts = load_docstrings().take_apart(
        "Does it (Someone et al. 2008, Table 1).\n\n"
        "first, second (..., 3): points. They may be far. third: one of 1, 2; fourth (H, W): last. Applies to all.\n"
        "Returns (..., 3) things. Raises InputError for others."
    )
    assert [(entry.names, entry.shape, entry.text) for entry in parts.entries] == [
        (("first", "second"), "(..., 3)", "points. They may be far."),
        (("third",), "", "one of 1, 2"),
        (("fourth",), "(H, W)", "last."),
    ]
    assert (parts.before, parts.after) == (["Does it (Someone et al. 2008, Table 1)."], ["Applies to all."])
    assert (parts.returns, parts.raises) == (["(..., 3) things."], ["InputError for others."])


def test_a_name_that_does_not_exist_is_noticed():
    def function(right):
        """wrong: a name. right: another."""

    assert unknown_names(function) == ["wrong"]


# The other references


def test_every_command_has_its_help_on_the_page():
    page = text_of("command_line")
    commands = {name for name in app if not name.startswith("-")}
    assert {"compare", "render", "project", "doctor"} <= commands
    assert set(re.findall(r"^```\{command-help\} ?(.*)$", page, re.MULTILINE)) == {"", *commands}
    for status in (0, EXIT_FAILURE, EXIT_INPUT, EXIT_INTERRUPT):
        assert f"\n| {status} | " in page
    assert f"`{VARIABLE}`" in page and all(f"`{name}`" in page for name in NAMES)


@pytest.mark.parametrize("page", ["command_line", "scenes"])
def test_built_in_scenes_are_named(page):
    assert set(builtin_mesh.names) <= set(re.findall(r"`(\w+)`", text_of(page)))


def test_every_method_and_setting_is_described():
    page = text_of("methods")
    for method in registry.METHODS:
        assert f"\n| `{method}` | " in page
        assert re.search(rf"^## .*`{method}`", page, re.MULTILINE)
    assert all(f'"{bound}"' in page for bound in (*registry.OUTLINE_BOUNDS, *registry.RAY_BOUNDS))
    assert f"`level=0` to {vertex.MOST_LEVELS}" in page
    resolution = inspect.signature(cubemap.Cubemapped).parameters["resolution"].default
    assert f"`resolution={resolution}`" in page


def test_every_column_is_described():
    described = set(re.findall(r"`(\w+)`", text_of("comparing")))
    assert set(COLUMNS) | {"stages_ms", "on_front"} <= described


SECTIONS = (
    ("## Top of the file", tables.SceneTable, None),
    ("## `[[mesh]]`", tables.MeshTable, None),
    ("## `[camera]`", CameraTable, None),
    ('`model = "radial"`', camera_table(mpcam.Radial), CameraTable),
    ('`model = "pinhole"`', camera_table(mpcam.Pinhole), CameraTable),
    ('`model = "orthographic"`', camera_table(mpcam.Orthographic), CameraTable),
    ('`model = "general_linear"`', camera_table(mpcam.GeneralLinear), CameraTable),
    ('`model = "general_linears"`', camera_table(mpcam.GeneralLinears), CameraTable),
    ('`model = "single_pole_occlusion"`', camera_table(mpcam.SinglePoleOcclusion), CameraTable),
    ('`model = "graph_camera"`', camera_table(mpcam.GraphCamera), CameraTable),
    ("### A camera from a file", CameraFile, None),
    ('`type = "directional"`', tables.DirectionalTable, None),
    ('`type = "point"`', tables.PointTable, None),
    ("## `[mirror]`", tables.MirrorTable, tables.ShapeTable),
    ("## `[refractor]`", tables.RefractorTable, tables.ShapeTable),
    ("### Its surface", tables.ShapeTable, None),
    ("### `[mirror.depth_images]`", tables.DepthImagesTable, None),
    ("## `[environment]`", tables.EnvironmentTable, None),
    ("## `[compare]`", tables.CompareTable, None),
)


@pytest.mark.parametrize(("heading", "table", "base"), SECTIONS, ids=[table.__name__ for _, table, _ in SECTIONS])
def test_every_key_of_a_scene_file_is_described(heading, table, base):
    after = (text_of("scenes") + text_of("scene_cameras")).split(heading, 1)[1]
    rows = re.search(r"^\| key \| default \| \|\n\|---\|---\|---\|\n((?:\|.*\n)+)", after, re.MULTILINE)
    assert rows
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[1].splitlines()]
    described = {key.strip("`"): default for key, default, _ in cells}
    inherited = {field.name for field in msgspec.structs.fields(base)} if base else set()
    fields = {field.name: field for field in msgspec.structs.fields(table) if field.name not in inherited}
    assert set(described) - ({"model"} - set(fields)) == set(fields)
    for name, field in fields.items():
        assert (described[name] == "required") == field.required, name
        if not field.required and isinstance(field.default, (int, float, str, tuple)):
            shown = field.default if isinstance(field.default, str) else repr(field.default)
            assert described[name] == f"`{shown}`", name
