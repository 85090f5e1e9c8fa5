"""`Comparison`: what `mpcam.compare` returns, with all that can be done with it."""

import json
from pathlib import Path
from typing import Any

from mpcam.comparison.encode import as_csv, as_dict
from mpcam.comparison.output import write
from mpcam.comparison.rows import Findings
from mpcam.comparison.terminal import as_text


class Comparison(Findings):
    """The rows of one scene, what was compared on what, and the images.

    scene, machine: facts by name, in the order in which they should be read. left_out: method -> why it does not apply.
    images: linear RGB (H, W, 3) float32 by row label; truth_image and truth_depth (H, W) are those of the truth.
    """

    def __str__(self) -> str:
        return as_text(self)

    def to_csv(self) -> str:
        """All rows as CSV with a header: the fields of `Row`, times in ms; empty for not measured, `inf` for infinite;
        one column `stage_NAME_ms` for each stage that any row has."""
        return as_csv(self)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the images, ready for JSON: NaN becomes None, infinity the text "inf"."""
        return as_dict(self)

    def to_json(self) -> str:
        """`to_dict` as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"

    def write(self, output: str | Path) -> Path:
        """Write CSV, JSON, plot, images and the report page into a folder; see `mpcam.comparison.output.write`."""
        return write(self, output)
