"""What a comparison holds: one row per method and setting, with the facts needed to read it."""

import csv
import io
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.errors import InputError

NAN = float("nan")


@dataclass(frozen=True)
class Column:
    """How a number of `Row` is shown: its field, a heading, the unit ("" for none), and what it means."""

    name: str
    title: str
    unit: str
    help: str


ERROR_COLUMNS = (
    Column("flip", "FLIP", "", "Mean LDR-FLIP error of the image, 0 to 1: what a viewer sees flipping between them."),
    Column("rmse", "Image RMSE", "", "Root mean squared difference of the images in sRGB space, peak 1."),
    Column("hit_mismatch", "Hits wrong", "%", "Share of the pixels that hit where the truth misses, or the reverse."),
    Column(
        "triangle_mismatch",
        "Triangles wrong",
        "%",
        "Share of the pixels that show another triangle, at a depth off by more than 1e-4 of the true one.",
    ),
    Column("depth_median", "Depth error, median", "", "Median of |depth - truth| / truth over the common hits."),
    Column("depth_p999", "Depth error, 99.9%", "", "99.9th percentile of |depth - truth| / truth."),
    Column(
        "projection_median",
        "Projection error, median",
        "px",
        "Median distance from a pixel's centre to the exact image of the point shown there.",
    ),
    Column("projection_p95", "Projection error, 95%", "px", "95th percentile of the projection error."),
    Column("projection_max", "Projection error, largest", "px", "Largest projection error."),
    Column(
        "ray_angle", "Ray error", "mrad", "Root mean square angle between camera triangles' rays and the true ones."
    ),
)
PSNR_COLUMN = Column("psnr", "PSNR", "dB", "Peak signal-to-noise ratio in sRGB space, peak 1; infinite when equal.")
TIME_COLUMNS = (
    Column("still_ms", "Still frame", "ms", "Median time of a frame when nothing moves: all building is done."),
    Column("moving_ms", "Moving frame", "ms", "Median time to take new vertices, rebuild what needs it, and render."),
)
OTHER_COLUMNS = (
    Column("still_spread", "Still, spread", "ms", "Interquartile range of the still frames."),
    Column("moving_spread", "Moving, spread", "ms", "Interquartile range of the moving frames."),
    Column("shade_ms", "Shading", "ms", "Median time to shade first hits, barycentric weights worked out included."),
    Column("compile_ms", "First frame", "ms", "Preparing and the first frame together, kernels compiled or loaded."),
    Column("tests", "Tests", "", "Tests of a pixel against a triangle; 0 where a method makes none of its own."),
    Column("rendered", "Rendered", "", "Tests that hit, before the nearest hit of each pixel is chosen."),
    Column("overdraw", "Tests per hit", "", "Tests divided by tests that hit; 1 is ideal."),
)
COLUMNS = {c.name: c for c in (*ERROR_COLUMNS, PSNR_COLUMN, *TIME_COLUMNS, *OTHER_COLUMNS)}


@dataclass(frozen=True)
class Row:
    """One method at one setting. Shares are 0 to 1, times in ms, NaN where a number was not or cannot be measured.

    `parameter` is the setting as a number, `setting` as text ("" when the method has none). The columns' meaning is in
    `COLUMNS`. `stages_ms` are the medians of what a moving frame (a still one, if none was timed) reports about itself.
    `on_front`: no other row has a smaller FLIP and a shorter still frame.
    """

    method: str
    setting: str = ""
    parameter: float | None = None
    hit_mismatch: float = NAN
    triangle_mismatch: float = NAN
    depth_median: float = NAN
    depth_p999: float = NAN
    rmse: float = NAN
    psnr: float = NAN
    flip: float = NAN
    projection_median: float = NAN
    projection_p95: float = NAN
    projection_max: float = NAN
    ray_angle: float = NAN
    still_ms: float = NAN
    still_spread: float = NAN
    moving_ms: float = NAN
    moving_spread: float = NAN
    shade_ms: float = NAN
    compile_ms: float = NAN
    stages_ms: dict[str, float] = field(default_factory=dict)
    tests: float = NAN
    rendered: float = NAN
    overdraw: float = NAN
    on_front: bool = False
    note: str = ""

    @property
    def label(self) -> str:
        """Method and setting, as tables and plots show them."""
        return f"{self.method} {self.setting}".strip()


@dataclass(frozen=True, eq=False)
class Comparison:
    """The rows of one scene, what was compared on what, and the images.

    scene, machine: facts by name, in the order in which they should be read. left_out: method -> why it does not apply.
    images: linear RGB (H, W, 3) float32 by row label; truth_image and truth_depth (H, W) are those of the truth.
    """

    rows: tuple[Row, ...]
    name: str = "scene"
    scene: Mapping[str, str] = field(default_factory=dict)
    machine: Mapping[str, str] = field(default_factory=dict)
    measured: Mapping[str, str] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    images: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False)
    truth_image: np.ndarray | None = field(default=None, repr=False)
    truth_depth: np.ndarray | None = field(default=None, repr=False)
    camera: Any = field(default=None, repr=False)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __str__(self) -> str:
        from mpcam.comparison.terminal import as_text

        return as_text(self)

    def row(self, method: str, setting: object = "") -> Row:
        """The row of a method, and of one of its settings if it has several; raises `InputError` if there is none."""
        found = [r for r in self.rows if r.method == method and str(setting) in ("", r.setting, str(r.parameter))]
        if len(found) == 1:
            return found[0]
        known = ", ".join(r.label for r in self.rows) or "none"
        problem = "no row" if not found else f"{len(found)} rows"
        raise InputError(f"There is {problem} for method {method!r} and setting {str(setting)!r}; the rows: {known}.")

    def column(self, name: str) -> np.ndarray:
        """The numbers of a column as float64, one per row; raises `InputError` for an unknown column."""
        if name not in COLUMNS:
            raise InputError(f"Unknown column {name!r}; the columns: {', '.join(COLUMNS)}.")
        return np.array([getattr(row, name) for row in self.rows], np.float64)

    def to_csv(self) -> str:
        """All rows as CSV with a header: the fields of `Row`, times in ms; empty for not measured, `inf` for infinite;
        one column `stage_NAME_ms` for each stage that any row has."""
        stages = list(dict.fromkeys(name for row in self.rows for name in row.stages_ms))
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        names = ["method", "setting", "parameter", *COLUMNS, "on_front", "note"]
        writer.writerow([*names, *(f"stage_{name}_ms" for name in stages)])
        for row in self.rows:
            cells = [_csv_cell(getattr(row, name)) for name in names]
            writer.writerow([*cells, *(_csv_cell(row.stages_ms.get(name)) for name in stages)])
        return out.getvalue()

    def to_dict(self) -> dict[str, Any]:
        """Everything but the images, ready for JSON: NaN becomes None, infinity the text "inf"."""
        from mpcam.comparison.pareto import EXACT_MISMATCH, EXACT_PIXELS, fronts

        return {
            "name": self.name,
            "scene": dict(self.scene),
            "machine": dict(self.machine),
            "measured": dict(self.measured),
            "left_out": dict(self.left_out),
            "columns": {c.name: {"title": c.title, "unit": c.unit, "help": c.help} for c in COLUMNS.values()},
            "rows": [_row_dict(row) for row in self.rows],
            "fronts": fronts(self),
            "float_precision": {"pixels": EXACT_PIXELS, "mismatch": EXACT_MISMATCH},
        }

    def to_json(self) -> str:
        """`to_dict` as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"

    def write(self, output: str | Path) -> Path:
        """Write CSV, JSON, plot, images and the report page into a folder; see `mpcam.comparison.output.write`."""
        from mpcam.comparison.output import write

        return write(self, output)


def json_number(value: float | None) -> float | int | str | None:
    """A number as JSON can hold it: None for NaN, "inf" for infinity, an integer where it is one."""
    if value is None or math.isnan(value):
        return None
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return int(value) if float(value).is_integer() and abs(value) < 2**53 else float(value)


def _row_dict(row: Row) -> dict[str, Any]:
    numbers = {name: json_number(getattr(row, name)) for name in COLUMNS}
    return {
        "label": row.label,
        "method": row.method,
        "setting": row.setting,
        "parameter": json_number(row.parameter),
        **numbers,
        "stages_ms": {name: json_number(value) for name, value in row.stages_ms.items()},
        "on_front": row.on_front,
        "note": row.note,
    }


def _csv_cell(value: Any) -> Any:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, str) and value[:1] in "=+-@" and value:
        return "'" + value  # a spreadsheet would run it as a formula
    return value
