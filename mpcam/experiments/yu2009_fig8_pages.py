"""Tables, plots and pictures of Yu et al. 2009, Fig. 8."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.comparison.metrics import flip_map
from mpcam.effects.reflection import Reflection
from mpcam.experiments import yu2009_paper_mirrors as paper
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.hou2006_fig6_pages import heat
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Table

Rows = list[dict[str, Any]]


@dataclass(frozen=True, eq=False)
class SpherePicture:
    """The sphere with one kind of rays: its row, its picture, what makes frames, and jumps at seams, in pixels."""

    row: dict[str, Any]
    image: np.ndarray
    picture: Reflection
    jumps: np.ndarray


def error_table(rows: Rows) -> Table:
    """Errors and times of every kind of rays."""
    picture, rays, seam = "Error of the picture", "Error of the rays", "Jump at seams"
    columns = (
        Column("rays", "Rays"),
        Column("method", "Method"),
        Column("cameras", "Kept", "", "", "Cameras"),
        Column("left_out", "Left out", "", "At grazing incidence.", "Cameras"),
        Column("flip", "FLIP", "", "Mean over the sphere's pixels; 0 is the truth.", picture),
        Column("flip_middle", "Middle", "", "FLIP of the sphere's middle.", picture, brief=False),
        Column("psnr", "PSNR", "dB", "Over the sphere's pixels.", picture, brief=False),
        Column("ray_rms", "rms", "m", "Two radii away.", rays),
        Column("ray_median", "Median", "m", "Two radii away.", rays, brief=False),
        Column("ray_p95", "95 %", "m", "Of rays are nearer.", rays, brief=False),
        Column("ray_max", "Most", "m", "", rays, brief=False),
        Column("angle_mrad", "Angle", "mrad", "Root mean square.", rays, brief=False),
        Column("seam_median", "Median", "px", "Pixels of the picture.", seam),
        Column("seam_p95", "95 %", "px", "Of places have less.", seam, brief=False),
        Column("seam_max", "Most", "px", "", seam),
        Column("seam_above", "Above 0.5 px", "%", "Of the places.", seam, brief=False),
        Column("seam_places", "Places", "", "Four on each common edge.", seam, brief=False),
        Column("seam_lost", "Without", "", "Places where the other side shows no such point.", seam, brief=False),
        Column("still_ms", "Still", "ms", "Median, whole picture.", "Time", brief=False),
        Column("moving_ms", "Moving", "ms", "Median, whole picture.", "Time"),
    )
    note = "general_linear: the paper's, each in its own plane; directions: Hou et al. 2006; normals: bent by pixel."
    return Table("spheres", "Errors, seams and time", columns, tuple(rows), note)


def time_table(rows: Rows) -> Table:
    """First hits of the general linear cameras."""
    columns = (
        Column("method", "Method"),
        Column("still_ms", "Still", "ms", "Median."),
        Column("moving_ms", "Moving", "ms", "Median, from new vertices on."),
        Column("moving_fps", "Moving", "1/s"),
        Column("paper_fps", "Paper", "1/s", "960 cameras of 256 pixels, patch 6.", paper=True),
    )
    return Table("hits", "First hits of the general linear cameras", columns, tuple(rows), paper.CARD)


def seam_plot(shown: list[SpherePicture]) -> Plot:
    """How jumps at seams are distributed."""
    kept = [one for one in shown if len(one.jumps)]

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        for number, one in enumerate(kept):
            jumps = np.sort(np.maximum(one.jumps[np.isfinite(one.jumps)], 1e-14))
            share = 100 * (1 - np.arange(len(jumps)) / len(jumps))
            style = ("-", "--", "-.", ":")[number]
            axes.plot(jumps, share, style, color=theme.palette[number], label=one.row["rays"], linewidth=1.8)
        axes.set_xscale("log")
        axes.set_yscale("log")
        plain_ticks(axes.yaxis)
        axes.set_xlabel("jump at a seam (pixels of the picture)")
        axes.set_ylabel("places with more (%)")
        axes.grid()
        figure.legend(loc="outside upper right", ncols=4)

    caption = "Share of the places on common edges where the image of a point jumps by more than so many pixels."
    return Plot("seams", caption, "Curves of the share of places against the jump, by kind of rays", draw, height=3.6)


def gallery(shown: list[SpherePicture]) -> Gallery:
    """The truth and every kind of rays, each above its difference."""
    truth, pictures = shown[0], []
    cut = _around(truth.picture.mask)
    for one in shown:
        difference = heat(flip_map(one.image, truth.image))
        both = np.concatenate([one.image[cut], difference[cut]])
        caption = "Rays of the true sphere" if one is truth else f"{_label(one)}, FLIP {one.row['flip']:.3f}"
        pictures.append(Picture(f"sphere-{_name(one)}", caption, both))
    whole = Picture("butterflies", "The whole picture, general linear cameras", shown[1].image)
    note = "Below each its difference from ray tracing: FLIP per pixel, from black (0) over red to white (1)."
    return Gallery("The sphere: Fig. 8", (whole, *pictures), note)


def closeups(shown: list[SpherePicture]) -> Gallery:
    """A part near the rim, magnified: Fig. 8 (c)."""
    rows, columns = _around(shown[0].picture.mask)
    high, wide = rows.stop - rows.start, columns.stop - columns.start
    part = (
        slice(rows.start + high // 10, rows.start + high // 2),
        slice(columns.start + wide * 55 // 100, columns.start + wide * 97 // 100),
    )
    pictures = tuple(
        Picture(f"closeup-{_name(one)}", _label(one), one.image[part].repeat(3, axis=0).repeat(3, axis=1))
        for one in shown
        if one.row["method"] != "two_pass"
    )
    return Gallery("Closer: seams, and what is left out at the rim", pictures)


def _label(one: SpherePicture) -> str:
    return f"{one.row['rays']}, {one.row['method']}"


def _name(one: SpherePicture) -> str:
    rays = one.row["rays"].replace("_", "-")
    return f"{rays}-two-pass" if one.row["method"] == "two_pass" else rays


def _around(mask: np.ndarray) -> tuple[slice, slice]:
    """The rows and columns of a mask."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return tuple(slice(max(int(at[0]) - 4, 0), int(at[-1]) + 5) for at in (rows, columns))  # pyright: ignore[reportReturnType]
