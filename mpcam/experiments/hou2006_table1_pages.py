"""Tables, plots and pictures of Hou et al. 2006, Table 1."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.effects.reflection import Reflection
from mpcam.effects.shadows import shadow_maps
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.hou2006_paper import CARD
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Table, as_number
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import shade
from mpcam.scene.scene import Scene

Rows = list[dict[str, Any]]
_FIRST = (
    Column("scene", "Scene"),
    Column("bound", "Bound"),
    Column("scene_triangles", "Scene triangles"),
    Column("camera_triangles", "Ours", "", "", "Camera triangles"),
    Column("paper_camera_triangles", "Paper", "", "", "Camera triangles", paper=True, brief=False),
)


@dataclass(frozen=True, eq=False)
class ThroughTriangles:
    """A scene through camera triangles. paper: how many of these the paper has, in the row that it stands for."""

    name: str
    scene: Scene
    cams: CameraTriangles
    paper: int

    @property
    def label(self) -> str:
        return f"{self.name} × {self.paper}"


def overdraw_table(rows: Rows) -> Table:
    """Pixels tested and rendered, and errors."""
    columns = [
        *_FIRST,
        Column("resolution", "Resolution", "pixels", "Of a camera triangle's short sides.", brief=False),
    ]
    for name, title, unit, help in (
        ("tests", "Tests", "K", "Thousands of tests of a pixel against a scene triangle."),
        ("rendered", "Rendered", "K", "Thousands of tests that hit, before the nearest is chosen."),
        ("overdraw", "Overdraw", "", "Tests / rendered; 1 is ideal."),
    ):
        suffix = "_k" if unit else ""
        columns.append(Column(f"{name}{suffix}", "Ours", unit, help, title))
        columns.append(
            Column(f"{name}_paper{suffix}", "Paper", unit, help, title, paper=True, brief=name == "overdraw")
        )
    columns.append(Column("wrong_percent", "Wrong", "%", "Share of the pixels that differ from first hits in Mitsuba."))
    note = "The paper's figures are those of its bounding triangles; they stand beside each of our bounds."
    return Table("overdraw", "Pixels tested and rendered", tuple(columns), tuple(rows), note)


def times_table(rows: Rows) -> Table:
    """Frames and their ratios to ray tracing."""
    columns = [*_FIRST]
    for name, group in (("", "Camera triangles"), ("trace_", "Mitsuba")):
        columns.append(Column(f"{name}still_ms", "Still", "ms", "Median.", group, brief=False))
        columns.append(Column(f"{name}moving_ms", "Moving", "ms", "Median; new vertices in every frame.", group))
    help = "Camera triangles / Mitsuba; below 1 they win."
    columns.append(Column("still_ratio", "Still", "", help, "Ratio"))
    columns.append(Column("moving_ratio", "Moving", "", help, "Ratio"))
    columns.append(Column("paper_fps", "Paper", "1/s", "Frames per second.", "", paper=True, brief=False))
    return Table("times", "Whole frames", tuple(columns), tuple(rows), CARD)


def overdraw_plot(rows: Rows) -> Plot:
    """Overdraw by scene and bound, the paper's as diamonds."""

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        labels = _labels(rows)
        bounds = list(dict.fromkeys(row["bound"] for row in rows))
        places = np.arange(len(labels))[::-1]
        for number, bound in enumerate(bounds):
            values = [row["overdraw"] for row in rows if row["bound"] == bound]
            at = places + 0.25 * (1 - number)
            axes.barh(at, values, 0.24, color=theme.palette[number], label=bound)
        theirs = [as_number(row.get("overdraw_paper")) for row in rows if row["bound"] == bounds[-1]]
        axes.plot(theirs, places - 0.25, "D", color=theme.ink, ms=5, label="paper")
        axes.set_xscale("log")
        plain_ticks(axes.xaxis)
        axes.set_xlabel("overdraw: pixels tested for each one rendered")
        axes.set_yticks(places, labels)
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="x")
        figure.legend(loc="outside upper right", ncols=len(bounds) + 1)

    caption = "Overdraw by scene and bound, on a scale of powers of ten. Diamonds: the paper's bounding triangles."
    return Plot("overdraw", caption, "Bars of overdraw, three for each scene", draw, height=4.6)


def times_plot(rows: Rows) -> Plot:
    """Ratios of the tight bound's frames to ray tracing."""
    kept = [row for row in rows if row["bound"] == "tight"]

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        places = np.arange(len(kept))[::-1]
        for number, kind in enumerate(("moving", "still")):
            values = [row[f"{kind}_ratio"] for row in kept]
            axes.barh(places + 0.2 * (1 - 2 * number), values, 0.36, color=theme.palette[number], label=kind)
        axes.axvline(1, color=theme.ink, linewidth=1)
        axes.set_xscale("log")
        plain_ticks(axes.xaxis)
        axes.set_xlabel("time of camera triangles (tight) / time of Mitsuba")
        axes.set_yticks(places, _labels(kept))
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="x")
        figure.legend(loc="outside upper right", ncols=2)

    caption = "Time of a frame against tracing the same rays, the tree rebuilt where the scene moves; below 1 they win."
    return Plot("ratios", caption, "Bars of the ratio of the two times, moving and still, by scene", draw, height=3.6)


def _labels(rows: Rows) -> list[str]:
    kept = {(row["scene"], row["paper_camera_triangles"]): row for row in rows}.values()
    return [f"{row['scene']} {row['scene_triangles']:,} × {row['camera_triangles']}" for row in kept]


def gallery(cases: "list[ThroughTriangles]", quick: bool) -> Gallery:
    """Figs. 9, 11 and 12, and the mirror: ours, and the same by rays of the true surface."""
    pictures = []
    for case in cases:
        if case.name == "visualization":
            pictures.append(_panorama(case, quick))
        elif case.name == "caustics":
            pictures.append(_caustics(case, quick))
        elif case.paper in (104, 12):
            name = "water" if case.name == "refraction" else "fine" if "fine" in case.name else "mirror"
            maps = shadow_maps(case.scene, 256 if quick else 2048)
            title = f"{case.name.capitalize()}, {case.scene.mesh.triangle_count:,} triangles"
            ours = Reflection(case.scene, cams=case.cams, shadows=maps).image()
            true = Reflection(case.scene, method="raytrace", shadows=maps).image()
            pictures.append(Picture(name, f"{title}, {case.cams.count} camera triangles", ours))
            pictures.append(Picture(f"{name}-truth", f"{title}, rays of the true surface", true))
    note = "The paper shows a mirror in its Fig. 1, and refraction, caustics and visualization in Figs. 9, 11 and 12."
    return Gallery("The scenes", tuple(pictures), note)


def _caustics(case: ThroughTriangles, quick: bool) -> Picture:
    """The light that the ring gathers on the table, and the ring as the mirror that it is."""
    from mpcam.effects.caustics import caustics
    from mpcam.experiments.hou2006_scenes import light_of

    scene, mirror = case.scene, case.scene.mirror
    assert mirror is not None
    found = caustics(
        scene,
        mirror.surface,
        light_of(scene),
        scene.camera,
        triangles=case.paper,
        photons=64 if quick else 512,
        reflectance=mirror.color,
    )
    ring = found.hits.triangle >= scene.mesh.triangle_count
    seen = Reflection(scene, method="raytrace").image()
    image = np.where(ring[..., None], seen, found.render())
    return Picture("caustics", f"Caustics of half a ring, {found.cams.count} camera triangles from the lamp", image)


def _panorama(case: ThroughTriangles, quick: bool) -> Picture:
    from mpcam.effects.visualization import unrolled

    maps = shadow_maps(case.scene, 256 if quick else 2048)
    image = shade(prepare(case.cams, case.scene.mesh).frame(), case.scene, "light", maps)
    caption = f"Visualization: a walker from all sides, {case.cams.count} camera triangles"
    return Picture("visualization", caption, unrolled(case.cams, image))
