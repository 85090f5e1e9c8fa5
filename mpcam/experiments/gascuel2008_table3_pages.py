"""Tables, plots and pictures of Table 3."""

from typing import Any

import numpy as np

from mpcam.cameras.change import projected
from mpcam.experiments.common import CARD
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Table, as_number

Rows = list[dict[str, Any]]
STEPS = {
    "vertex": "Vertex",
    "geometry": "Geometry",
    "raycasting": "Raycasting",
    "interpolation": "Interpolation",
    "texturing": "Texturing",
    "lighting": "Lighting",
    "shadow": "Shadow",
}
_FIRST = (Column("view", "Projection, bound"), Column("scene", "Scene"), Column("triangles", "Triangles"))


def overdraw_table(rows: Rows) -> Table:
    """Pixels tested and rendered, the whole frame and its ratio to the linear view, and errors."""
    columns = [*_FIRST]
    for name, title, unit, help in (
        ("covered", "Covered", "K", "Thousands of tests of a pixel against a triangle."),
        ("rendered", "Rendered", "K", "Thousands of tests that hit, before the nearest is chosen."),
        ("overdraw", "Overdraw", "%", "Covered / rendered - 1."),
        ("ratio", "Ratio", "%", "Whole frame against the linear view of the same scene."),
    ):
        suffix = {"K": "k", "%": "percent"}[unit]
        columns.append(Column(f"{name}_{suffix}", "Ours", unit, help, title))
        columns.append(
            Column(f"{name}_paper_{suffix}", "Paper", unit, help, title, paper=True, brief=name != "rendered")
        )
    columns.append(Column("wrong_percent", "Wrong", "%", "Share of the pixels that differ from first hits in Mitsuba."))
    return Table("overdraw", "Pixels tested and rendered", tuple(columns), tuple(rows))


def steps_table(rows: Rows) -> Table:
    """The cost of each step, ours and the paper's."""
    columns = [*_FIRST]
    for name, title in STEPS.items():
        columns.append(Column(f"{name}_ms", "Ours", "ms", "", title))
        if name != "interpolation":
            columns.append(Column(f"{name}_paper_ms", "Paper", "ms", "", title, paper=True, brief=False))
    columns.append(Column("total_ms", "Ours", "ms", "The whole frame, shaded.", "Total"))
    columns.append(Column("total_paper_ms", "Paper", "ms", "", "Total", paper=True, brief=False))
    return Table("steps", "Cost of each step", tuple(columns), tuple(rows), CARD)


def overdraw_plot(rows: Rows) -> Plot:
    """Overdraw by projection and bound, the paper's as diamonds."""
    kept = [row for row in rows if not str(row["view"]).startswith("linear")]

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        places = np.arange(len(kept))[::-1]
        bounds = list(dict.fromkeys(str(row["view"]).rsplit(" ", 1)[1] for row in kept))
        for number, bound in enumerate(bounds):
            index = [i for i, row in enumerate(kept) if str(row["view"]).endswith(f" {bound}")]
            values = [kept[i]["overdraw_percent"] for i in index]
            axes.barh(places[index], values, 0.72, color=theme.palette[number], label=f"{bound}")
        theirs = [as_number(row.get("overdraw_paper_percent")) for row in kept]
        axes.plot(theirs, places, "D", color=theme.ink, ms=5, label="paper")
        axes.set_xscale("log")
        plain_ticks(axes.xaxis)
        axes.set_xlabel("overdraw: pixels tested in vain for each one rendered (%)")
        axes.set_yticks(places, [f"{row['scene']} {row['triangles']:,}  {row['view']}" for row in kept])
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="x")
        figure.legend(loc="outside upper right", ncols=len(bounds) + 1)

    caption = "Overdraw by scene, projection and bound, on a scale of powers of ten. Diamonds: the paper's."
    height = 1.3 + 0.24 * len(kept)
    return Plot("overdraw", caption, "Bars of overdraw, one for each scene, projection and bound", draw, height=height)


def steps_plot(rows: Rows) -> Plot:
    """Fig. 7: the steps of each frame on top of each other, ours and the paper's, on the first scene."""
    first = (rows[0]["scene"], rows[0]["triangles"])
    kept = [row for row in rows if (row["scene"], row["triangles"]) == first]

    def draw(figure: Any, theme: Any) -> None:
        panels = figure.subplots(1, 2, sharey=True)
        places = np.arange(len(kept))[::-1]
        for axes, suffix, title in zip(panels, ("ms", "paper_ms"), ("ours", "paper"), strict=True):
            left = np.zeros(len(kept))
            for number, (name, label) in enumerate(STEPS.items()):
                values = np.maximum(np.nan_to_num([as_number(row.get(f"{name}_{suffix}")) for row in kept]), 0)
                axes.barh(places, values, 0.72, left=left, color=theme.palette[number], label=label)
                left += values
            axes.set_title(title)
            axes.set_xlabel("ms")
            axes.grid(axis="x")
            axes.tick_params(axis="y", length=0)
        panels[0].set_yticks(places, [str(row["view"]) for row in kept])
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(STEPS))

    caption = (
        f"Where the time of a frame goes, {first[0]} with {first[1]:,} triangles (the paper's Fig. 7). The scales "
        "differ: compare how the bars are divided and how they stand to the linear view, not their length. Where a "
        "bar is missing, the paper has no figures."
    )
    height = 1.6 + 0.27 * len(kept)
    return Plot("steps", caption, "Bars of the time of each step, by projection and bound", draw, height=height)


def gallery(scenes: dict[tuple[str, int], Any]) -> Gallery:
    """Fig. 8: the larger scenes; the last of each name stands for it."""
    from mpcam.pictures.render import render

    pictures = []
    for name, scene in {name: scene for (name, _), scene in scenes.items()}.items():
        title = f"{name.capitalize()}, {scene.mesh.triangle_count:,} triangles"
        pictures.append(Picture(name, f"{title}, paraboloid", render(scene.camera, scene)))
        if name == "patio":
            sphere = render(projected(scene.camera, "cosine_sphere"), scene)
            pictures.append(Picture(f"{name}-cosine-sphere", f"{title}, cosine sphere", sphere))
    return Gallery("The scenes", tuple(pictures), "The paper shows Temple and Patio in its Fig. 8.")
