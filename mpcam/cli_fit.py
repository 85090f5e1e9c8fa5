"""The command that fits camera triangles to a scene's mirror, and says what it left out."""

import math
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from mpcam.cli_common import angle, check_machine, load, print_json
from mpcam.errors import InputError


def fit(
    scene: str,
    /,
    *,
    output: Path,
    triangles: int | None = None,
    max_angle: str | None = None,
    budget_ms: float | None = None,
    eye: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    resolution: int | None = None,
    seed: int = 0,
    json: bool = False,
    quiet: bool = False,
) -> None:
    """Find the camera triangles that stand for a scene's mirror at the least cost, fit them, and write them.

    The file goes into a scene as camera_triangles = "FILE" in its [mirror]. Give one of --triangles, --max-angle and
    --budget-ms; without any, as many triangles as the scene's mirror has.

    Args:
        scene: TOML file with a mirror, or a mesh file that is the mirror.
        output: .npz file for the camera triangles, their errors and how the fit went.
        triangles: The smallest error with so many at most.
        max_angle: As few as leave rays off by at most so much (root mean square): 1mrad, 0.05deg or, in radians, 0.001.
        budget_ms: The smallest error with which a picture of the scene takes at most so many milliseconds here.
        eye: Point x,y,z that looks into the mirror; the scene's camera if not given.
        resolution: Pixels along the short sides of each; if not given, as many as the camera has there.
        seed: Of the places of the rays that are fitted.
        json: Print what was found and left out as JSON.
        quiet: Print nothing but mistakes.
    """
    from rich.console import Console

    from mpcam.comparison.mirrors import frame_times
    from mpcam.fitting.choose import choose_decomposition
    from mpcam.fitting.fit import fit as fitted
    from mpcam.io.fits import write_fit
    from mpcam.io.points import read_point
    from mpcam.scene.mirror import Mirror

    if output.suffix.lower() != ".npz":
        raise InputError(f"--output {output}: fits are written as .npz: give such a name")
    if sum(value is not None for value in (triangles, max_angle, budget_ms)) > 1:
        raise InputError("--triangles, --max-angle and --budget-ms say what matters most: give one of them")
    check_machine()
    loaded = load(scene, None).scene
    mirror = loaded.mirror or Mirror(loaded.mesh)
    seen: Any = loaded.camera if eye is None else read_point(eye, "--eye")
    pictured = loaded.mirror is not None and eye is None and loaded.mesh.triangle_count > 0
    if budget_ms is not None and not pictured:
        raise InputError("--budget-ms needs a picture to take the time of: give a scene with a [mirror], and no --eye")
    if triangles is None and max_angle is None and budget_ms is None:
        triangles = mirror.triangles
    console = Console(stderr=True, quiet=quiet)
    with console.status("looking at the mirror") as status:
        found = choose_decomposition(
            mirror.surface,
            seen,
            triangles=triangles,
            max_angle=None if max_angle is None else angle(max_angle, "--max-angle"),
            frame_time=None if budget_ms is None else 1e-3 * budget_ms,
            time_of=(lambda many: frame_times(loaded, loaded.camera, many)) if pictured else None,
            index=mirror.index,
            resolution=resolution,
            seed=seed,
            progress=status.update,
        )
        best = found.best.fit
        if best is None:
            best = fitted(found.camera, reflector=mirror.surface, eye=seen, iterations=0, seed=seed)
        write_fit(output, best)
    if json:
        print_json(_as_dict(found, str(output)))
    elif not quiet:
        _print(found, output)


def _as_dict(found: Any, output: str) -> dict[str, Any]:
    single = found.single
    return {
        "output": output,
        "best": _row(found.best),
        "left_out": [_row(one) for one in found.others],
        "single_camera": None
        if single is None
        else {"kind": single.kind, "margin": single.margin, "angle": found.single_angle},
    }


def _row(one: Any) -> dict[str, Any]:
    return {
        "kind": one.kind,
        "triangles": one.camera.count,
        "rays": one.rays,
        "angle": one.angle,
        "frame_ms": None if one.frame is None else 1e3 * one.frame,
        "seconds": one.seconds,
        "status": None if one.fit is None else one.fit.status,
    }


def _print(found: Any, output: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    from mpcam.comparison.numbers import format_number

    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("", "triangles", "rays", "off by", "frame", "made in"):
        table.add_column(name, justify="left" if not name else "right")
    for number, one in enumerate((found.best, *found.others)):
        frame = "-" if one.frame is None else f"{format_number(1e3 * one.frame)} ms"
        name = f"{one.kind}" if number else f"[bold]{one.kind}, taken[/bold]"
        angle_ = f"{format_number(1e3 * one.angle)} mrad"
        table.add_row(name, f"{one.camera.count:,}", f"{one.rays:,}", angle_, frame, f"{format_number(one.seconds)} s")
    console = Console()
    console.print(table)
    single = found.single
    if single is None:
        console.print("No single camera has rays like these: they go too many ways.", highlight=False)
    elif math.isfinite(found.single_angle):
        console.print(
            f"A single general linear camera ({single.kind}) would be off by "
            f"{format_number(1e3 * found.single_angle)} mrad.",
            highlight=False,
        )
    console.print(f"Camera triangles: {output}", highlight=False, markup=False, soft_wrap=True)
