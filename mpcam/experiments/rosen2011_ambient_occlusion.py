"""Rosen et al. 2011, Fig. 3: ambient occlusion by the output's z-buffer and by those of cameras that see more."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from mpcam.comparison import timing
from mpcam.comparison.numbers import format_number
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.depth_images.depth_image import DepthImage
from mpcam.effects.horizon_occlusion import screen_occlusion_device
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.rosen2011_occlusion_path import (
    BEFORE,
    GRAPH,
    HELD,
    MOST_BACK,
    NEAR,
    OUTPUT,
    RADIUS,
    SETTINGS,
    SHIFT,
    SPLIT,
    THICKNESS,
    TURN,
    WAYS,
    Flicker,
    Views,
    exposures,
    held_shares,
    settings_of,
)
from mpcam.experiments.rosen2011_paper import CARD, OCCLUSION_MS, PAPER
from mpcam.experiments.rosen2011_scenes import statue_scene
from mpcam.pictures.render import render
from mpcam.scene.occlusion import Occlusion
from mpcam.scene.scene import Scene

ROUNDS = 7
SPLIT_SET = "output + graph, split before"
GOAL = 2.0
"""Times less error and flicker that are wanted than with the output's z-buffer."""
PLACES, STEP = (0.0, 0.15, 0.45, 0.7), 1 / 120
"""Where stretches of the path begin, and from frame to frame, in parts of the path."""
TRUTH = ("", "truth")
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    triangles, size, blur, rays = (8_000, 48, 3, 16) if quick else (60_000, 320, 7, 64)
    places, frames = (PLACES[:1], 2) if quick else (PLACES, 2)
    count = rounds(repeats, quick, ROUNDS)
    scene = statue_scene(triangles, 0.0, size, size)
    views = Views(scene.mesh, size)
    calls = _calls(views, scene, blur)
    steps = StepCounter(progress, len(places) * frames + len(calls) * (1 + WARMUP + count) + 2)
    rows, found, shares = _quality(views, places, frames, blur, rays, steps)
    views.aim(0.0)
    pictures = _galleries(scene, views, *found)
    steps.done("pictures")
    times = timing.measure(calls, count, WARMUP, on_call=steps.done)
    _add_times(rows, {label: 1e3 * one.median for label, one in times.items()})
    report = Report(
        name="rosen2011-ambient-occlusion",
        title="Ambient occlusion by z-buffers that see more",
        subject=f"Rosen et al. 2011, Fig. 3 · a statue of {triangles:,} triangles, {size} × {size} pixels",
        reading=_reading(rows, shares),
        parts=(_table(rows), _plot(rows), _held_table(shares), *pictures),
        scene={
            "paper": PAPER,
            "statue": "a winged dragon of many thin limbs on a large ground: a stand-in, the paper's is not public",
            GRAPH: f"three frusta split in the statue's middle, centers {0.5 * SHIFT:g} aside; the output sees no more "
            "in front of the splitting plane",
            SPLIT: f"the same, split {BEFORE:g} before the middle, centers {SHIFT:g} aside",
            "two views": f"pinholes turned by {TURN:g} degrees around the statue, to either side",
        },
        machine=machine(),
        measured=measured(
            count,
            truth=f"{rays} rays from each pixel (Mitsuba), with the same radius, {RADIUS:g}, and weights",
            error=f"mean of absolute differences over pixels whose true exposure is below {NEAR:g}, of "
            f"{len(places) * frames} frames",
            flicker="mean change of the exposure of fixed points of the surface from one frame to the next, "
            f"{360 * STEP:g} degrees apart, mixed from the four pixels around, where both see them; the traced "
            "one's is its own noise",
            thickness=f"samples reach {THICKNESS:g} back; backs: as far as to the face turned away behind them, at "
            f"most {MOST_BACK:g}; without either, without end. Later z-buffers add only what earlier ones do not hold "
            "within that length",
            settings="directions and steps, the first two as in the paper: "
            + ", ".join(f"{name} {a} and {b}" for name, (a, b, _) in SETTINGS.items())
            + f"; blurred over {blur} pixels within surfaces (paper: 21 of 1,024), but for dense",
            held=f"points that lie no more than {HELD:g} off a z-buffer's depth, of those that rays from some pixels "
            "of the first frame of each stretch meet",
            paper=CARD,
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _quality(
    views: Views, places: tuple[float, ...], frames: int, blur: int, rays: int, steps: StepCounter
) -> tuple[Rows, tuple[Any, Any], dict[str, float]]:
    """Errors and flicker by setting and way; hits and exposures of the first frame; what z-buffers hold."""
    errors: dict[tuple[str, str], list[tuple[float, float]]] = {}
    changes: dict[tuple[str, str], list[float]] = {}
    first, shares = None, []
    for place in places:
        flicker = None
        for number in range(frames):
            views.aim(place + number * STEP)
            seen = views.seen()
            hits = seen.fronts
            found = exposures(seen, blur, rays)
            truth = found[TRUTH]
            counted = hits[OUTPUT].mask & (truth < NEAR)
            first = (hits, found) if first is None else first
            if number == 0:
                shares.append(held_shares(seen, truth, 1500, 64))
            flicker = Flicker(hits[OUTPUT], counted) if flicker is None else flicker
            flicker.add(hits[OUTPUT], found)
            for key, exposure in found.items():
                off = (exposure - truth)[counted]
                errors.setdefault(key, []).append((float(np.abs(off).mean()), float(off.mean())))
            steps.done(f"frame {number + 1} of {frames} at {place:g} of the path")
        assert flicker is not None
        for key, values in flicker.changes.items():
            changes.setdefault(key, []).extend(values)
    assert first is not None
    rows = []
    for (setting, way), values in errors.items():
        error, bias = np.mean(values, axis=0)
        base = errors[setting, OUTPUT] if setting else None
        row: dict[str, Any] = {"setting": setting or "-", "way": way, "error": float(error), "bias": float(bias)}
        row["flicker"] = float(np.mean(changes[setting, way]))
        if base is not None:
            row["less_error"] = float(np.mean(base, axis=0)[0] / error)
            row["less_flicker"] = float(np.mean(changes[setting, OUTPUT]) / row["flicker"])
        rows.append(row)
    return rows, first, {label: float(np.mean([one[label] for one in shares])) for label in shares[0]}


def _calls(views: Views, scene: Scene, blur: int) -> dict[str, Callable[[], object]]:
    """The lit picture, each z-buffer anew, and occlusion by each setting and way."""
    seen = views.seen()
    calls: dict[str, Callable[[], object]] = {"lit": partial(render, views.cameras[OUTPUT], scene)}
    for name, one in views.fronts.items():
        calls[name] = one.frame
    for name, one in views.backs.items():
        calls[f"{name}, backs"] = one.frame
    for setting in OCCLUSION_MS:
        for label, way in WAYS.items():
            given = settings_of(way, seen, setting, blur)
            buffers = {name: given.pop(name, None) for name in ("zbuffer", "backs")}
            occlusion = Occlusion(RADIUS, **given)
            calls[f"{setting} {label}"] = partial(screen_occlusion_device, seen.fronts[OUTPUT], occlusion, **buffers)
    return calls


def _add_times(rows: Rows, ms: dict[str, float]) -> None:
    """Times beside the rows, and the paper's."""
    for row in rows:
        way, setting = WAYS.get(row["way"]), row["setting"]
        if way is None or setting not in OCCLUSION_MS:
            continue
        row["buffers_ms"] = sum(ms[name] for name in way.buffers if name != OUTPUT)
        row["buffers_ms"] += sum(ms[f"{name}, backs"] for name in way.buffers) if way.backs else 0.0
        row["occlusion_ms"] = ms[f"{setting} {row['way']}"]
        row["penalty_percent"] = 100 * (row["occlusion_ms"] / ms[f"{setting} {OUTPUT}"] - 1)
        row["lit_ms"] = ms["lit"]
        paper = OCCLUSION_MS[setting]
        if row["way"] in paper:
            row["paper_penalty"] = 100 * (paper[row["way"]][2] / paper[OUTPUT][2] - 1)


def _galleries(scene: Scene, views: Views, hits: Any, found: dict[tuple[str, str], np.ndarray]) -> list[Gallery]:
    """What the cameras see; exposures; and where they are wrong."""
    seen = []
    for name, camera in views.cameras.items():
        color = DepthImage.render(camera, scene).color
        assert color is not None
        seen.append(Picture(f"seen-{_file(name)}", f"z-buffer: {name}", color))
    truth = found[TRUTH]
    shown = [Picture("exposure-truth", "Traced", _gray(truth))]
    wrong = []
    for label in WAYS:
        exposure = found["dense", label]
        shown.append(Picture(f"exposure-{_file(label)}", f"By {label}", _gray(exposure)))
        off = np.where(hits[OUTPUT].mask, exposure - truth, 0.0)
        wrong.append(Picture(f"error-{_file(label)}", f"By {label}", _signed(off)))
    note = "Blue: too dark, red: too bright, white: right; full color at 0.25."
    return [
        Gallery("Exposure, dense setting", tuple(shown)),
        Gallery("Where it is wrong", tuple(wrong), note),
        Gallery("What each camera sees", tuple(seen)),
    ]


def _gray(exposure: np.ndarray) -> np.ndarray:
    return np.repeat(exposure[..., None], 3, axis=-1).astype(np.float32)


def _signed(off: np.ndarray) -> np.ndarray:
    part = np.clip(np.abs(off) / 0.25, 0, 1)[..., None]
    color = np.where(off[..., None] > 0, (0.75, 0.02, 0.02), (0.02, 0.08, 0.75))
    return (1 - part + part * color).astype(np.float32)


def _file(label: str) -> str:
    return label.replace(",", "").replace("+ ", "").replace(" ", "-")


def _table(rows: Rows) -> Table:
    columns = (
        Column("setting", "Setting"),
        Column("way", "z-buffers"),
        Column("error", "Error", "", "Mean of absolute differences to the traced exposure."),
        Column("bias", "Bias", "", "Mean difference: below 0, too dark.", brief=False),
        Column("flicker", "Flicker", "", "Mean change at fixed points from frame to frame."),
        Column("less_error", "Less error", "", "Times less than by the output's z-buffer."),
        Column("less_flicker", "Less flicker", "", "Times less than by the output's z-buffer."),
        Column("lit_ms", "Lit picture", "ms", "Without occlusion.", brief=False),
        Column("buffers_ms", "z-buffers", "ms", "First hits of the further cameras."),
        Column("occlusion_ms", "Occlusion", "ms", "The walk and the blur."),
        Column("penalty_percent", "Penalty", "%", "More time for occlusion than by the output's z-buffer."),
        Column("paper_penalty", "Paper", "%", "The same in the paper.", paper=True),
    )
    return Table("occlusion", "Errors, flicker and times", columns, tuple(rows))


def _plot(rows: Rows) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        for number, label in enumerate(WAYS):
            for setting, marker in zip(SETTINGS, "os^", strict=True):
                row = next(row for row in rows if (row["setting"], row["way"]) == (setting, label))
                name = label if marker == "o" else None
                axes.plot(row["flicker"], row["error"], marker, color=theme.palette[number], label=name)
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("flicker")
        axes.set_ylabel("error")
        axes.grid()
        figure.legend(loc="outside right upper")

    return Plot(
        "error-flicker",
        "Round: regular setting; square: fine; triangle: dense.",
        "Points of error and flicker by z-buffer",
        draw,
    )


def _held_table(shares: dict[str, float]) -> Table:
    columns = (Column("buffers", "z-buffers"), Column("held_percent", "Held", "%", "Of the true occlusion, by weight."))
    rows = tuple({"buffers": label, "held_percent": share} for label, share in shares.items())
    note = "No way of walking finds more than this, but for what a thickness guesses."
    return Table("held", "What z-buffers hold of what covers", columns, rows, note)


def _reading(rows: Rows, shares: dict[str, float]) -> str:
    """The finding, from the figures themselves."""
    by = {(row["setting"], row["way"]): row for row in rows}

    def of(setting: str, way: str, key: str, digits: int = 2) -> str:
        return format_number(by[setting, way][key], digits)

    fine = f"{of('fine', OUTPUT, 'error', 3)} and {of('fine', OUTPUT, 'flicker', 3)}"
    texts = [
        f"At the paper's fine setting error and flicker are {fine} with the output's z-buffer, "
        f"{of('fine', 'graph', 'error', 3)} and {of('fine', 'graph', 'flicker', 3)} with the graph camera's. Of "
        f"what covers, the output's holds {format_number(shares['output'], 3)} %, both together "
        f"{format_number(shares['output + graph'], 3)} %, and {format_number(shares[SPLIT_SET], 3)} % where the graph "
        f"camera splits before the statue, two views from aside {format_number(shares['output + two views'], 3)} %: "
        "another z-buffer alone mends little. Most of the error is that samples which reach back without end darken "
        "what thin limbs leave open."
    ]
    for way in list(WAYS)[2:]:
        parts = []
        for setting in ("fine", "dense"):
            row = by[setting, way]
            met = {key: "met" if row[key] >= GOAL else "missed" for key in ("less_error", "less_flicker")}
            parts.append(
                f"{of(setting, way, 'less_error')} times less error ({met['less_error']}) and "
                f"{of(setting, way, 'less_flicker')} times less flicker ({met['less_flicker']}) at the {setting} "
                "setting"
            )
        texts.append(f"{way[0].upper() + way[1:]}: {', '.join(parts)}.")
    texts.append(f"Wanted: {GOAL:g} times less of both.")
    return " ".join(texts)
