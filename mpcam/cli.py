"""The command line: parse, call, print. Everything that it does can be done from Python too."""

import csv
import os
import re
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter

import mpcam
from mpcam.cli_common import View, check_machine, image_size, load, print_json, say_warnings
from mpcam.cli_fit import fit
from mpcam.cli_mirrors import InMirror, caustics, decompose, surround
from mpcam.errors import InputError, SetupError
from mpcam_kernels.backend import BackendError

EXIT_FAILURE, EXIT_INPUT, EXIT_INTERRUPT = 1, 2, 130

app = App(
    name="mpcam",
    help="Cameras that are not pinholes: render through them, and compare what each method costs and gains.",
    version=mpcam.__version__,
    suppress_keyboard_interrupt=False,  # main answers it
    help_format="plaintext",
    default_parameter=Parameter(negative=(), show_default=False),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line (default: that of this process); returns the exit status.

    0: done. 1: this machine lacks something, see `mpcam doctor`. 2: a mistake in what was given. 130: interrupted.
    """
    form, warnings.formatwarning = warnings.formatwarning, _one_line
    try:
        with say_warnings():
            status = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except (InputError, CycloptsError) as error:
        return _complain(error, EXIT_INPUT)
    except (SetupError, BackendError) as error:
        return _complain(error, EXIT_FAILURE)
    except KeyboardInterrupt:
        return _complain("interrupted", EXIT_INTERRUPT)
    except BrokenPipeError:  # the reader of our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_FAILURE
    finally:
        warnings.formatwarning = form
    return status or 0


@app.command
def compare(
    scene: str | None = None,
    /,
    *,
    demo: bool = False,
    output: Path | None = None,
    methods: str | None = None,
    repeats: int | None = None,
    size: str | None = None,
    view: View | None = None,
    json: bool = False,
    quiet: bool = False,
) -> None:
    """Render a scene by every method that applies; error against run time as a table, a plot and a page.

    Args:
        scene: TOML file, mesh file or name of a built-in scene.
        demo: Compare the built-in scenes of the demo instead.
        output: Folder for the page, the plot, the numbers and the images; out/SCENE if not given.
        methods: Names with commas between; all that apply if not given.
        repeats: Timed rounds.
        size: Image size in pixels, as 640x480 or 512.
        json: Print the numbers as JSON.
        quiet: Print nothing but mistakes.
    """
    from rich.console import Console

    from mpcam.comparison.demo import SIZE, run_demo
    from mpcam.comparison.driver import compare as run
    from mpcam.comparison.progress import bar
    from mpcam.comparison.terminal import WIDTH, print_comparison

    if demo == (scene is not None):
        raise InputError("compare needs one thing to compare: give a scene or --demo")
    if demo and view not in (None, View()):
        raise InputError("--camera, --eye, --target and --up do not go with --demo: give a scene")
    if demo and methods:
        raise InputError("--methods does not go with --demo, which compares all: give a scene")
    console = Console(quiet=quiet or json, width=None if sys.stdout.isatty() else WIDTH)
    check_machine()
    if demo:
        width, height = image_size(size) if size else (SIZE, SIZE)
        if width != height:
            raise InputError(f"--size {size}: the demo is square, give one number")
        rounds: dict[str, Any] = {} if repeats is None else {"repeats": repeats}
        results = run_demo(output or Path("out/demo"), size=width, console=console, **rounds)
        if json:
            print_json([result.to_dict() for result in results])
        return
    loaded = load(str(scene), size, view)
    asked = loaded.compare
    names = asked.methods if methods is None else tuple(name.strip() for name in methods.split(","))
    options: dict[str, Any] = {"shading": asked.shading, "repeats": asked.repeats if repeats is None else repeats}
    settings = {method: entries for method, entries in asked.settings.items() if names is None or method in names}
    folder = output or Path("out") / (re.sub(r"[^\w.-]+", "-", loaded.scene.name).strip(".") or "scene")
    with bar(Console(stderr=True, quiet=quiet), loaded.scene.name) as progress:
        result = run(
            loaded.scene,
            names,
            settings=settings,
            output=folder,
            progress=progress,
            **{name: value for name, value in options.items() if value is not None},
        )
    if json:
        print_json(result.to_dict())
        return
    print_comparison(result, console)
    console.print(f"Report: {folder / 'report.html'}", highlight=False, markup=False, soft_wrap=True)


@app.command
def render(
    scene: str,
    /,
    *,
    output: Path,
    method: str = "invert",
    size: str | None = None,
    view: View | None = None,
    projection: str | None = None,
    shading: str = "light",
    shadows: bool = False,
    shadow_size: int | None = None,
    occlusion: float | None = None,
    thickness: float | None = None,
    level: int | None = None,
    patch: int | None = None,
    resolution: int | None = None,
    bound: str | None = None,
    cull: str | None = None,
    mirror: InMirror | None = None,
    explain: bool = False,
) -> None:
    """Render a scene or mesh to an image file; an EXR also keeps the depth and the camera.

    Where the scene has a mirror, the rest is seen in it: by camera triangles (--method invert), by its vertices with
    straight edges between (vertex), by an environment map (environment), by depth images that rays are met with
    (depth_image) or by rays of the true surface (raytrace). Through a refractor the rest is seen by the last three.

    Args:
        scene: TOML file, mesh file or name of a built-in scene.
        output: Image file: .png, .exr and others.
        method: invert, vertex, two_pass, cubemap, hemicube or raytrace; with a mirror invert, vertex, environment,
            depth_image or raytrace; with a refractor depth_image, environment or raytrace.
        size: Image size in pixels, as 640x480 or 512.
        projection: paraboloid, cosine_sphere, equisolid, equidistant or pinhole, in place of the scene's own camera.
        shading: light, color, normal or texture.
        shadows: Let the scene's lights cast shadows, by a shadow map each.
        shadow_size: Pixels along a side of those; 1024 if not given.
        occlusion: Radius, scene units, within which surfaces keep ambient light from each other, for pinholes; in
            place of the scene's.
        thickness: Scene units by which what is seen reaches back, for occlusion; without end if not given.
        level: Times that --method vertex halves each edge.
        patch: Samples along a side of each triangle, for --method two_pass.
        resolution: Pixels along a face of --method cubemap and hemicube, or along the short sides of camera triangles.
        bound: tight, triangle or quad, for --method invert.
        cull: none, back or front: the side of triangles that --method invert does not show.
        explain: Print which stages run, which are left out, and why.
    """
    from rich.console import Console

    from mpcam.cameras.change import projected
    from mpcam.io.image_formats import format_of
    from mpcam.io.images import write_image
    from mpcam.pictures.render import image_and_depth

    layers = format_of(output).layers
    if projection is not None and view is not None and view.camera is not None:
        raise InputError(f"--projection {projection} does not go with --camera, which has its own: give one of the two")
    if shadow_size is not None and not shadows:
        raise InputError(f"--shadow-size {shadow_size} goes with --shadows: give that too")
    check_machine()
    loaded = load(scene, size, view).scene
    camera = projected(loaded.camera, projection) if projection else loaded.camera
    asked = {"level": level, "patch": patch, "resolution": resolution, "bound": bound, "cull": cull}
    settings: dict[str, Any] = {name: value for name, value in asked.items() if value is not None}
    settings |= (mirror or InMirror()).settings()
    if explain and loaded.mirror is None and loaded.refractor is None:
        from mpcam.pictures.explain import explain as explained

        print(explained(camera, loaded, method, shading=shading, shadows=shadows, **settings))
        explain = False
    options: dict[str, Any] = {"shading": shading, "shadows": shadows, "explain": explain}
    options["occlusion"] = _occlusion(loaded, occlusion, thickness)
    options["shadow_size"] = 1024 if shadow_size is None else shadow_size
    with Console(stderr=True).status(f"rendering {loaded.name}"):
        image, depth = image_and_depth(camera, loaded, method, layers, **options, **settings)
        write_image(output, image, depth=depth, camera=camera if layers else None)


for command in (decompose, fit, caustics, surround):
    app.command(command)


def _occlusion(scene: Any, radius: float | None, thickness: float | None) -> Any:
    """The scene's occlusion, with what the command line changes of it."""
    from dataclasses import replace

    from mpcam.scene.occlusion import Occlusion

    known = scene.occlusion
    if radius is not None:
        known = Occlusion(radius) if known is None else replace(known, radius=radius)
    if thickness is None or known is not None:
        return known if thickness is None else replace(known, thickness=thickness)
    raise InputError(f"--thickness {thickness:g} goes with --occlusion RADIUS: give that too")


def _no_option(_: type, text: str | None) -> None:
    """A hyphen alone is standard input; what begins with two is a mistyped option, and no file."""
    if text is not None and text.startswith("--"):
        raise ValueError(f"{text} is no option: mpcam project --help lists them")


_FILE_OR_STDIN = Parameter(allow_leading_hyphen=True, validator=_no_option)


@app.command
def project(
    scene: Annotated[str, _FILE_OR_STDIN],
    points: Annotated[str | None, _FILE_OR_STDIN] = None,
    /,
    *,
    view: View | None = None,
    size: str | None = None,
    json: bool = False,
) -> None:
    """Project points into the image: a row each with the number of the point, pixel (u right, v down), depth, valid.

    Args:
        scene: FILE or FILE:NAME with a camera, as --camera takes it, or a scene whose camera is taken. With --camera it
            may be left out.
        points: Text file with rows of x, y, z in world coordinates; - for standard input.
        size: Image size in pixels, as 640x480 or 512, for files that do not say it; others are resized.
        json: Print JSON: for each point the list of its images, null where it has none.
    """
    from mpcam.io.cameras import load_camera
    from mpcam.io.points import read_points
    from mpcam.io.scene_view import placed_at

    view, pixels = view or View(), None if size is None else image_size(size)
    if points is None and view.camera is None:
        raise InputError(f"project {scene}: POINTS are missing: give a camera or a scene, and a file of points")
    if points is None or view.camera is None:
        camera = placed_at(load_camera(view.camera or scene, size=pixels), **view.points())
    else:
        camera = load(scene, size, view).scene.camera
    found = camera.project(read_points(scene if points is None else points))
    rows = [
        [(*map(float, pixel), float(depth)) if valid else None for pixel, depth, valid in zip(*images, strict=True)]
        for images in zip(found.pixel, found.depth, found.valid, strict=True)
    ]
    if json:
        keys = ("u", "v", "depth")
        print_json([[None if image is None else dict(zip(keys, image, strict=True)) for image in row] for row in rows])
        return
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["point", "u", "v", "depth", "valid"])
    for number, row in enumerate(rows):
        for image in row:
            writer.writerow([number, *(image or ("", "", "")), int(image is not None)])


@app.command
def stress(
    model: str | None = None, /, *, triangles: int | None = None, points: int | None = None, json: bool = False
) -> int:
    """Run camera models on their stiff and extreme cases, against 50 digits and dense sampling; all without a name.

    Args:
        model: A camera model, such as kannala-brandt; or depth-images.
        triangles: Random triangles whose bounds are checked, per camera; for camera triangles, pairs per kind of rays.
        points: Points and pixels per camera and kind.
        json: Print every row of every camera as JSON.
    """
    from rich.console import Console

    from mpcam.comparison.progress import bar
    from mpcam.stress import names, report, suite

    given = {name: value for name, value in (("triangles", triangles), ("points", points)) if value is not None}
    suites = {name: suite(name) for name in ([model] if model else names())}
    report.check_counts(**given)
    check_machine()
    console, found, good = Console(width=None if sys.stdout.isatty() else 130), [], True
    for name, chosen in suites.items():
        with bar(Console(stderr=True), f"stress {name}") as progress:
            rows = chosen.run(**given, progress=progress)
        wrong = [row for row in rows if not row.good(chosen.LIMIT)]
        good = good and not wrong
        found += report.as_dicts(name, rows)
        if not json:
            report.print_rows(
                name, report.joined(rows, report.case_of if model else report.kind_of), chosen.LIMIT, console
            )
            if wrong:
                report.print_rows(f"{name}: what failed", wrong, chosen.LIMIT, console)
    if json:
        print_json(found)
    return 0 if good else EXIT_FAILURE


@app.command
def experiment(
    name: str | None = None,
    /,
    *,
    output: Path | None = None,
    repeats: int | None = None,
    quick: bool = False,
    json: bool = False,
    quiet: bool = False,
) -> None:
    """Run an experiment of the papers again: tables, plots and a page. Without a name, list the experiments.

    Args:
        name: What to run.
        output: Folder for the page, the plots and the numbers; out/NAME if not given.
        repeats: Timed rounds, in place of the experiment's own number.
        quick: Small scenes and few rounds, to see that it works; the figures mean little.
        json: Print the numbers as JSON.
        quiet: Print nothing but mistakes.
    """
    from rich.console import Console

    from mpcam.comparison.progress import bar
    from mpcam.experiments import run
    from mpcam.experiments.catalog import EXPERIMENTS
    from mpcam.experiments.terminal import WIDTH, print_experiments, print_report

    console = Console(quiet=quiet or json, width=None if sys.stdout.isatty() else WIDTH)
    if name is None:
        if output or repeats or quick:
            raise InputError(f"experiment: say which, one of {', '.join(EXPERIMENTS)}")
        print_experiments(console)
        if json:
            print_json([{"name": known.name, "summary": known.summary} for known in EXPERIMENTS.values()])
        return
    if name not in EXPERIMENTS:
        raise InputError(f"experiment {name!r}: allowed are {', '.join(EXPERIMENTS)}")
    check_machine()
    folder = output or Path("out") / name
    with bar(Console(stderr=True, quiet=quiet), name) as progress:
        report = run(name, repeats=repeats, quick=quick, output=folder, progress=progress)
    if json:
        print_json(report.to_dict())
        return
    print_report(report, console)
    console.print(f"Report: {folder / 'report.html'}", highlight=False, markup=False, soft_wrap=True)


@app.command
def doctor(*, json: bool = False) -> int:
    """Say whether this machine is fit to run mpcam, and what to install if it is not.

    Args:
        json: Print the answers as JSON.
    """
    from rich.console import Console

    from mpcam.doctor import examine, is_fit, report, table

    with Console(stderr=True).status("asking each part in a process of its own"):
        checks = examine()
    if json:
        print_json(report(checks))
    else:
        Console(width=None if sys.stdout.isatty() else 100).print(table(checks))
    return 0 if is_fit(checks) else EXIT_FAILURE


def _one_line(message: Warning | str, *where: Any) -> str:
    """A warning as people read it, without the line of code that it is about."""
    return f"mpcam: {' '.join(str(message).split())}\n"


def _complain(error: object, status: int) -> int:
    print("mpcam:", " ".join(str(error).split()), file=sys.stderr)
    return status
