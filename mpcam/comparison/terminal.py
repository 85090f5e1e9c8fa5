"""The comparison as a table for a terminal of 100 columns."""

import io
from typing import TYPE_CHECKING

import numpy as np

from mpcam.comparison.numbers import format_column, format_spread
from mpcam.comparison.pareto import headline, winner_sentence
from mpcam.comparison.rows import Findings, Row

if TYPE_CHECKING:
    from rich.console import Console

WIDTH = 100
_NUMBERS = (
    ("flip", "FLIP"),
    ("hit_mismatch", "Hits\nwrong %"),
    ("triangle_mismatch", "Tri.\nwrong %"),
    ("depth_p999", "Depth\n99.9%"),
    ("projection_median", "Proj.\nmed. px"),
    ("projection_p95", "Proj.\n95% px"),
)


_MIRROR = (
    ("flip", "FLIP"),
    ("psnr", "PSNR\ndB"),
    ("ray_angle", "Rays\nmrad"),
    ("overdraw", "Tests\nper hit"),
)


def print_comparison(comparison: Findings, console: "Console | None" = None) -> None:
    """Print the table, what was left out and who wins, at most 100 columns wide."""
    from rich.console import Console

    console = console or Console()
    width = min(WIDTH, console.width)
    console.print(_table(comparison), width=width, highlight=False)
    for method, reason in comparison.left_out.items():
        console.print(f"{method} is left out: {reason}.", style="dim", width=width, highlight=False, markup=False)
    console.print(headline(comparison), style="bold", width=width, highlight=False, markup=False)
    for name, title in (("still_ms", "Still"), ("moving_ms", "Moving")):
        if not np.all(np.isnan(comparison.column(name))):
            sentence = f"{title} frames. {winner_sentence(comparison, 'flip', name)}"
            console.print(sentence, width=width, highlight=False, markup=False)


def as_text(comparison: Findings) -> str:
    """The same without colors, as a string."""
    from rich.console import Console

    out = io.StringIO()
    print_comparison(comparison, Console(file=out, width=WIDTH, color_system=None))
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines())


def _table(comparison: Findings):
    from rich import box
    from rich.table import Table
    from rich.text import Text

    facts = comparison.scene
    about = ", ".join(
        text
        for text in (
            facts.get("triangles") and f"{facts['triangles']} triangles",
            facts.get("camera"),
            facts.get("image"),
        )
        if text
    )
    title = Text.assemble((comparison.name, "bold"), (f"  {about}", "dim") if about else "")
    caption = Text("*: on the front of FLIP against still frames. Times: median ± half the interquartile range.", "dim")
    table = Table(
        title=title,
        title_justify="left",
        title_style="",
        caption=caption,
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
        padding=(0, 1),
    )
    table.add_column("", width=1)
    table.add_column("Method", no_wrap=True)
    shown = _NUMBERS if np.isnan(comparison.column("ray_angle")).all() else _MIRROR
    for _, heading in shown:
        table.add_column(heading, justify="right", no_wrap=True)
    for heading in ("Still\nms", "Moving\nms"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in comparison.rows:
        numbers = [format_column(name, getattr(row, name), 2) for name, _ in shown]
        table.add_row(
            "*" if row.on_front else "", Text(row.label), *numbers, *_times(row), style="bold" if row.on_front else ""
        )
    return table


def _times(row: Row) -> tuple[str, str]:
    return format_spread(row.still_ms, row.still_spread), format_spread(row.moving_ms, row.moving_spread)
