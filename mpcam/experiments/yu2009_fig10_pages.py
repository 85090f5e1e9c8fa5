"""Tables and the plot of Yu et al. 2009, Fig. 10."""

from typing import Any

import numpy as np

from mpcam.experiments import yu2009_paper_mirrors as paper
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.results import Column, Plot, Table

Rows = list[dict[str, Any]]
METHODS = ("invert", "raytrace", "two_pass")
_TITLES = {"invert": "invert", "raytrace": "Mitsuba", "two_pass": "two_pass"}


def _timed(methods: tuple[str, ...]) -> list[Column]:
    columns = []
    for method in methods:
        columns.append(Column(f"{method}_ms", "Time", "ms", "Median, moving frame.", method))
        columns.append(Column(f"{method}_fps", "Frames", "1/s", "", method))
        columns.append(
            Column(f"{method}_wrong", "Wrong", "%", "Pixels that differ from Mitsuba's.", method, brief=False)
        )
    return [*columns, Column("paper_fps", "Paper", "1/s", "Its two passes.", paper=True)]


def cameras_table(rows: Rows) -> Table:
    """The first half of the paper's table."""
    columns = (
        Column("wanted", "Wanted", "", "As the paper has them.", "Cameras"),
        Column("cameras", "Ours", "", "Without those at grazing incidence.", "Cameras"),
        Column("image", "Image", "", "Pixels along a side of each camera."),
        Column("pixels_k", "Pixels", "K", "Of all cameras.", brief=False),
        *_timed(("invert", "two_pass")),
    )
    note = f"{paper.CARD} A camera triangle is half of a square; the paper renders whole ones, of which it shows half."
    return Table("cameras", "Scene fixed at 1,100 triangles, patch 6", columns, tuple(rows), note)


def scenes_table(rows: Rows) -> Table:
    """The second half of the paper's table."""
    columns = (
        Column("scene_triangles", "Scene triangles"),
        Column("patch", "Patch", "", "Samples along a side of a triangle in two_pass."),
        Column("cameras", "Cameras", "", "Without those at grazing incidence."),
        Column("pixels_k", "Pixels", "K", "Of all cameras.", brief=False),
        *_timed(("invert", "two_pass")),
    )
    return Table("scenes", "480 cameras of 256 pixels", columns, tuple(rows), paper.CARD)


def curve_table(rows: Rows) -> Table:
    """Times against the number of cameras."""
    columns = [
        Column("cameras", "Cameras"),
        Column("side", "Side", "", "Pixels along a side of each."),
        Column("pixels_k", "Pixels", "K", "Of all cameras."),
        Column("tests_k", "Tests", "K", "Of pixels against triangles, by invert."),
    ]
    for method in METHODS:
        columns.append(Column(f"{method}_ms", "Time", "ms", "Median, moving frame.", _TITLES[method]))
        columns.append(
            Column(f"{method}_spread", "Spread", "ms", "Middle half of the rounds.", _TITLES[method], brief=False)
        )
    return Table("curve", "Scene and pixels fixed, more and more cameras", tuple(columns), tuple(rows))


def fit_table(fits: Rows) -> Table:
    """What is fixed, and what each camera adds."""
    columns = (
        Column("method", "Method"),
        Column("up_to", "Up to", "", "Cameras in the fit."),
        Column("fixed_ms", "Fixed", "ms"),
        Column("per_camera_us", "Each camera", "µs"),
        Column("share", "Overhead at 960", "", "960 cameras' own cost over the fixed work; wanted: at most 0.1."),
        Column("measured", "Measured", "", "Time of the most cameras in the fit over that of the fewest, less 1."),
    )
    return Table("fits", "Time = fixed + cameras × cost of each", columns, tuple(fits))


def curve_plot(rows: Rows, fits: Rows) -> Plot:
    """Times against the number of cameras, with the fits over all."""

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        cameras = np.array([row["cameras"] for row in rows])
        at = np.geomspace(cameras[0], cameras[-1], 80)
        for number, method in enumerate(METHODS):
            color = theme.palette[number]
            axes.plot(cameras, [row[f"{method}_ms"] for row in rows], "o", ms=5, color=color, label=_TITLES[method])
            fit = [fit for fit in fits if fit["method"] == method][-1]
            axes.plot(at, fit["fixed_ms"] + 1e-3 * fit["per_camera_us"] * at, color=color, linewidth=1)
        paper_at = [126, 360, 640]
        axes.plot(
            paper_at,
            [1e3 / paper.FIG_10_CAMERAS[n, 128] for n in paper_at],
            *("s--",),
            color=theme.soft,
            ms=4,
            linewidth=1,
            label="paper, pixels not fixed",
        )
        axes.set_xscale("log")
        axes.set_yscale("log")
        plain_ticks(axes.xaxis)
        plain_ticks(axes.yaxis)
        axes.set_xlabel("general linear cameras")
        axes.set_ylabel("moving frame (ms)")
        axes.grid()
        figure.legend(loc="outside upper right", ncols=4)

    caption = (
        "Time of a moving frame against the number of cameras, the scene (1,100 triangles) and the pixels in all "
        "fixed; lines: fits of fixed work and a cost of each camera over all points. The paper's own times, with 128 "
        "pixels along a side of each camera, are of another machine."
    )
    return Plot("curve", caption, "Times against the number of cameras by method, with fitted curves", draw)
