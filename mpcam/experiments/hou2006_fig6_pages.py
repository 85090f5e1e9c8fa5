"""Tables, plots and pictures of Hou et al. 2006, Fig. 6."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.comparison.metrics import flip_map
from mpcam.effects.reflection import Reflection
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Table
from mpcam.math.srgb import linear_from_srgb

Rows = list[dict[str, Any]]
METHODS = ("camera triangles", "environment map", "ray tracing", "vertices")
MARKS = ("o", "s", "D", "^")


@dataclass(frozen=True, eq=False)
class MirrorPicture:
    """A mirror by one method: its row, its picture, and what makes frames."""

    row: dict[str, Any]
    image: np.ndarray
    picture: Reflection


def quality_table(rows: Rows) -> Table:
    """Errors and times of every method."""
    columns = (
        Column("mirror", "Mirror"),
        Column("method", "Method"),
        Column("setting", "Setting"),
        Column("pixels_k", "Pixels", "K", "Of the atlas or the two views.", brief=False),
        Column("flip", "FLIP", "", "Mean over the mirror's pixels; 0 is the truth.", "Error of the picture"),
        Column("psnr", "PSNR", "dB", "Over the mirror's pixels.", "Error of the picture"),
        Column("ray_rms", "rms", "m", "Two radii of the mirror away from it.", "Error of the rays"),
        Column("ray_p95", "95 %", "m", "Of rays are nearer.", "Error of the rays", brief=False),
        Column("angle_mrad", "Angle", "mrad", "Root mean square.", "Error of the rays", brief=False),
        Column("still_ms", "Still", "ms", "Median, whole picture.", "Time"),
        Column("moving_ms", "Moving", "ms", "Median, whole picture.", "Time"),
        Column("still_front", "Still", "", "No row of this mirror is better in both.", "On the front", brief=False),
        Column("moving_front", "Moving", "", "No row of this mirror is better in both.", "On the front", brief=False),
    )
    return Table("quality", "Error and time", columns, tuple(rows))


def slope_table(slopes: Rows) -> Table:
    """How fast ray errors fall."""
    columns = (
        Column("mirror", "Mirror"),
        Column("levels", "Tessellations"),
        Column("coarse_rms", "Coarsest", "m", "Rms ray error.", "Ray error"),
        Column("fine_rms", "Finest", "m", "Rms ray error.", "Ray error"),
        Column("slope", "All", "", "Of log error against log edge.", "Slope"),
        Column("fine_slope", "Finest three", "", "Of log error against log edge.", "Slope"),
    )
    return Table("slopes", "Ray error against the length of edges", columns, tuple(slopes))


def time_plot(rows: Rows) -> Plot:
    """FLIP against the time of a moving picture, a panel for each mirror, with the front."""
    mirrors = list(dict.fromkeys(row["mirror"] for row in rows))

    def draw(figure: Any, theme: Any) -> None:
        panels = figure.subplots(1, len(mirrors), sharey=True)
        for axes, mirror in zip(panels, mirrors, strict=True):
            mine = [row for row in rows if row["mirror"] == mirror]
            on = sorted((row["moving_ms"], row["flip"]) for row in mine if row["moving_front"])
            axes.step(*zip(*on, strict=True), where="post", color=theme.soft, linewidth=1, label="front")
            for number, method in enumerate(METHODS):
                kept = [row for row in mine if row["method"] == method]
                at = [[row[name] for row in kept] for name in ("moving_ms", "flip")]
                axes.plot(*at, MARKS[number], color=theme.palette[number], ms=6, label=method)
            above = float("inf")
            for row in mine:
                if "camera_triangles" in row and row["flip"] < above - 0.03:  # numbers that do not run together
                    above, place = row["flip"], (row["moving_ms"], row["flip"])
                    axes.annotate(str(row["camera_triangles"]), place, (4, 3), textcoords="offset points", fontsize=7.5)
            axes.set_title(mirror)
            axes.set_xscale("log")
            plain_ticks(axes.xaxis)
            axes.set_xlabel("moving picture (ms)")
            axes.grid()
        panels[0].set_ylim(bottom=-0.01)
        panels[0].set_ylabel("FLIP over the mirror")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)

    caption = (
        "Error against time of a moving picture, whole and shaded, by mirror. Numbers are camera triangles; the line "
        "is the front: nothing is both nearer to the truth and faster."
    )
    return Plot("time", caption, "FLIP against time for each mirror and method", draw)


def error_plot(rows: Rows) -> Plot:
    """Ray error against the length of edges, and FLIP against the number of camera triangles."""
    kept = [row for row in rows if "edge" in row]
    mirrors = list(dict.fromkeys(row["mirror"] for row in kept))

    def draw(figure: Any, theme: Any) -> None:
        rays, flips = figure.subplots(1, 2)
        for number, mirror in enumerate(mirrors):
            mine = [row for row in kept if row["mirror"] == mirror]
            look = {"color": theme.palette[number], "marker": "o", "ms": 4.5, "label": mirror}
            rays.plot([row["edge"] for row in mine], [row["ray_rms"] for row in mine], **look)
            flips.plot([row["camera_triangles"] for row in mine], [row["flip"] for row in mine], **look)
        edge = np.array(sorted(row["edge"] for row in kept))[[0, -1]]
        rms = min(row["ray_rms"] for row in kept)
        rays.plot(edge, 0.6 * rms * (edge / edge[0]) ** 2, "--", color=theme.soft, label="slope 2")
        for axes in (rays, flips):
            axes.set_xscale("log")
            axes.grid()
        rays.set_yscale("log")
        plain_ticks(rays.xaxis)
        plain_ticks(flips.xaxis)
        rays.set_xlabel("length of edges (m)")
        rays.set_ylabel("ray error, rms (m)")
        flips.set_xlabel("camera triangles")
        flips.set_ylabel("FLIP over the mirror")
        handles, labels = rays.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)

    caption = "Left: ray error against the length of edges. Right: error of the picture against tessellation."
    return Plot("errors", caption, "Curves of ray error against edge length, and of FLIP against triangles", draw)


def gallery(shown: "list[MirrorPicture]", name: str, title: str) -> Gallery:
    """The truth, an environment map, vertices and tessellations, each above its difference from the truth."""
    truth = shown[0]
    environment = [one for one in shown if one.row["method"] == "environment map"][-2:-1]
    vertices = [one for one in shown if one.row["method"] == "vertices"][1:2]
    cams = [one for one in shown if "camera_triangles" in one.row]
    chosen = [one for one in cams if one.row["camera_triangles"] in _wanted(cams, 3)]
    cut = _around(truth.picture.mask)
    pictures = []
    for one in (truth, *environment, *vertices, *chosen):
        row = one.row
        label = f"{row['method'].capitalize()} {row['setting']}".strip()
        key = {"ray tracing": "truth", "environment map": "environment", "vertices": "vertices"}.get(row["method"])
        difference = heat(flip_map(one.image, truth.image))
        both = np.concatenate([one.image[cut], difference[cut]])
        caption = f"{label}, FLIP {row['flip']:.3f}" if one is not truth else label
        pictures.append(Picture(f"{name}-{key or row['camera_triangles']}", caption, both))
    note = "Below each its difference from ray tracing: FLIP per pixel, from black (0) over red to white (1)."
    return Gallery(title, tuple(pictures), note)


def _wanted(cams: "list[MirrorPicture]", count: int) -> set[int]:
    """So many numbers of camera triangles, from the first to the last, about evenly."""
    numbers = [one.row["camera_triangles"] for one in cams]
    return {numbers[round(i)] for i in np.linspace(0, len(numbers) - 1, min(count, len(numbers)))}


def _around(mask: np.ndarray) -> tuple[slice, slice]:
    """The rows and columns of a mask, with a little margin."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    margin = max(mask.shape) // 100
    return tuple(slice(max(int(at[0]) - margin, 0), int(at[-1]) + 1 + margin) for at in (rows, columns))  # pyright: ignore[reportReturnType]


def heat(error: np.ndarray) -> np.ndarray:
    """An error (H, W) from 0 to 1 as a picture, linear RGB: black, red, yellow, white."""
    ramp = np.clip(3.0 * error[..., None] - np.arange(3), 0.0, 1.0)
    return linear_from_srgb(ramp).astype(np.float32)
