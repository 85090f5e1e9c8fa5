"""What an experiment found: tables, plots and pictures in reading order, and the facts needed to judge them."""

import csv
import io
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from mpcam.comparison.numbers import format_number, json_number

Row = Mapping[str, Any]
"""Cells by the name of their column: text, numbers, or None."""


@dataclass(frozen=True)
class Column:
    """A column of a table: key of its cells, heading, unit ("" for none) and meaning.

    group: a heading over several neighbors. paper: the figures are the paper's, not ours. brief: shown on a terminal.
    """

    name: str
    title: str
    unit: str = ""
    help: str = ""
    group: str = ""
    paper: bool = False
    brief: bool = True


@dataclass(frozen=True)
class Table:
    """Rows of text and numbers; a missing key, None and NaN all mean that there is no figure.

    name: of its CSV file, without the suffix.
    """

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    note: str = ""

    def row(self, **wanted: Any) -> Row:
        """The first row whose cells are these; raises KeyError if there is none."""
        for row in self.rows:
            if all(row.get(name) == value for name, value in wanted.items()):
                return row
        raise KeyError(f"table {self.name} has no row with {wanted}")

    def to_csv(self) -> str:
        """The rows as CSV with a header; empty where there is no figure."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([column.name for column in self.columns])
        for row in self.rows:
            values = (row.get(column.name) for column in self.columns)
            writer.writerow(["" if is_missing(value) else value for value in values])
        return out.getvalue()


@dataclass(frozen=True)
class Plot:
    """A plot: draw(figure, theme) fills a matplotlib figure of width x height inches. alt: what is to be seen."""

    name: str
    caption: str
    alt: str
    draw: Callable[[Any, Any], None] = field(repr=False)
    width: float = 9.0
    height: float = 4.2


@dataclass(frozen=True, eq=False)
class Picture:
    """An image, linear RGB (H, W, 3), with its caption. name: of its PNG file, without the suffix.

    frames: images of that size, to be shown one after another, at `seconds` each and without end, in place of the one;
    they become a GIF file of the same name.
    """

    name: str
    caption: str
    image: np.ndarray = field(repr=False)
    frames: tuple[np.ndarray, ...] = field(default=(), repr=False)
    seconds: float = 0.08


@dataclass(frozen=True)
class Gallery:
    """Pictures side by side."""

    title: str
    pictures: tuple[Picture, ...]
    note: str = ""


@dataclass(frozen=True)
class Report:
    """All that an experiment found.

    reading: what the figures show and what they do not, in a few plain sentences. parts: tables, plots and galleries
    in reading order. scene, machine, measured: facts by name. left_out: what could not be run, and why. quick: made
    with small scenes and few rounds, so that the figures mean little.
    """

    name: str
    title: str
    subject: str
    reading: str
    parts: tuple[Table | Plot | Gallery, ...]
    scene: Mapping[str, str] = field(default_factory=dict)
    machine: Mapping[str, str] = field(default_factory=dict)
    measured: Mapping[str, str] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    quick: bool = False

    @property
    def tables(self) -> tuple[Table, ...]:
        return tuple(part for part in self.parts if isinstance(part, Table))

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(part for part in self.parts if isinstance(part, Plot))

    @property
    def pictures(self) -> tuple[Picture, ...]:
        return tuple(picture for part in self.parts if isinstance(part, Gallery) for picture in part.pictures)

    def table(self, name: str) -> Table:
        """The table of that name; raises KeyError if there is none."""
        return {table.name: table for table in self.tables}[name]

    def to_dict(self) -> dict[str, Any]:
        """Everything but plots and pictures, ready for JSON: no figure becomes None, infinity the text "inf"."""
        return {
            "experiment": self.name,
            "title": self.title,
            "subject": self.subject,
            "reading": self.reading,
            "quick": self.quick,
            "tables": {table.name: _table_dict(table) for table in self.tables},
            "left_out": list(self.left_out),
            "scene": dict(self.scene),
            "machine": dict(self.machine),
            "measured": dict(self.measured),
        }


def is_missing(value: Any) -> bool:
    """Whether a cell holds no figure."""
    return value is None or (isinstance(value, float) and math.isnan(value))


def as_number(value: Any) -> float:
    """A cell as a number; NaN where there is no figure."""
    return math.nan if is_missing(value) else float(value)


def shown(value: Any) -> str:
    """A cell as people read it: three digits, "-" where there is no figure."""
    if is_missing(value):
        return "-"
    return value if isinstance(value, str) else format_number(float(value))


def _table_dict(table: Table) -> dict[str, Any]:
    columns = [column.name for column in table.columns]
    return {
        "title": table.title,
        "note": table.note,
        "columns": [asdict(column) for column in table.columns],
        "rows": [{name: _json_cell(row.get(name)) for name in columns} for row in table.rows],
    }


def _json_cell(value: Any) -> Any:
    return value if value is None or isinstance(value, (str, bool)) else json_number(value)
