"""`mpcam.compare`: a scene through every projection model that applies, each against the truth and the clock."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.comparison import metrics, timing
from mpcam.comparison.facts import machine_facts, scene_facts
from mpcam.comparison.mirrors import mirror_plan, mirror_rows
from mpcam.comparison.motion import MOTION, moving_frame, moving_vertices
from mpcam.comparison.pareto import pareto_front
from mpcam.comparison.plan import Choice, make_plan
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.comparison.rows import Row
from mpcam.comparison.table import Comparison
from mpcam.errors import InputError

WARMUP = 2


@dataclass
class _Case:
    """A choice made ready: what it renders with, and what is known of its row so far."""

    choice: Choice
    prepared: Any
    row: Row


def compare(
    scene: Any,
    methods: Iterable[str] | None = None,
    *,
    settings: Mapping[str, Sequence[Mapping[str, Any] | float]] | None = None,
    camera: Any = None,
    repeats: int = 9,
    output: str | Path | None = None,
    progress: Progress | None = None,
    shading: str = "light",
    moving: bool = True,
) -> Comparison:
    """Render a scene by each method and setting, measure error against ray-traced first hits, and run time.

    scene: a Scene, a Mesh or a list of Mesh; the camera is the scene's, or `camera`. methods: names, None for all that
    apply. settings: method -> list of settings (mappings, or the bare number of the method's parameter).
    repeats: timed rounds. shading: "color", "normal", "texture" or "light", the same for all methods and the truth.
    moving: also time frames that take new vertices. output: a folder for CSV, JSON, plot, images and the report page;
    written whole or not at all. progress: called as progress(done, total, what) after each step.

    Same pixels, same shading, same scene for every method. The truth of the image is the same shading of the true first
    hits. A method that cannot show what the camera sees is left out, with the reason in `.left_out`. Raises
    `InputError` for a scene without camera or triangles, unknown methods or settings, and an unusable output folder.
    """
    from mpcam.comparison.output import check_output
    from mpcam.rendering.methods import prepare, rasterize
    from mpcam.rendering.shade import shade
    from mpcam.scene.scene import Scene

    scene = Scene.of(scene)
    camera = scene.camera if camera is None else camera
    if camera is None:
        raise InputError(f"Scene {scene.name!r} has no camera; give it one, or pass camera= to compare.")
    if repeats < 1:
        raise InputError(f"repeats={repeats}: at least 1 timed round is needed.")
    if scene.reliefs:
        raise InputError(
            f"Scene {scene.name!r} has reliefs, which every method shows in the same way: leave them out of a "
            "comparison of methods, or give them as meshes"
        )
    if output is not None:
        check_output(output)
    mesh = scene.mesh
    if scene.mirror is not None or scene.refractor is not None:
        plan = mirror_plan(scene, methods, settings)
        return _mirrored(scene, camera, plan, repeats, output, progress, shading, moving)
    plan = make_plan(mesh.triangle_count, methods, settings, camera)
    each = 1 + (1 + WARMUP + repeats) * (3 if moving else 2)
    steps = StepCounter(progress, 2 + len(plan) * each)

    truth = rasterize(camera, mesh, method="raytrace")
    truth_image = np.asarray(shade(truth, scene, shading))
    steps.done("truth")

    cases: dict[str, _Case] = {}
    images: dict[str, np.ndarray] = {}
    refused: dict[Choice, str] = {}
    for choice in plan:
        started = timing.now()
        try:
            prepared = prepare(camera, mesh, choice.method, **choice.settings)
        except InputError as error:
            if settings and choice.method in settings:
                raise
            refused[choice] = str(error).rstrip(".")
            steps.skip(each)
            continue
        hits = prepared.frame()
        timing.synchronize()
        first_ms = 1e3 * (timing.now() - started)
        image = np.asarray(shade(hits, scene, shading))
        images[choice.label] = image
        row = _errors(choice, camera, mesh, hits, truth, image, truth_image)
        cases[choice.label] = _Case(choice, prepared, replace(row, compile_ms=first_ms))
        steps.done(choice.label)

    left_out = _left_out(refused, cases.values())
    if not cases:
        raise InputError(f"No method is left to compare: {'; '.join(left_out.values()) or 'none was named'}.")

    still = timing.measure(
        {label: case.prepared.frame for label, case in cases.items()},
        repeats,
        WARMUP,
        stages={} if moving else {label: case.prepared.stages for label, case in cases.items()},
        on_call=steps.done,
    )
    shaders = {label: _Shading(case.prepared, scene, shading) for label, case in cases.items()}
    shaded = timing.measure(
        {label: shader.run for label, shader in shaders.items()},
        repeats,
        WARMUP,
        before={label: shader.renew for label, shader in shaders.items()},
        on_call=steps.done,
    )
    moved: dict[str, timing.Timing] = {}
    if moving:
        positions = moving_vertices(mesh)
        moved = timing.measure(
            {label: moving_frame(case.prepared, positions) for label, case in cases.items()},
            repeats,
            WARMUP,
            stages={label: case.prepared.stages for label, case in cases.items()},
            on_call=steps.done,
        )
    rows = [_timed(case.row, still[label], shaded[label], moved.get(label)) for label, case in cases.items()]
    front = pareto_front([row.flip for row in rows], [row.still_ms for row in rows])
    comparison = Comparison(
        rows=tuple(replace(row, on_front=bool(on)) for row, on in zip(rows, front, strict=True)),
        name=scene.name,
        scene=scene_facts(scene, camera, shading),
        machine=machine_facts(),
        measured=_how(repeats, moving),
        left_out=left_out,
        images=images,
        truth_image=truth_image,
        truth_depth=np.asarray(truth.depth),
        camera=camera,
    )
    if output is not None:
        comparison.write(output)
    steps.done("report" if output is not None else "done")
    return comparison


def _mirrored(
    scene: Any,
    camera: Any,
    plan: list[Choice],
    repeats: int,
    output: str | Path | None,
    progress: Progress | None,
    shading: str,
    moving: bool,
) -> Comparison:
    """`compare` for a scene with a mirror or a refractor."""
    each = 1 + (WARMUP + repeats) * (2 if moving else 1)
    steps = StepCounter(progress, 2 + len(plan) * each)
    rows, images, truth = mirror_rows(
        scene,
        camera,
        plan,
        shading=shading,
        repeats=repeats,
        warmup=WARMUP,
        moving=moving_vertices(scene.mesh) if moving else None,
        steps=steps,
    )
    front = pareto_front([row.flip for row in rows], [row.still_ms for row in rows])
    how = _how(repeats, moving) | {
        "still": "a whole picture when all building is done: what is beside the mirror or glass and in it, both shaded",
        "truth": "rays of the true surface, traced by Mitsuba, and the same shading of their first hits",
    }
    what, found = ("mirror", scene.mirror) if scene.mirror is not None else ("refractor", scene.refractor)
    facts = {what: type(found.surface).__name__ + (f", index {found.index}" if found.index else "")}
    comparison = Comparison(
        rows=tuple(replace(row, on_front=bool(on)) for row, on in zip(rows, front, strict=True)),
        name=scene.name,
        scene=scene_facts(scene, camera, shading) | facts,
        machine=machine_facts(),
        measured={name: text for name, text in how.items() if name != "projection error"},
        images=images,
        truth_image=truth,
        camera=camera,
    )
    if output is not None:
        comparison.write(output)
    steps.done("report" if output is not None else "done")
    return comparison


def _left_out(refused: Mapping[Choice, str], cases: Iterable[_Case]) -> dict[str, str]:
    """Reasons by method where all its settings were refused alike, else by setting."""
    served = {case.choice.method for case in cases}
    reasons: dict[str, str] = {}
    for choice, reason in refused.items():
        others = {text for other, text in refused.items() if other.method == choice.method}
        reasons[choice.label if choice.method in served or len(others) > 1 else choice.method] = reason
    return reasons


def _errors(choice: Choice, camera: Any, mesh: Any, hits: Any, truth: Any, image: Any, truth_image: Any) -> Row:
    hit = metrics.hit_errors(hits, truth)
    projection = metrics.projection_errors(camera, mesh, hits)
    rmse = metrics.image_rmse(image, truth_image)
    note = choice.note
    if choice.method == "raytrace":
        note = "the truth, so its errors against it are 0 by definition"
    return Row(
        method=choice.method,
        setting=choice.setting,
        parameter=choice.parameter,
        hit_mismatch=hit.hit_mismatch,
        triangle_mismatch=hit.triangle_mismatch,
        depth_median=hit.depth_median,
        depth_p999=hit.depth_p999,
        rmse=rmse,
        psnr=metrics.psnr(rmse),
        flip=float(metrics.flip_map(image, truth_image).mean()),
        projection_median=projection.median,
        projection_p95=projection.p95,
        projection_max=projection.max,
        tests=float(hits.stats.tests),
        rendered=float(hits.stats.rendered),
        overdraw=float(hits.stats.overdraw),
        note=note,
    )


def _timed(row: Row, still: timing.Timing, shaded: timing.Timing, moved: timing.Timing | None) -> Row:
    row = replace(
        row,
        still_ms=1e3 * still.median,
        still_spread=1e3 * still.spread,
        shade_ms=1e3 * shaded.median,
        stages_ms={name: 1e3 * seconds for name, seconds in (moved or still).stages.items()},
    )
    return row if moved is None else replace(row, moving_ms=1e3 * moved.median, moving_spread=1e3 * moved.spread)


class _Shading:
    """Shades first hits that nothing has asked for anything yet, since hits keep what they work out."""

    def __init__(self, prepared: Any, scene: Any, shading: str):
        self.prepared, self.scene, self.shading = prepared, scene, shading
        self.hits: Any = None

    def renew(self) -> None:
        self.hits = self.prepared.frame()

    def run(self) -> Any:
        from mpcam.rendering.shade import shade_device

        return shade_device(self.hits, self.scene, self.shading)


def _how(repeats: int, moving: bool) -> dict[str, str]:
    how = {
        "rounds": f"{repeats} timed rounds after one first call each and {WARMUP} warm-up rounds; every round runs "
        "every method once, in a fresh shuffled order, so that drifts of the machine fall on all alike",
        "times": "wall clock until the device is done; medians, with the interquartile range as spread",
        "still": "first hits of a frame when all building is done",
    }
    if moving:
        how["moving"] = (
            "new vertices, everything rebuilt that depends on them, then the frame; the vertices alternate between two "
            f"arrays that differ by up to {MOTION:g} of the scene's diagonal"
        )
    how["first frame"] = "preparing and the first frame, kernels compiled or loaded from Dr.Jit's cache on disk"
    how["truth"] = "first hits of the exact rays in Mitsuba (float32); the true image is the same shading of those hits"
    how["projection error"] = (
        "from each hit pixel's center to the exact image (float64) of the point that the triangle and barycentrics name"
    )
    return how
