"""The main job in one call: two built-in scenes through every method, table on the terminal, report page on disk."""

from pathlib import Path
from typing import TYPE_CHECKING

from mpcam.comparison.driver import compare
from mpcam.comparison.progress import bar
from mpcam.comparison.table import Comparison
from mpcam.comparison.terminal import print_comparison

if TYPE_CHECKING:
    from rich.console import Console

SCENES = ("facade", "characters")
SIZE = 512


def run_demo(
    output: str | Path,
    *,
    scenes: tuple[str, ...] = SCENES,
    size: int = SIZE,
    repeats: int = 9,
    console: "Console | None" = None,
) -> list[Comparison]:
    """Compare the built-in `scenes` at `size` x `size` pixels, print each table and write `output`/SCENE/report.html.

    Takes a minute or two on two cores. Raises `InputError` for unknown scenes and an unusable folder.
    """
    from rich.console import Console

    from mpcam.scene.builtin import builtin_scene

    console = console or Console()
    done = []
    pages = []
    for name in scenes:
        scene = builtin_scene(name, width=size, height=size)
        folder = Path(output) / name
        with bar(console, name) as progress:
            done.append(compare(scene, repeats=repeats, output=folder, progress=progress))
        print_comparison(done[-1], console)
        pages.append(folder / "report.html")
    console.print()
    for page in pages:
        console.print(f"Report: {page}", highlight=False, markup=False, soft_wrap=True)
    return done
