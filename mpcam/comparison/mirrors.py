"""`mpcam.compare` for scenes with a mirror: camera triangles, vertices, environment maps, depth images, rays; and for
scenes with a refractor, by the last three."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.comparison import metrics, timing
from mpcam.comparison.motion import moving_frame
from mpcam.comparison.plan import Choice, knob
from mpcam.comparison.progress import StepCounter
from mpcam.comparison.rows import Row
from mpcam.decomposition.ray_error import ray_error
from mpcam.effects.mirror_methods import MIRROR_METHODS
from mpcam.effects.reflection import Reflection
from mpcam.effects.refraction import Refraction
from mpcam.effects.refractor_methods import REFRACTOR_METHODS
from mpcam.errors import InputError
from mpcam.scene.scene import Scene

FINE = 416
"""Camera triangles in which the vertices of method "vertex" are looked for."""

OTHER_SECONDS = ({"size": 512, "second": "wyman"}, {"size": 512, "second": "none"})
"""With depth images behind glass: how else rays may come through it."""


def mirror_plan(
    scene: Scene,
    methods: Iterable[str] | None,
    settings: Mapping[str, Sequence[Mapping[str, Any] | float]] | None,
) -> list[Choice]:
    """Methods and settings for a scene with a mirror or a refractor; see `mpcam.compare`.

    Raises InputError for other names.
    """
    what, register = ("mirror", MIRROR_METHODS) if scene.mirror is not None else ("refractor", REFRACTOR_METHODS)
    given = register if methods is None else [methods] if isinstance(methods, str) else methods
    names = list(dict.fromkeys(given))
    settings = dict(settings or {})
    for name in (*names, *settings):
        if name not in register:
            raise InputError(f"Method {name!r} shows no {what}; the methods: {', '.join(register)}.")
    choices = []
    for name in names:
        usual: tuple[Any, ...] = register[name].values or ({},)
        if what == "refractor" and name == "depth_image":
            usual += OTHER_SECONDS
        for entry in settings.get(name, usual):
            if not isinstance(entry, Mapping):
                parameter = knob(name)
                if parameter is None:
                    raise InputError(f"Setting {entry!r} of {name}: this method has no number to set; give {{}}.")
                entry = {parameter: entry}
            choices.append(Choice(name, dict(entry)))
    return choices


def mirror_rows(
    scene: Scene,
    camera: Any,
    plan: list[Choice],
    *,
    shading: str,
    repeats: int,
    warmup: int,
    moving: tuple[np.ndarray, np.ndarray] | None,
    steps: StepCounter,
) -> tuple[list[Row], dict[str, np.ndarray], np.ndarray]:
    """Rows, their images, and the true image: rays of the true surface, traced by Mitsuba.

    A frame is the whole picture here: what is beside the mirror, what is in it, both shaded. Unless the settings say
    otherwise, the atlas has as many pixels as the camera has on the mirror, and vertices are projected by FINE camera
    triangles.
    """
    make: Any = Reflection if scene.mirror is not None else Refraction
    true = make(scene, camera, method="raytrace", shading=shading)
    truth, pixels = true.image(), int(true.mask.sum())
    steps.done("truth")
    pictures: dict[str, Reflection | Refraction] = {}
    rows: dict[str, Row] = {}
    images: dict[str, np.ndarray] = {}
    for choice in plan:
        started = timing.now()
        settings = dict(choice.settings)
        if choice.method == "vertex":
            settings.setdefault("triangles", FINE)
        if choice.method == "camera_triangles" and "triangles" in settings and "resolution" not in settings:
            settings["resolution"] = max(4, round(np.sqrt(2 * pixels / settings["triangles"])))
        picture = make(scene, camera, method=choice.method, shading=shading, **settings)
        image = picture.image()
        first = 1e3 * (timing.now() - started)
        rmse = metrics.image_rmse(image, truth)
        row = Row(
            method=choice.method,
            setting=choice.setting,
            parameter=choice.parameter,
            rmse=rmse,
            psnr=metrics.psnr(rmse),
            flip=float(metrics.flip_map(image, truth).mean()),
            compile_ms=first,
            note=_note(choice.method, picture),
        )
        if isinstance(picture, Reflection) and choice.method == "camera_triangles":
            row = _counted(row, picture, camera)
        pictures[choice.label], rows[choice.label], images[choice.label] = picture, row, image
        steps.done(choice.label)
    still = timing.measure({k: p.frame for k, p in pictures.items()}, repeats, warmup, on_call=steps.done)
    for label, found in still.items():
        rows[label] = replace(rows[label], still_ms=1e3 * found.median, still_spread=1e3 * found.spread)
    if moving is not None:
        calls = {
            label: moving_frame(picture, moving, normals=scene.mesh.normals) for label, picture in pictures.items()
        }
        for label, found in timing.measure(calls, repeats, warmup, on_call=steps.done).items():
            rows[label] = replace(rows[label], moving_ms=1e3 * found.median, moving_spread=1e3 * found.spread)
    return list(rows.values()), images, truth


def frame_times(scene: Scene, camera: Any, decompositions: Sequence[CameraTriangles]) -> list[float]:
    """Seconds that a picture of a scene with a mirror takes by each of several decompositions, medians side by side."""
    calls = {
        str(number): Reflection(scene, camera, method="camera_triangles", cams=cams).frame
        for number, cams in enumerate(decompositions)
    }
    return [found.median for found in timing.measure(calls, repeats=9, warmup=2).values()]


def _note(method: str, picture: Reflection | Refraction) -> str:
    if isinstance(picture, Refraction):
        if picture.inside.second == "trace":
            return "the truth, so its errors against it are 0 by definition" if method == "raytrace" else ""
        glass, lost = int(picture.mask.sum()), int(picture.rays.missing.sum())
        return f"no second interface is found by {100 * lost / max(glass, 1):.2g} % of the rays in the glass"
    if method == "vertex":
        return f"straight edges between vertices; {FINE} camera triangles unless the setting names others"
    return "the truth, so its errors against it are 0 by definition" if method == "raytrace" else ""


def _counted(row: Row, picture: Reflection, camera: Any) -> Row:
    """With the work of its rasterization and the error of its rays."""
    cams = picture.cams
    assert cams is not None
    stats = picture.hits.stats
    return replace(
        row,
        tests=float(stats.tests),
        rendered=float(stats.rendered),
        overdraw=float(stats.overdraw),
        ray_angle=ray_error(cams, picture.mirror.surface, camera).angle_rms,
    )
