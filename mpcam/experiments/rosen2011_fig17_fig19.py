"""Rosen et al. 2011, Figs. 17 and 19: how many steps rays take over depth images, with and without coarse ones."""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.graph import GraphCamera
from mpcam.cameras.types import Ray
from mpcam.comparison.numbers import format_number
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.depth_images.depth_image import DepthImage, Walk
from mpcam.depth_images.intersections import Intersections
from mpcam.effects.by_depth_image import ByDepthImages
from mpcam.effects.choose_camera import TOLERANCE
from mpcam.effects.depth_image_views import ball_of, used_vertices
from mpcam.effects.missing_samples import TrueHits, held, on_device, true_hits
from mpcam.effects.reflection import Reflection
from mpcam.experiments.common import machine
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.rosen2011_paper import GRAPH_STEPS, PAPER, POLE_STEPS
from mpcam.experiments.rosen2011_scenes import maze_scene, reflection_scene
from mpcam.scene.scene import Scene

COARSE = 6.0
FINES = (1.0, 0.5, 0.25)
GOALS = {"teapot, in waves": 3.0, "teapot, in a teapot": 3.0, "maze": 4.0}
"""Times fewer steps that are wanted."""
MOST_CHANGED = 0.1
"""Percent of the pixels that coarse steps may change."""
SAME = 1.0
"""Pixels that a meeting may move before it counts as changed."""
PART = 4
"""Of the rays that walk through the maze without its pieces, one in so many is taken."""
Rows = list[dict[str, Any]]


class _Case(NamedTuple):
    """Rays (N, 3) of the mirror's pixels and a depth image that they meet. pixels (N,): of the picture."""

    name: str
    walk: Walk
    scene: Scene
    image: DepthImage
    ray: Ray
    pixels: np.ndarray
    paper: dict[tuple[float, bool], float]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`. Nothing is timed here, so `repeats` changes nothing."""
    width, height, size, triangles = (80, 60, 64, 2_000) if quick else (640, 480, 512, 20_000)
    wide = (160, 98) if quick else (1920, 1175)
    fines = FINES[-1:] if quick else FINES
    steps = StepCounter(progress, 4 + 8 * len(fines) + 3)
    rows: Rows = []
    galleries = []
    for mirror, name in (("bumpy", "teapot, in waves"), ("teapot", "teapot, in a teapot")):
        scene = reflection_scene(triangles, "teapot", mirror, width, height)
        picture = Reflection(scene, method="depth_image", size=size)
        assert isinstance(picture.part, ByDepthImages)
        image = next(one for one in picture.part.images if type(one.camera).__name__ == "SinglePoleOcclusion")
        paper = POLE_STEPS if mirror == "teapot" else {}
        cases = [_case(name, "march", scene, picture, image, paper)]
        steps.done(f"{name}: depth image")
        rows += _all_rows(cases, fines, steps, galleries, picture)
    scene = maze_scene(triangles=triangles, width=width, height=height)
    graph = GraphCamera.through(scene[1], *wide)
    image = DepthImage.render(graph, scene[0])
    picture = Reflection(scene[0], method="depth_image", images=[image])
    steps.done("maze: depth image")
    whole = _case("maze", "pieces", scene[0], picture, image, GRAPH_STEPS)
    part = Ray(*(np.asarray(one)[::PART] for one in whole.ray))
    cases = [whole, whole._replace(walk="march", ray=part, pixels=whole.pixels[::PART], paper={})]
    rows += _all_rows(cases, fines, steps, galleries, picture)
    report = Report(
        name="rosen2011-fig17-fig19",
        title="How many steps rays take over a depth image",
        subject=f"Rosen et al. 2011, Figs. 17, 19 · a single-pole image of {size} × {size}, a graph camera's of "
        f"{wide[0]:,} × {wide[1]:,}",
        reading=_reading(rows),
        parts=(_table(rows), _plot(rows), *galleries),
        scene={
            "paper": PAPER,
            "teapots": f"a teapot of about {triangles:,} triangles before a standing patch of waves, as in Fig. 1, and "
            "before a larger teapot, as in Fig. 17; its depth image alone",
            "maze": "a teapot deep in a maze, all of which is in one image of a graph camera of "
            f"{len(graph.portals) + 1} frusta",
            "pixels": f"{width} × {height}, those that see the mirror",
        },
        machine=machine(),
        measured={
            "steps": "points of a ray that are projected, coarse and fine ones and those that are taken again; the "
            "mean is over all pixels of the mirror, also those whose rays pass the depth image by",
            "rays that enter": "those that come into the box around what the depth image holds",
            "changed": f"pixels that hit with one and miss with the other, or meet the image more than {SAME:g} pixel "
            "apart",
            "found": "of the rays whose true hit (Mitsuba) the image holds, those that meet it at that length, to "
            f"{TOLERANCE:g} of the radius of what the image shows, or within a fine step in the image",
            "maze by march": f"one ray in {PART}: without its pieces a ray must find the frusta by itself, point for "
            "point",
        },
        quick=quick,
    )
    steps.done("done")
    return report


def _case(
    name: str, walk: Walk, scene: Scene, picture: Reflection, image: DepthImage, paper: dict[tuple[float, bool], float]
) -> _Case:
    ray = picture.rays.ray
    pixels = np.flatnonzero(ray.valid)
    return _Case(name, walk, scene, image, Ray(*(np.asarray(one)[pixels] for one in ray)), pixels, paper)


def _all_rows(
    cases: list[_Case], fines: tuple[float, ...], steps: StepCounter, galleries: list[Gallery], picture: Reflection
) -> Rows:
    """Rows of cases of one scene, and pictures of the first."""
    rows, maps = [], {}
    for case in cases:
        truth = _true(case)
        for fine in fines:
            base = None
            for coarse in (None, COARSE):
                found = case.image.intersect(case.ray.origin, case.ray.direction, coarse, fine, walk=case.walk)
                base = found if base is None else base
                rows.append(_row(case, fine, coarse, found, base, truth))
                if case is cases[0] and fine == fines[-1]:
                    maps[coarse] = found.steps
                steps.done(f"{case.name}, {case.walk}, fine steps of {fine:g}")
    galleries.append(_gallery(cases[0], picture, maps))
    steps.done(f"{cases[0].name}: pictures")
    return rows


def _true(case: _Case) -> TrueHits:
    """True hits that the depth image holds; numbers are those of the case's rays."""
    camera, (origin, direction, _) = case.scene.camera, case.ray
    assert camera is not None
    count = camera.width * camera.height
    ways = np.where(np.arange(count)[:, None] >= 0, (0.0, 0.0, 1.0), 0.0)
    starts, valid = np.zeros((count, 3)), np.zeros(count, bool)
    starts[case.pixels], ways[case.pixels], valid[case.pixels] = origin, direction, True
    hits = true_hits(case.scene, camera, Ray(starts, ways, valid), (0,))
    points, middle = on_device(hits.points)
    kept = np.asarray(held(case.image, points, middle, _tolerance(case)).numpy())
    number = np.searchsorted(case.pixels, hits.number)
    return TrueHits(number[kept], hits.points[kept])


def _tolerance(case: _Case) -> float:
    return TOLERANCE * ball_of(used_vertices(case.scene.meshes[0]))[1]


def _row(
    case: _Case, fine: float, coarse: float | None, found: Intersections, base: Intersections, truth: TrueHits
) -> dict[str, Any]:
    apart = np.linalg.norm(found.pixel - base.pixel, axis=-1)
    changed = (found.hit != base.hit) | (base.hit & found.hit & (apart > SAME))
    entering = base.steps > 1
    number = truth.number
    far = np.linalg.norm(truth.points - np.asarray(case.ray.origin)[number], axis=-1)
    place = case.image.camera.project(truth.points).pixel[..., 0, :]  # pyright: ignore[reportAttributeAccessIssue]
    near = np.abs(found.distance[number] - far) <= _tolerance(case)
    near |= np.linalg.norm(found.pixel[number] - place, axis=-1) <= fine
    return {
        "scene": case.name,
        "walk": case.walk,
        "fine": fine,
        "coarse": "none" if coarse is None else f"{coarse:g}",
        "mean": float(found.steps.mean()),
        "entering": float(found.steps[entering].mean()) if entering.any() else None,
        "largest": int(found.steps.max()),
        "fewer": float(base.steps.sum() / found.steps.sum()),
        "changed_percent": 100 * float(changed.mean()),
        "found_percent": 100 * float((found.hit[number] & near).mean()) if len(number) else None,
        "paper_mean": case.paper.get((fine, coarse is not None)),
    }


def _gallery(case: _Case, picture: Reflection, maps: dict[float | None, np.ndarray]) -> Gallery:
    """The picture, the depth image, and the steps of each pixel as a heat map."""
    most = max(float(found.max()) for found in maps.values())
    stem = case.name.replace(",", "").replace(" ", "-")
    camera = case.scene.camera
    assert camera is not None and case.image.color is not None
    shown = [Picture(f"{stem}-picture", "Picture by depth images", picture.image())]
    for coarse, found in maps.items():
        heat = np.full((camera.width * camera.height, 3), 0.05, np.float32)
        heat[case.pixels] = heated(found, most)
        text = "Steps, without coarse ones" if coarse is None else f"Steps, coarse ones of {coarse:g} pixels"
        shown.append(
            Picture(
                f"{stem}-steps-{'fine' if coarse is None else 'coarse'}",
                text,
                heat.reshape(camera.height, camera.width, 3),
            )
        )
    shown.append(Picture(f"{stem}-image", "Depth image", case.image.color))
    note = (
        f"Black: 1 step; dark red, red and yellow: more; white: {most:,.0f}. Colors go by the logarithm, the same in "
        "both maps. Gray: beside the mirror."
    )
    return Gallery(case.name[0].upper() + case.name[1:], tuple(shown), note)


def heated(steps: np.ndarray, most: float) -> np.ndarray:
    """Colors (N, 3), linear RGB: from black at 1 step over red and yellow to white at the most, by the logarithm."""
    part = np.log(np.maximum(steps, 1)) / max(np.log(most), 1e-9)
    ramps = np.clip(np.stack([2.2 * part, 2.2 * part - 1.0, 3.0 * part - 2.0], -1), 0.0, 1.0)
    return (ramps**2).astype(np.float32)


def _table(rows: Rows) -> Table:
    columns = (
        Column("scene", "Scene"),
        Column("walk", "Walk", "", "march: point by point; pieces: frustum by frustum."),
        Column("fine", "Fine step", "px"),
        Column("coarse", "Coarse step", "px"),
        Column("mean", "Steps", "", "Mean over the mirror's pixels."),
        Column(
            "paper_mean",
            "Paper",
            "",
            "Mean steps; for the maze without the fine step, which it does not tell.",
            paper=True,
        ),
        Column("entering", "Entering", "", "Mean steps of the rays that enter the depth image's box."),
        Column("largest", "Most", "", "Of any ray.", brief=False),
        Column("fewer", "Fewer", "", "Times fewer steps than without coarse ones."),
        Column("changed_percent", "Changed", "%", "Pixels whose meeting is another one with coarse steps."),
        Column("found_percent", "Found", "%", "Of the true hits that the image holds."),
    )
    return Table("steps", "Steps of a ray", columns, tuple(rows))


def _plot(rows: Rows) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        kinds = list(dict.fromkeys((row["scene"], row["walk"]) for row in rows))
        for number, kind in enumerate(kinds):
            for coarse, style in (("none", "--"), (f"{COARSE:g}", "-")):
                mine = [row for row in rows if (row["scene"], row["walk"]) == kind and row["coarse"] == coarse]
                label = ", ".join(kind) if coarse != "none" else None
                x, y = [row["fine"] for row in mine], [row["mean"] for row in mine]
                axes.plot(x, y, style, marker="o", color=theme.palette[number], label=label)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("fine step, pixels of the depth image")
        axes.set_ylabel("steps, mean")
        axes.grid()
        plain_ticks(axes.xaxis)
        plain_ticks(axes.yaxis)
        figure.legend(loc="outside right upper")

    caption = (
        f"Steps against the length of fine ones. Dashed: without coarse ones; full: with those of {COARSE:g} pixels."
    )
    return Plot("steps", caption, "Lines of steps by fine step, by scene, with and without coarse steps", draw)


def _reading(rows: Rows) -> str:
    """The finding, from the figures themselves."""
    texts = []
    for name, goal in GOALS.items():
        mine = [row for row in rows if row["scene"] == name]
        finest = min(row["fine"] for row in mine)
        without, coarse = (row for row in mine if row["fine"] == finest and row["walk"] == mine[0]["walk"])
        met = coarse["fewer"] >= goal and coarse["changed_percent"] <= MOST_CHANGED
        texts.append(
            f"{name[0].upper() + name[1:]}: {format_number(without['mean'], 3)} steps a pixel with fine steps alone, "
            f"{format_number(coarse['mean'], 3)} with coarse ones, {format_number(coarse['fewer'], 3)} times fewer, "
            f"and {format_number(coarse['changed_percent'], 2)} % of the pixels changed (at least {goal:g} times fewer "
            f"and at most {MOST_CHANGED:g} % wanted: {'met' if met else 'missed'})."
        )
    pieces, march = (_last(rows, walk) for walk in ("pieces", "march"))
    texts.append(
        f"Frustum by frustum rays take {format_number(march['mean'] / pieces['mean'], 2)} times fewer steps through "
        f"the maze than point by point, and find {format_number(pieces['found_percent'], 4)} % of what the image "
        f"holds, in place of {format_number(march['found_percent'], 4)} %."
    )
    return " ".join(texts)


def _last(rows: Rows, walk: str) -> dict[str, Any]:
    return [row for row in rows if row["scene"] == "maze" and row["walk"] == walk][-1]
