"""The rooms of the code from the ground up, and every import between its files: read from the sources, never run.

`tests/test_layout.py` checks them, `docs/figures/rooms.py` draws them, and docs/architecture.md says what each is for.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = {"mpcam": ROOT, "mpcam_kernels": ROOT / "kernels"}
"""The packages, and the folder that each lies in."""
ROOMS = {
    "ground": ("mpcam.errors", "mpcam.checks"),
    "math": ("mpcam.math",),
    "cameras": ("mpcam.cameras",),
    "geometry": ("mpcam.geometry",),
    "scene": ("mpcam.scene",),
    "kernels": ("mpcam_kernels",),
    "backend": ("mpcam.backend",),
    "tracing": ("mpcam.tracing", "mpcam.truth"),
    "rendering": ("mpcam.rendering",),
    "depth images": ("mpcam.depth_images",),
    "decomposition": ("mpcam.decomposition",),
    "fitting": ("mpcam.fitting",),
    "effects": ("mpcam.effects",),
    "pictures": ("mpcam.pictures",),
    "io": ("mpcam.io",),
    "comparison": ("mpcam.comparison",),
    "stress": ("mpcam.stress",),
    "experiments": ("mpcam.experiments",),
    "front": ("mpcam",),
    "command line": (
        "mpcam.doctor",
        "mpcam.cli",
        "mpcam.cli_common",
        "mpcam.cli_fit",
        "mpcam.cli_mirrors",
        "mpcam.__main__",
    ),
}
"""Rooms by name, from the ground up, each with its packages and modules: a room may import those before it alone."""

Arrows = dict[str, set[str]]


def modules(sources: Mapping[str, Path]) -> dict[str, Path]:
    """The files of packages by dotted name; a package's own name is that of its __init__.py."""
    found = {}
    for package, folder in sources.items():
        for path in sorted((folder / package).rglob("*.py")):
            parts = path.relative_to(folder).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def arrows(files: Mapping[str, Path]) -> Arrows:
    """For each module those that its file imports, anywhere in it: inside of functions, and for type checkers too."""
    return {
        name: {*_imports(ast.parse(path.read_text(encoding="utf-8")), files)} - {name} for name, path in files.items()
    }


def _imports(tree: ast.AST, files: Mapping[str, Path]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in files)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                submodule = f"{node.module}.{alias.name}"
                yield from {submodule if submodule in files else str(node.module)} & files.keys()
        elif isinstance(node, ast.Call) and node.args:
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))  # importlib.import_module or without
            yield from _by_name(node.args[0], files) if called == "import_module" else ()


def _by_name(name: ast.expr, files: Mapping[str, Path]) -> Iterator[str]:
    """Modules that a name put together at run time may mean: all that begin and end as it does."""
    if isinstance(name, ast.Constant):
        yield from {str(name.value)} & files.keys()
    elif isinstance(name, ast.JoinedStr):
        head, tail = (
            str(end.value) if isinstance(end, ast.Constant) else "" for end in (name.values[0], name.values[-1])
        )
        if head not in ("", "mpcam."):  # which would mean everything
            yield from (module for module in files if module.startswith(head) and module.endswith(tail))


def circles(arrows: Arrows) -> list[list[str]]:
    """Groups of modules in which each leads to each other (strongly connected, two at least), by Tarjan's method."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    open_, found = [], []

    def visit(module: str) -> None:
        order[module] = low[module] = len(order)
        open_.append(module)
        for other in sorted(arrows[module]):
            if other not in order:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in open_:
                low[module] = min(low[module], order[other])
        if low[module] == order[module]:
            at = open_.index(module)
            group = open_[at:]
            del open_[at:]
            if len(group) > 1:
                found.append(sorted(group))

    for module in arrows:
        if module not in order:
            visit(module)
    return found


def room_of(module: str, rooms: Mapping[str, Iterable[str]] = ROOMS) -> str:
    """The room of a module; raises KeyError where none has it."""
    for name, members in rooms.items():
        if module in members or any(module.startswith(f"{member}.") for member in members if member != "mpcam"):
            return name
    raise KeyError(f"{module} is in no room: put it into one, or its room into tools/rooms.py and docs/architecture.md")


def upward(arrows: Arrows, rooms: Mapping[str, Iterable[str]] = ROOMS) -> list[str]:
    """Imports of rooms that come later, "from -> to"."""
    floor = {name: number for number, name in enumerate(rooms)}
    return [
        f"{module} -> {other}"
        for module, others in arrows.items()
        for other in sorted(others)
        if floor[room_of(other, rooms)] > floor[room_of(module, rooms)]
    ]
