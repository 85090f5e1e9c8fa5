"""The report page: one HTML file that needs nothing else, from the parts in `page/`."""

import base64
import html
import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.comparison.encode import as_dict
from mpcam.comparison.pareto import headline
from mpcam.comparison.rows import Findings
from mpcam.io.images import write_image

BUDGET = 14_000_000
"""Bytes of images in the page, as text; beyond it they are shown smaller (the PNG files beside it stay whole)."""
SCRIPTS = ("format.js", "plot.js", "table.js", "viewer.js", "theme.js", "main.js")


@dataclass(frozen=True)
class RowImages:
    """The images of one row: linear RGB (H, W, 3), and the colored difference from the truth if there is a truth."""

    image: np.ndarray
    difference: np.ndarray | None = None


def build(comparison: Findings, images: Mapping[str, RowImages] | None = None, budget: int = BUDGET) -> str:
    """The page as text. images: by row label, those that its viewer shows. Every string from outside is escaped."""
    data = as_dict(comparison) | {"headline": headline(comparison)} | _image_data(comparison, images or {}, budget)
    parts = {
        "TITLE": html.escape(f"{comparison.name}: error against run time"),
        "STYLE": page_part("style.css"),
        "DATA": embed_json(data),
        "SCRIPT": "\n".join(page_part(name) for name in SCRIPTS),
    }
    return fill(page_part("report_template.html"), parts)


def fill(template: str, parts: Mapping[str, str]) -> str:
    """The template with each {{NAME}} replaced by the part of that name; parts are taken as they are."""
    # split rather than replace one after the other: a part may contain another's mark
    pieces = template.split("{{")
    text = [pieces[0]]
    for piece in pieces[1:]:
        name, rest = piece.split("}}", 1)
        text += [parts[name], rest]
    return "".join(text)


def embed_json(data: Any) -> str:
    """JSON that is safe inside a script element: no "<" that could end the element or open a comment."""
    text = json.dumps(data, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def page_part(name: str) -> str:
    """A file of the folder `page`, as text."""
    return (files("mpcam.comparison") / "page" / name).read_text(encoding="utf-8")


def _image_data(comparison: Findings, images: Mapping[str, RowImages], budget: int) -> dict[str, Any]:
    shrink = 1
    while True:
        truth = "" if comparison.truth_image is None else data_uri(comparison.truth_image, shrink)
        rows = {
            label: [
                data_uri(item.image, shrink),
                "" if item.difference is None else data_uri(item.difference, shrink),
            ]
            for label, item in images.items()
        }
        size = len(truth) + sum(len(uri) for pair in rows.values() for uri in pair)
        if size <= budget or shrink >= 16:
            return {"truth": truth, "images": rows, "shrink": shrink}
        shrink *= 2


def data_uri(image: np.ndarray, shrink: int = 1) -> str:
    """A linear image (H, W, 3) as a PNG within the text of a page, `shrink` times smaller."""
    if shrink > 1:
        image = _box_filtered(np.asarray(image, np.float64), shrink)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "image.png"
        write_image(path, np.asarray(image, np.float32))
        return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def _box_filtered(image: np.ndarray, factor: int) -> np.ndarray:
    """Means over factor x factor pixels, those at the right and lower edge over what there is."""
    height, width = image.shape[:2]
    rows, columns = np.arange(0, height, factor), np.arange(0, width, factor)
    total = np.add.reduceat(np.add.reduceat(image, rows, axis=0), columns, axis=1)
    heights, widths = np.minimum(factor, height - rows), np.minimum(factor, width - columns)
    return total / (heights[:, None, None] * widths[None, :, None])
