"""Rosen et al. 2011, Figs. 1, 11 and 15: a teapot and a knot before a mirror, by depth images of several cameras."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.comparison import timing
from mpcam.comparison.metrics import flip_map, image_rmse
from mpcam.comparison.motion import moving_vertices
from mpcam.comparison.numbers import format_number
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.depth_images.depth_image import DepthImage
from mpcam.depth_images.layered import LayeredDepthImage
from mpcam.effects.by_depth_image import ByDepthImages
from mpcam.effects.choose_camera import TOLERANCE, ChosenCamera, choose_occlusion_camera
from mpcam.effects.depth_image_views import ball_of, used_vertices
from mpcam.effects.missing_samples import held, on_device, true_hits
from mpcam.effects.reflection import Reflection
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.rosen2011_paper import PAPER
from mpcam.experiments.rosen2011_scenes import reflection_scene
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import moved
from mpcam.scene.scene import Scene

ROUNDS = 9
PINHOLE, POLE, CHOSEN, TRACE = "pinhole", "single pole", "single pole, chosen", "Mitsuba"
LAYERS = (2, 3, 4)
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    things, layers = (("teapot",), LAYERS[:1]) if quick else (("teapot", "knot"), LAYERS)
    settings = (2_000, 96, 72, 96, 16) if quick else (20_000, 640, 480, 512, 150)
    calls = 5 + len(layers)
    steps = StepCounter(progress, len(things) * (3 + calls * (1 + WARMUP + count)) + 1)
    rows, galleries, found = [], [], {}
    for thing in things:
        case = _Case(thing, *settings, layers)
        steps.done(f"{thing}: a camera is looked for")
        mine = case.rows()
        steps.done(f"{thing}: pictures")
        times = timing.measure(case.calls(), count, WARMUP, on_call=steps.done)
        for row in mine:
            row["moving_ms"] = 1e3 * times[row["method"]].median
            row["ratio"] = times[row["method"]].median / times[TRACE].median
        rows += mine
        galleries.append(case.gallery())
        found[thing] = case.chosen
        steps.done(f"{thing}: done")
    count_of = settings[0]
    report = Report(
        name="rosen2011-fig1",
        title="What depth images lack in a mirror",
        subject=f"Rosen et al. 2011, Figs. 1, 11, 15 · {count_of:,} triangles, images of {settings[3]} × {settings[3]}",
        reading=_reading(rows, found),
        parts=(_table(rows), _plot(rows), *galleries),
        scene={
            "paper": PAPER,
            "thing": f"a teapot or a knot of about {count_of:,} triangles close to a bumpy mirror, above checks",
            "floor": "by parallel rays in all of the depth images' rows; the environment map has it too",
        },
        machine=machine(),
        measured=measured(
            count,
            missing="of the pixels whose ray hits the thing, those whose true hit (Mitsuba) no depth image holds: its "
            f"depth there is off by more than {TOLERANCE:g} of the thing's radius",
            error="root mean square over the whole picture, and mean FLIP, against rays traced from the true surface",
            moving="all vertices of the thing new, its depth image rendered and shaded anew (or the tree rebuilt), all "
            "mirror rays followed, colors looked up; the floor stands still",
            layered="layers are peeled by tracing, on the host, since nothing here draws them faster",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


class _Case:
    """One thing before the mirror, by every method."""

    def __init__(
        self, thing: str, triangles: int, width: int, height: int, size: int, evaluations: int, layers: tuple[int, ...]
    ):
        self.thing, self.size, self.layers = thing, size, layers
        self.scene = scene = reflection_scene(triangles, thing, width=width, height=height)
        self.only = Scene((scene.meshes[0],), None, scene.lights, scene.ambient, scene.background)
        self.chosen = choose_occlusion_camera(scene, size=size, evaluations=evaluations)
        self.pictures: dict[str, Reflection] = {
            PINHOLE: self._by_images(aside=0.0),
            POLE: self._by_images(),
            CHOSEN: self._by_images(images=[(self.chosen.camera, 0)]),
        }
        self.pinhole = _thing_of(self.pictures[PINHOLE]).camera
        floor = next(shown for shown in _part(self.pictures[PINHOLE]).shown if shown.view.kind == "flat").images[0]
        self.layered = {count: LayeredDepthImage.render(self.pinhole, self.only, count) for count in layers}
        for count, image in self.layered.items():
            self.pictures[f"{count} layers"] = self._by_images(images=[*image.layers, floor])
        self.pictures["environment"] = Reflection(scene, method="environment", size=size)
        self.pictures[TRACE] = Reflection(scene, method="raytrace")
        self.images = {label: picture.image() for label, picture in self.pictures.items()}

    def _by_images(self, **settings: Any) -> Reflection:
        return Reflection(self.scene, method="depth_image", size=self.size, **settings)

    def missing(self) -> dict[str, np.ndarray]:
        """(H, W) bool, pixels whose true hit on the thing is missing, by label."""
        camera = self.scene.camera
        hits = true_hits(self.scene, camera, self.pictures[TRACE].rays.ray, (0,))
        points, middle = on_device(hits.points)
        radius = ball_of(used_vertices(self.scene.meshes[0]))[1]
        sets = {label: [_thing_of(self.pictures[label])] for label in (PINHOLE, POLE, CHOSEN)}
        sets |= {f"{count} layers": list(image.layers) for count, image in self.layered.items()}
        found = {}
        self.seen = len(hits.number)
        for label, images in sets.items():
            kept = [np.asarray(held(image, points, middle, TOLERANCE * radius).numpy()) for image in images]
            gone = np.zeros(camera.width * camera.height, bool)
            gone[hits.number] = ~np.logical_or.reduce(kept)
            found[label] = gone.reshape(camera.height, camera.width)
        return found

    def rows(self) -> Rows:
        self.gone, truth = self.missing(), self.images[TRACE]
        rows = []
        for label, image in self.images.items():
            gone = self.gone.get(label)
            row: dict[str, Any] = {"thing": self.thing, "method": label}
            row["missing_percent"] = None if gone is None else 100 * gone.sum() / max(self.seen, 1)
            row["rmse"] = image_rmse(image, truth)
            row["flip"] = float(flip_map(image, truth).mean())
            rows.append(row)
        before = rows[0]["missing_percent"]
        for row in rows:
            part = row["missing_percent"]
            row["fewer"] = None if part is None else before / part if part > 0 else np.inf
        return rows

    def calls(self) -> dict[str, Callable[[], object]]:
        """A frame of each method with all of the thing's vertices new."""
        mesh, whole = self.scene.meshes[0], self.scene.mesh
        places = moving_vertices(mesh)
        rest = [None] * (len(self.scene.meshes) - 1)
        wholes = [moved(whole, [place, *rest], normals=whole.normals) for place in places]
        alone = [Scene((_replaced(mesh, place),), None, self.only.lights, self.only.ambient) for place in places]
        calls: dict[str, Callable[[], object]] = {}
        for label, picture in self.pictures.items():
            if label.endswith(" layers"):
                calls[label] = self._layered_frame(alone, int(label.split()[0]), picture)
            else:
                calls[label] = _frame(picture, wholes)
        return calls

    def _layered_frame(self, scenes: list[Scene], layers: int, picture: Reflection) -> Callable[[], object]:
        count = 0

        def frame() -> object:
            nonlocal count
            count += 1
            LayeredDepthImage.render(self.pinhole, scenes[count % 2], layers)
            return picture.part.colors()

        return frame

    def gallery(self) -> Gallery:
        """Depth images, pictures made with them, and in red what they lack."""
        shown = []
        for label in (POLE, PINHOLE, CHOSEN):
            image = _thing_of(self.pictures[label]).color
            assert image is not None
            shown.append(Picture(f"{self.thing}-{_file(label)}-image", f"Depth image, {label}", image))
        for label, image in self.images.items():
            shown.append(Picture(f"{self.thing}-{_file(label)}", label[0].upper() + label[1:], image))
        for label in (PINHOLE, POLE, CHOSEN):
            marked = np.where(self.gone[label][..., None], (0.9, 0.02, 0.02), 0.35 + 0.5 * self.images[TRACE])
            shown.append(
                Picture(f"{self.thing}-{_file(label)}-missing", f"Missing, {label}", marked.astype(np.float32))
            )
        return Gallery(f"The {self.thing}", tuple(shown))


def _part(picture: Reflection) -> ByDepthImages:
    assert isinstance(picture.part, ByDepthImages)
    return picture.part


def _thing_of(picture: Reflection) -> DepthImage:
    """The depth image of the first mesh."""
    return next(shown for shown in _part(picture).shown if shown.view.meshes == (0,)).images[0]


def _frame(picture: Reflection, meshes: list[Mesh]) -> Callable[[], object]:
    count = 0

    def frame() -> object:
        nonlocal count
        count += 1
        picture.part.move(meshes[count % 2])
        return picture.part.colors()

    return frame


def _replaced(mesh: Mesh, vertices: np.ndarray) -> Mesh:
    return moved(mesh, vertices, normals=mesh.normals)


def _file(label: str) -> str:
    return label.replace(",", "").replace(" ", "-")


def _table(rows: Rows) -> Table:
    columns = (
        Column("thing", "Thing"),
        Column("method", "Method"),
        Column("missing_percent", "Missing", "%", "Of the pixels that show the thing, those without their sample."),
        Column("fewer", "Fewer", "", "Times fewer missing pixels than with the pinhole."),
        Column("rmse", "Error", "", "Root mean square, of the whole picture."),
        Column("flip", "FLIP", "", "Mean, of the whole picture.", brief=False),
        Column("moving_ms", "Frame", "ms", "Median, with the thing moving."),
        Column("ratio", "Ratio", "", "Over Mitsuba's, whose tree is rebuilt."),
    )
    return Table("missing", "What is missing, and at what cost", columns, tuple(rows))


def _plot(rows: Rows) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        names = list(dict.fromkeys(row["method"] for row in rows if row["method"] != TRACE))
        markers = dict(zip(dict.fromkeys(row["thing"] for row in rows), "os", strict=False))
        for row in rows:
            if row["method"] == TRACE:
                axes.axvline(row["moving_ms"], color=theme.soft, linewidth=1, linestyle="--")
                continue
            color = theme.palette[names.index(row["method"]) % len(theme.palette)]
            label = row["method"] if row["thing"] == rows[0]["thing"] else None
            axes.plot(row["moving_ms"], row["rmse"], markers[row["thing"]], color=color, label=label)
        axes.set_xscale("log")
        axes.set_xlabel("ms a frame, the thing moving")
        axes.set_ylabel("error to Mitsuba")
        axes.grid()
        figure.legend(loc="outside right upper")

    caption = "Error against time of a moving frame; round: teapot, square: knot. Dashed: Mitsuba's time."
    return Plot("error-time", caption, "Points of error and time by method", draw)


def _reading(rows: Rows, found: dict[str, ChosenCamera]) -> str:
    """The finding, from the figures themselves."""
    texts = []
    for thing, chosen in found.items():
        mine = {row["method"]: row for row in rows if row["thing"] == thing}

        def of(label: str, key: str, digits: int = 2, mine: dict[str, Any] = mine) -> str:
            return format_number(mine[label][key], digits)

        goals = [
            f"{of(label, 'fewer', 3)} times fewer with the {label} camera (at least {goal} wanted: "
            f"{'met' if mine[label]['fewer'] >= goal else 'missed'})"
            for label, goal in ((POLE, 4), (CHOSEN, 8))
        ]
        layered = ", ".join(
            f"{of(label, 'missing_percent')} % with {label}" for label in mine if label.endswith("layers")
        )
        texts.append(
            f"The {thing}: {of(PINHOLE, 'missing_percent', 3)} % of its pixels lack their sample with a pinhole; "
            f"{' and '.join(goals)}; {layered}. The camera was found in {format_number(chosen.seconds, 2)} s, "
            f"{chosen.evaluations} depth images. A moving frame takes {of(POLE, 'moving_ms', 3)} ms, "
            f"{of(POLE, 'ratio')} of Mitsuba's; error: {of(PINHOLE, 'rmse')} by the pinhole, {of(POLE, 'rmse')} by the "
            f"single pole, {of(CHOSEN, 'rmse')} by the chosen one, {of('environment', 'rmse')} by the environment map."
        )
    return " ".join(texts)
