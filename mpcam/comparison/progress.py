"""Progress of what takes longer than a moment: steps counted, and a bar on the terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

Progress = Callable[[int, int, str], None]
"""Called as progress(done, total, what) after each step."""


class StepCounter:
    """Counts steps for a progress callback, which may be None."""

    def __init__(self, progress: Progress | None, total: int):
        self.progress, self.total, self.count = progress, total, 0

    def done(self, what: str) -> None:
        """One step is done."""
        self.count += 1
        if self.progress is not None:
            self.progress(self.count, self.total, what)

    def skip(self, steps: int) -> None:
        """So many steps will not be needed."""
        self.total -= steps


@contextmanager
def bar(console: "Console", title: str) -> Iterator[Progress]:
    """Show a bar while the block runs; yields a progress callback. Gone when done, and without a terminal
    nothing is drawn at all."""
    from rich import progress as rich

    columns = (
        rich.TextColumn("{task.fields[title]}", markup=False),
        rich.BarColumn(),
        rich.TextColumn("{task.percentage:>3.0f}%"),
        rich.TimeElapsedColumn(),
        rich.TextColumn("{task.fields[what]}", markup=False),
    )
    # redrawing on its own thread would take time from whatever is being measured; so only between the calls
    with rich.Progress(
        *columns, console=console, transient=True, auto_refresh=False, disable=not console.is_terminal
    ) as shown:
        task = shown.add_task("", title=title, what="")

        def update(done: int, total: int, what: str) -> None:
            shown.update(task, completed=done, total=total, what=what)
            shown.refresh()

        yield update
