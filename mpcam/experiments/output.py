"""The files of an experiment: tables, plots, pictures, results.json and the page."""

from pathlib import Path

from mpcam.comparison.output import PAGE, write_results, written_whole
from mpcam.experiments import page
from mpcam.experiments.figures import DARK, LIGHT, gif, png, svg
from mpcam.experiments.results import Report
from mpcam.io.images import write_image


def write(report: Report, output: str | Path) -> Path:
    """Write all files of an experiment into a folder and return the path of its page.

    report.html (self-contained), results.json, a CSV for each table, a PNG for each plot, images/*.png and *.gif. A new
    folder appears whole or not at all. Raises `InputError` for an unusable folder.
    """
    with written_whole(output) as folder:
        for table in report.tables:
            (folder / f"{table.name}.csv").write_text(table.to_csv(), encoding="utf-8")
        drawn = {}
        for plot in report.plots:
            (folder / f"{plot.name}.png").write_bytes(png(plot, LIGHT))
            drawn[plot.name] = (svg(plot, LIGHT), svg(plot, DARK))
        if report.pictures:
            (folder / "images").mkdir()
        for picture in report.pictures:
            write_image(folder / "images" / f"{picture.name}.png", picture.image)
            if picture.frames:
                (folder / "images" / f"{picture.name}.gif").write_bytes(gif(picture))
        (folder / PAGE).write_text(page.build(report, drawn), encoding="utf-8")
        write_results(folder, report.to_dict())
    return Path(output).absolute() / PAGE
