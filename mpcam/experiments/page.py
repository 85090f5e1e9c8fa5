"""The page of an experiment: one HTML file that needs nothing else, in the style of the report of a comparison."""

import base64
import html
from collections.abc import Mapping
from importlib.resources import files
from itertools import groupby

from mpcam.comparison.report import data_uri, fill, page_part
from mpcam.experiments.figures import gif
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table, shown

Drawn = Mapping[str, tuple[bytes, bytes]]
WIDEST = 640  # pixels of a picture in the page; wider ones are shown smaller, their PNG files are whole


def build(report: Report, drawn: Drawn) -> str:
    """The page as text. drawn: each plot as SVG for light and for dark pages, by name."""
    template = (files("mpcam.experiments") / "page" / "template.html").read_text(encoding="utf-8")
    style = (files("mpcam.experiments") / "page" / "experiment.css").read_text(encoding="utf-8")
    kicker = f"mpcam experiment {report.name}" + (" --quick" if report.quick else "")
    parts = {
        "TITLE": html.escape(report.title),
        "STYLE": page_part("style.css") + style,
        "KICKER": html.escape(kicker),
        "SUBJECT": html.escape(report.subject),
        "READING": html.escape(report.reading),
        "QUICK": '<p class="quick">Quick run: small scenes, few rounds. The figures mean little.</p>' * report.quick,
        "PARTS": "\n".join(_part(part, drawn) for part in report.parts),
        "LEFT_OUT": "".join(f'<p class="help">Left out: {html.escape(text)}.</p>' for text in report.left_out),
        "SCENE": _facts(report.scene),
        "MACHINE": _facts(report.machine),
        "MEASURED": _facts(report.measured),
        "SCRIPT": page_part("theme.js") + "startTheme();",
    }
    return fill(template, parts)


def _part(part: Table | Plot | Gallery, drawn: Drawn) -> str:
    if isinstance(part, Table):
        return _table(part)
    if isinstance(part, Plot):
        return _plot(part, drawn[part.name])
    return _gallery(part)


def _table(table: Table) -> str:
    name = html.escape(table.name)
    body = "".join(
        "<tr>" + "".join(_cell(row.get(c.name), c, first=i == 0) for i, c in enumerate(table.columns)) + "</tr>"
        for row in table.rows
    )
    return (
        f'<section><h2 id="{name}">{html.escape(table.title)}</h2>'
        f'<div class="table-box" tabindex="0" role="region" aria-labelledby="{name}"><table class="figures">'
        f"<thead>{_groups(table.columns)}<tr>{''.join(_heading(c, table) for c in table.columns)}</tr></thead>"
        f"<tbody>{body}</tbody></table></div>{_note(table.note)}</section>"
    )


def _groups(columns: tuple[Column, ...]) -> str:
    """A row of headings that span several columns; none where no column has one."""
    if not any(column.group for column in columns):
        return ""
    cells = []
    for group, members in groupby(columns, key=lambda column: column.group):
        span = len(list(members))
        cells.append(
            f'<th colspan="{span}" scope="colgroup">{html.escape(group)}</th>'
            if group
            else f'<td colspan="{span}"></td>'
        )
    return f'<tr class="groups">{"".join(cells)}</tr>'


def _heading(column: Column, table: Table) -> str:
    unit = f"<small>{html.escape(column.unit)}</small>" if column.unit else ""
    worded = any(isinstance(row.get(column.name), str) for row in table.rows)
    kind = ' class="paper"' if column.paper else ' class="words"' if worded else ""
    return f'<th scope="col"{kind} title="{html.escape(column.help)}">{html.escape(column.title)}{unit}</th>'


def _cell(value: object, column: Column, first: bool) -> str:
    text = html.escape(shown(value))
    if first:
        return f'<th scope="row">{text}</th>'
    kinds = [name for name, is_so in (("paper", column.paper), ("words", isinstance(value, str))) if is_so]
    return f'<td class="{" ".join(kinds)}">{text}</td>' if kinds else f"<td>{text}</td>"


def _plot(plot: Plot, drawn: tuple[bytes, bytes]) -> str:
    images = "".join(
        f'<img class="only-{theme}" alt="{html.escape(plot.alt)}" src="{_svg_uri(image)}">'
        for theme, image in zip(("light", "dark"), drawn, strict=True)
    )
    caption = f'<figcaption class="help">{html.escape(plot.caption)}</figcaption>'
    box = f'<div class="plot-box" tabindex="0" role="region" aria-label="Plot">{images}</div>'
    return f"<section><figure>{box}{caption}</figure></section>"


def _svg_uri(image: bytes) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(image).decode("ascii")


def _gallery(gallery: Gallery) -> str:
    figures = []
    for picture in gallery.pictures:
        height, width, _ = picture.image.shape
        shrink = -(-width // WIDEST)
        size = f'width="{width}" height="{height}"'
        caption = html.escape(picture.caption)
        figures.append(
            f'<figure><img {size} alt="{caption}" src="{_picture_uri(picture, shrink)}">'
            f'<figcaption class="help">{caption}</figcaption></figure>'
        )
    title = html.escape(gallery.title)
    return f'<section><h2>{title}</h2><div class="gallery">{"".join(figures)}</div>{_note(gallery.note)}</section>'


def _picture_uri(picture: Picture, shrink: int) -> str:
    if not picture.frames:
        return data_uri(picture.image, shrink)
    return "data:image/gif;base64," + base64.b64encode(gif(picture, shrink)).decode("ascii")


def _note(text: str) -> str:
    return f'<p class="help">{html.escape(text)}</p>' if text else ""


def _facts(facts: Mapping[str, str]) -> str:
    return "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd>" for name, value in facts.items())
