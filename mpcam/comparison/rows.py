"""What a comparison found: one row per method and setting, with the facts needed to read it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mpcam.comparison.columns import COLUMNS
from mpcam.errors import InputError

NAN = float("nan")


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
class Findings:
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
