"""A comparison as CSV and as what JSON can hold."""

import csv
import io
import math
from typing import Any

from mpcam.comparison.columns import COLUMNS
from mpcam.comparison.numbers import json_number
from mpcam.comparison.pareto import EXACT_MISMATCH, EXACT_PIXELS, fronts
from mpcam.comparison.rows import Findings, Row


def as_csv(findings: Findings) -> str:
    """All rows as CSV with a header: the fields of `Row`, times in ms; empty for not measured, `inf` for infinite;
    one column `stage_NAME_ms` for each stage that any row has."""
    stages = list(dict.fromkeys(name for row in findings.rows for name in row.stages_ms))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    names = ["method", "setting", "parameter", *COLUMNS, "on_front", "note"]
    writer.writerow([*names, *(f"stage_{name}_ms" for name in stages)])
    for row in findings.rows:
        cells = [_csv_cell(getattr(row, name)) for name in names]
        writer.writerow([*cells, *(_csv_cell(row.stages_ms.get(name)) for name in stages)])
    return out.getvalue()


def as_dict(findings: Findings) -> dict[str, Any]:
    """Everything but the images, ready for JSON: NaN becomes None, infinity the text "inf"."""
    return {
        "name": findings.name,
        "scene": dict(findings.scene),
        "machine": dict(findings.machine),
        "measured": dict(findings.measured),
        "left_out": dict(findings.left_out),
        "columns": {c.name: {"title": c.title, "unit": c.unit, "help": c.help} for c in COLUMNS.values()},
        "rows": [_row_dict(row) for row in findings.rows],
        "fronts": fronts(findings),
        "float_precision": {"pixels": EXACT_PIXELS, "mismatch": EXACT_MISMATCH},
    }


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
