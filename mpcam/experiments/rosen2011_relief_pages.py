"""What the relief experiment shows: tables, pictures, a plot and the reading."""

from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.comparison.numbers import format_number
from mpcam.effects.relief_picture import ReliefPicture
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Table

PAPER = "Rosen, Popescu, Hayward, Wyman: Non-pinhole approximations for interactive rendering, 2011"
CARD = "The paper's frames are of an Nvidia 8800 Ultra, with shadow maps; ours are of this machine's processor."
Rows = list[dict[str, Any]]


def table_of(rows: Rows) -> tuple[Table, Table]:
    """Errors of all reliefs, and times of the single-pole ones."""
    name = [
        Column("scene", "Scene", "", "What stands on the ground."),
        Column("count", "Copies", "", "Of one relief."),
    ]
    errors = [
        *name,
        Column("relief", "Relief", "", "The camera of its depth image."),
        Column("mismatch", "Mismatch", "%", "Pixels that show a copy and should not, or do not, or another one."),
        Column("missing", "Missing", "%", "Of the pixels that should show a copy: those that do not show it."),
        Column("rms", "RMS", "", "Error of the lit picture with shadows, linear RGB."),
        Column("flip", "FLIP", "", "Mean, of the same picture."),
        Column("steps", "Steps", "", "Projected points of a ray, where one runs through a box.", brief=False),
        Column("megabytes", "Memory", "MB", "Of the relief on the device, whatever the number of copies.", brief=False),
    ]
    times = [*name, Column("triangles", "Triangles", "", "Of all copies, for the rivals.", brief=False)]
    for kind, title in (("still", "Still"), ("moving", "Moving")):
        times += [
            Column(f"{kind}_ms", "Relief", "ms", "First hits.", title),
            Column(f"{kind}_flat_ms", "Triangles", "ms", "Mitsuba, one tree over all triangles.", title),
            Column(f"{kind}_copies_ms", "Instances", "ms", "Mitsuba, a tree over copies of a tree.", title),
        ]
    times += [
        Column("frame_ms", "Relief", "ms", "Moving, with a shadow map anew, shaded.", "Frame"),
        Column("frame_copies_ms", "Instances", "ms", "Moving, with shadow rays, not shaded.", "Frame"),
        Column("fps", "Frames", "1/s", "Of whole frames with reliefs.", "Frame"),
        Column("paper_fps", "Paper", "1/s", "As printed in section 7.2.", "Frame", paper=True),
    ]
    timed = [row for row in rows if "still_ms" in row]
    return (
        Table("errors", "Against the triangles", tuple(errors), tuple(rows)),
        Table("times", "Times", tuple(times), tuple(timed), CARD),
    )


def pictures_of(shown: dict[str, Any]) -> list[Gallery]:
    """For each scene the truth, each relief, its texture, and the boxes that are rendered."""
    found = []
    for kind, images in shown.items():
        made, label = images.pop("scene"), kind.replace(" ", "-")
        pictures = [Picture(f"{label}-triangles", "All triangles, traced", images.pop("truth"))]
        for name, (image, instances) in images.items():
            file = f"{label}-{name}".replace(", ", "-").replace(" ", "-")
            pictures.append(Picture(file, f"Relief, {name}", image))
            if "layers" not in name:
                texture = np.asarray(instances.relief.images[0].color)
                pictures.append(Picture(f"{file}-texture", f"Its texture, {name}", texture))
            if name == "single pole":
                pictures.append(Picture(f"{file}-boxes", "With the boxes of its tiles", _boxes(made, instances, image)))
        found.append(Gallery(kind.capitalize(), tuple(pictures)))
    return found


def _boxes(made: Any, instances: Any, image: np.ndarray) -> np.ndarray:
    """The picture with the front sides of the boxes laid over it."""
    from mpcam.rendering.methods import rasterize

    view = ReliefPicture(replace(made.scene, reliefs=instances), shading="color")
    sides = rasterize(made.scene.camera, instances.boxes)
    over = sides.mask & (sides.depth < view.depth())
    tint = 0.25 + 0.5 * np.abs(instances.boxes.face_normals)[np.maximum(sides.triangle, 0)]
    return np.where(over[..., None], 0.55 * image + 0.45 * tint, image).astype(np.float32)


def plot_of(rows: Rows) -> Plot:
    """Missing pixels by scene and relief."""

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        scenes = list(dict.fromkeys((row["scene"], row["count"]) for row in rows))
        kinds = list(dict.fromkeys(row["relief"] for row in rows))
        wide = 0.8 / len(kinds)
        for number, kind in enumerate(kinds):
            values = [row["missing"] for row in rows if row["relief"] == kind]
            places = np.arange(len(scenes)) + wide * (number - 0.5 * (len(kinds) - 1))
            bars = axes.bar(places, values, 0.92 * wide, color=theme.palette[number], label=kind)
            axes.bar_label(bars, fmt="%.2g", fontsize=8, color=theme.ink)
        axes.set_xticks(np.arange(len(scenes)), [named(scene, count) for scene, count in scenes])
        axes.set_ylabel("missing pixels, %")
        axes.grid(axis="y")
        figure.legend(loc="outside upper right", ncols=len(kinds))

    caption = "Pixels that should show a copy and do not, of those that should."
    return Plot("missing", caption, "Bars of missing pixels by scene and kind of relief", draw, height=3.8)


def named(scene: str, count: int) -> str:
    """ "40 cars", and "1 car"."""
    return f"{count} {scene.removesuffix('s') if count == 1 else scene}"


def reading_of(rows: Rows) -> str:
    """The finding, from the figures themselves."""
    by = {(row["scene"], row["count"], row["relief"]): row for row in rows}
    last = list(dict.fromkeys((row["scene"], row["count"]) for row in rows))
    said = []
    for scene, count in last:
        pole, plain = (by[scene, count, kind] for kind in ("single pole", "conventional"))
        missing, rms = (
            " against ".join(format_number(row[key], 2) for row in (pole, plain)) for key in ("missing", "rms")
        )
        moving, flat, copies = (format_number(pole[key]) for key in ("moving_ms", "moving_flat_ms", "moving_copies_ms"))
        said.append(
            f"{named(scene, count)}: {missing} % of the pixels missing, RMS {rms}; "
            f"moving, first hits take {moving} ms, a tree rebuilt over all triangles {flat} ms, Mitsuba's instances "
            f"{copies} ms; whole frames {format_number(pole['fps'], 2)} a second"
            + (f", the paper's {pole['paper_fps']:g}" if pole.get("paper_fps") else "")
        )
    timed = [row for row in rows if "moving_ms" in row]
    won = sum(row["moving_ms"] < row["moving_copies_ms"] for row in timed)
    return (
        "The image of a single-pole camera holds the sides of a thing that an orthographic one cannot see. "
        "Missing pixels and RMS by it against those by the conventional relief: "
        + ". ".join(said)
        + f". Reliefs that move are faster than moved instances in {won} of {len(timed)} scenes. {CARD}"
    )
