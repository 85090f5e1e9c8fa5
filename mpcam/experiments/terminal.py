"""The tables of an experiment on a terminal."""

from typing import TYPE_CHECKING

from mpcam.experiments.catalog import EXPERIMENTS
from mpcam.experiments.results import Report, Table, shown

if TYPE_CHECKING:
    from rich.console import Console

WIDTH = 120


def print_experiments(console: "Console") -> None:
    """Print the experiments, a line each."""
    widest = max(map(len, EXPERIMENTS))
    for known in EXPERIMENTS.values():
        line = f"{known.name:{widest}}  {known.summary}"
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def print_report(report: Report, console: "Console") -> None:
    """Print the tables, what was left out and how to read them."""
    for table in report.tables:
        console.print(_rich(table), highlight=False)
        if table.note:
            console.print(table.note, style="dim", highlight=False, markup=False)
        console.print()
    for text in report.left_out:
        console.print(f"Left out: {text}.", style="dim", highlight=False, markup=False)
    console.print(report.reading, highlight=False, markup=False)


def _rich(table: Table):
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    made = RichTable(
        title=Text(table.title, "bold"),
        title_justify="left",
        title_style="",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
        padding=(0, 1),
    )
    columns = [column for column in table.columns if column.brief]
    before = ""
    for number, column in enumerate(columns):
        group, before = (column.group if column.group != before else ""), column.group
        lines = [group, column.title, column.unit] if any(c.group for c in columns) else [column.title, column.unit]
        made.add_column("\n".join(lines).rstrip("\n"), justify="right" if number else "left", no_wrap=True)
    for row in table.rows:
        made.add_row(*(Text(shown(row.get(c.name)), "dim" if c.paper else "") for c in columns))
    return made
