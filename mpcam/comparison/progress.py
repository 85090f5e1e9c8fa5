"""A progress bar on the terminal for `compare`."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from mpcam.comparison.driver import Progress


@contextmanager
def bar(console: "Console", title: str) -> Iterator["Progress"]:
    """Show a bar while the block runs; yields the callback that `compare` takes. Gone when done, and without a terminal
    nothing is drawn at all."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.fields[title]}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[what]}", markup=False),
    )
    # redrawing on its own thread would take time from whatever is being measured; so only between the calls
    with Progress(
        *columns, console=console, transient=True, auto_refresh=False, disable=not console.is_terminal
    ) as shown:
        task = shown.add_task("", title=title, what="")

        def update(done: int, total: int, what: str) -> None:
            shown.update(task, completed=done, total=total, what=what)
            shown.refresh()

        yield update
