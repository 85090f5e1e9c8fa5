"""The mirrors of Hou et al. 2006, Fig. 6, by fitted camera triangles beside decomposed ones: errors of pictures."""

import time
from typing import Any

import numpy as np

from mpcam.comparison import timing
from mpcam.comparison.metrics import flip_map, image_rmse, psnr
from mpcam.comparison.numbers import format_number
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.decomposition.ray_error import ray_error
from mpcam.effects.reflection import Reflection
from mpcam.effects.shadows import shadow_maps
from mpcam.experiments import hou2006_paper as paper
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.hou2006_fig6 import tessellations
from mpcam.experiments.hou2006_scenes import SHAPES, reflection_scene, smaller
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.fitting.fit import fit
from mpcam.scene.scene import Scene

ROUNDS = 7
DECOMPOSED, FITTED = "decomposed", "fitted"
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    shapes = SHAPES[:1] if quick else SHAPES
    steps = StepCounter(progress, len(shapes) * (1 + (2 if quick else 6) * 2 * (2 + WARMUP + count)) + 1)
    rows: Rows = []
    galleries = []
    for shape in shapes:
        scene = reflection_scene(shape)
        scene = smaller(scene) if quick else scene
        mine, pictures = _shown(shape, scene, quick, steps)
        times = timing.measure({k: p.frame for k, p in pictures.items()}, count, WARMUP, on_call=steps.done)
        for row, found in zip(mine, times.values(), strict=True):
            row["still_ms"], row["still_spread"] = 1e3 * found.median, 1e3 * found.spread
        rows += mine
        galleries.append(_gallery(shape, scene, pictures))
    report = Report(
        name="fit-hou2006-fig6",
        title="Mirrors by fitted camera triangles",
        subject="Hou et al. 2006, Fig. 6, with the same numbers of camera triangles fitted to the true rays",
        reading=_reading(rows),
        parts=(_plot(rows), _table(rows), *galleries),
        scene={"paper": paper.PAPER, "mirrors": "those of hou2006-fig6, with the same light, shadows and pixels"},
        machine=machine(),
        measured=measured(
            count,
            truth="Mitsuba: rays from the exact points and normals of the surface, the same shading",
            FLIP_and_PSNR="over the pixels of the mirror; LDR-FLIP, mean; PSNR in sRGB",
            ray_error="root mean square distance of rays from the true ones two radii of the mirror away",
            still="a whole shaded picture, scene beside the mirror included",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _shown(shape: str, scene: Scene, quick: bool, steps: StepCounter) -> tuple[Rows, dict[str, Reflection]]:
    """Rows and pictures of a mirror, decomposed and fitted, from few to many."""
    assert scene.mirror is not None
    surface, maps = scene.mirror.surface, shadow_maps(scene, 256 if quick else 2048)
    truth = Reflection(scene, method="raytrace", shadows=maps)
    image = truth.image()
    mask = truth.mask & (np.asarray(truth.direct.frame().depth) > truth.rays.distance.reshape(truth.mask.shape))
    steps.done(f"{shape}: truth")
    rows, pictures = [], {}
    for cams in tessellations(scene, quick)[: 2 if quick else None]:
        start = time.perf_counter()
        best = fit(cams, reflector=surface, eye=scene.camera, iterations=4 if quick else 30)
        seconds = time.perf_counter() - start
        for kind, one in ((DECOMPOSED, cams), (FITTED, best.camera)):
            picture = Reflection(scene, cams=one, shadows=maps)
            ours = picture.image()
            found = ray_error(one, surface, scene.camera)
            rows.append(
                {
                    "mirror": shape,
                    "kind": kind,
                    "triangles": one.count,
                    "flip": float(flip_map(ours, image)[mask].mean()),
                    "psnr": psnr(image_rmse(ours[mask], image[mask])),
                    "rms": found.rms,
                    "angle": found.angle_rms,
                    "seconds": seconds if kind == FITTED else None,
                }
            )
            pictures[f"{one.count} {kind}"] = picture
            steps.done(f"{shape}: {one.count} {kind}")
    return rows, pictures


def enough(rows: Rows, mirror: str, measure: str = "flip") -> float:
    """How many fitted camera triangles, for each decomposed one, give a picture as good: at most, over all numbers.

    Numbers between those that were tried are interpolated, both logarithmic; where more of them did no better, the
    fewer count. Left out are the fewest, below which nothing was fitted, and pictures that are as good as they get,
    where pixels and no longer rays decide; NaN if all are.
    """
    by = {
        kind: [row for row in rows if row["mirror"] == mirror and row["kind"] == kind] for kind in (DECOMPOSED, FITTED)
    }
    sign, room = (-1.0, 0.5) if measure == "psnr" else (1.0, 0.1 * min(row[measure] for row in by[FITTED]))
    tried = np.array([row["triangles"] for row in by[FITTED]], float)
    errors = np.minimum.accumulate([sign * row[measure] for row in by[FITTED]])
    found = []
    for row in by[DECOMPOSED]:
        here = sign * row[measure]
        if row["triangles"] > tried[0] and here > errors[-1] + room:
            same = np.exp(np.interp(here, errors[::-1], np.log(tried[::-1])))
            found.append(float(same) / row["triangles"])
    return max(found, default=np.nan)


def _reading(rows: Rows) -> str:
    said = []
    for mirror in dict.fromkeys(row["mirror"] for row in rows):
        parts = " and ".join(f"{format_number(enough(rows, mirror, m), 2)} ({m.upper()})" for m in ("flip", "psnr"))
        said.append(f"{mirror}: {parts}")
    return (
        "So many fitted camera triangles, for each decomposed one, give a picture as good, at worst over the numbers "
        f"at which rays decide: {'; '.join(said)}. The pixels of the atlas limit all pictures in the end. Frames take "
        "as long with fitted ones."
    )


def _plot(rows: Rows) -> Plot:
    mirrors = list(dict.fromkeys(row["mirror"] for row in rows))

    def draw(figure: Any, theme: Any) -> None:
        panels = figure.subplots(1, len(mirrors), squeeze=False)[0]
        for axes, mirror in zip(panels, mirrors, strict=True):
            for number, kind in enumerate((DECOMPOSED, FITTED)):
                mine = [row for row in rows if row["mirror"] == mirror and row["kind"] == kind]
                label = kind if mirror == mirrors[0] else None
                x, y = [row["triangles"] for row in mine], [row["flip"] for row in mine]
                axes.loglog(x, y, "o-", color=theme.palette[number], label=label)
            axes.set_title(mirror, fontsize=9)
            axes.grid()
        figure.supxlabel("camera triangles")
        figure.supylabel("mean FLIP in the mirror")
        figure.legend(loc="outside right upper")

    return Plot("flip", "Errors of pictures against the number of camera triangles.", "Curves of FLIP by number", draw)


def _table(rows: Rows) -> Table:
    columns = (
        Column("mirror", "Mirror"),
        Column("kind", "Kind"),
        Column("triangles", "Triangles"),
        Column("flip", "FLIP", "", "Mean over the mirror."),
        Column("psnr", "PSNR", "dB"),
        Column("rms", "Ray error", "", "Scene units, two radii away."),
        Column("angle", "Angle", "mrad", "", brief=False),
        Column("seconds", "Fitted in", "s"),
        Column("still_ms", "Still", "ms", "Median.", group="Frame"),
        Column("still_spread", "Spread", "ms", "Interquartile range.", group="Frame", brief=False),
    )
    return Table("quality", "Quality against the number of camera triangles", columns, tuple(rows))


def _gallery(shape: str, scene: Scene, pictures: dict[str, Reflection]) -> Gallery:
    shown = [
        Picture(f"{shape}-{label.replace(' ', '-')}", f"{label} camera triangles", picture.image())
        for label, picture in list(pictures.items())[:4]
    ]
    truth = Picture(f"{shape}-truth", "Mitsuba", Reflection(scene, method="raytrace", shadows=()).image())
    return Gallery(f"The {shape} mirror", (*shown, truth))
