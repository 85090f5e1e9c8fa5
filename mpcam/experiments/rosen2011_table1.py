"""Rosen et al. 2011, Table 1: the cost of a reflection by a single-pole image, by output, image and steps."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mpcam.comparison import timing
from mpcam.comparison.metrics import image_rmse
from mpcam.comparison.numbers import format_number
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.depth_images.depth_image import DepthImage
from mpcam.depth_images.intersections import Intersections
from mpcam.effects.by_depth_image import ByDepthImages
from mpcam.effects.reflection import Reflection
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.rosen2011_paper import CARD, COARSE_RATES, FRAME_RATES, IMAGE_RATES, PAPER
from mpcam.experiments.rosen2011_scenes import reflection_scene

ROUNDS = 9
OUTPUTS = tuple(FRAME_RATES)
FINES = (1.0, 0.5, 0.25)
IMAGE, COARSE = 512, 6
Rows = list[dict[str, Any]]


class _Case(NamedTuple):
    """One reflection: pixels of the output, fine step, pixels along a side of the depth image, coarse step."""

    output: tuple[int, int]
    fine: float
    image: int
    coarse: int

    @property
    def label(self) -> str:
        return f"{_size(self.output)}, fine {self.fine:g}, image {self.image}, coarse {self.coarse}"


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    triangles, outputs, image = (2_000, ((80, 60),), 64) if quick else (20_000, OUTPUTS, IMAGE)
    fines = FINES[::2] if quick else FINES
    images = (image // 2, image) if quick else tuple(IMAGE_RATES)
    count = rounds(repeats, quick, ROUNDS)
    grid = [_Case(output, fine, image, COARSE) for output in outputs for fine in fines]
    sizes = [_Case(outputs[0], 1.0, side, COARSE) for side in images]
    strides = [_Case(outputs[0], 1.0, image, step) for step in COARSE_RATES]
    cases = list(dict.fromkeys([*grid, *sizes, *strides]))
    steps = StepCounter(progress, len(cases) + len(outputs) + (len(cases) + len(outputs)) * (1 + WARMUP + count) + 1)

    def picture(output: tuple[int, int], **settings: Any) -> Reflection:
        scene = reflection_scene(triangles, "teapot", width=output[0], height=output[1])
        made = Reflection(scene, **settings)
        steps.done(f"{_size(output)}: prepared")
        return made

    traced = {output: picture(output, method="raytrace") for output in outputs}
    made = {
        case: picture(case.output, method="depth_image", size=case.image, fine=case.fine, coarse=case.coarse)
        for case in cases
    }
    calls: dict[str, Callable[[], object]] = {_size(output): one.frame for output, one in traced.items()}
    calls |= {case.label: one.frame for case, one in made.items()}
    truths = {output: one.image() for output, one in traced.items()}
    errors = {case: image_rmse(one.image(), truths[case.output]) for case, one in made.items()}
    times = timing.measure(calls, count, WARMUP, on_call=steps.done)

    def row(case: _Case, paper: float | None, of: float | None) -> dict[str, Any]:
        time, truth = times[case.label], times[_size(case.output)]
        found = _found(made[case])
        return {
            "output": _size(case.output),
            "fine": case.fine,
            "image": case.image,
            "coarse": case.coarse,
            "ms": 1e3 * time.median,
            "spread": 1e3 * time.spread,
            "ratio": time.median / truth.median,
            "steps": float(found.steps.mean()),
            "rmse": errors[case],
            "paper_fps": paper,
            "paper_slower": of / paper if of and paper else None,
        }

    whole = [
        row(case, *_of_paper(FRAME_RATES.get(case.output, {}), case.fine, FRAME_RATES[OUTPUTS[0]])) for case in grid
    ]
    by_image = [row(case, *_of_paper(IMAGE_RATES, case.image, IMAGE_RATES)) for case in sizes]
    by_coarse = [row(case, *_of_paper(COARSE_RATES, case.coarse, COARSE_RATES)) for case in strides]
    for rows in (whole, by_image, by_coarse):
        for one in rows:
            one["slower"] = one["ms"] / rows[0]["ms"]
    memory = [memory_row(_thing_of(made[case]), made[case]) for case in sizes]
    shown = [
        Picture("picture", "By a depth image", made[grid[-1]].image()),
        Picture("truth", "Mitsuba", truths[outputs[-1]]),
    ]
    report = Report(
        name="rosen2011-table1",
        title="What a reflection by a depth image costs",
        subject=f"Rosen et al. 2011, Table 1, section 7.2 · a teapot of {triangles:,} triangles before a bumpy mirror",
        reading=_reading(whole, by_image, by_coarse, memory),
        parts=(
            _table("output", "Output and fine step", whole, f"Coarse step {COARSE}, image {image} × {image}."),
            _plot(whole),
            _table("image", "Size of the depth image", by_image, "Fine step 1."),
            _table("coarse", "Coarse step", by_coarse, "Fine step 1."),
            _memory_table(memory),
            Gallery("Picture", tuple(shown)),
        ),
        scene={
            "paper": PAPER,
            "scene": "that of rosen2011-fig1, standing still; its floor is a depth image of its own",
        },
        machine=machine(),
        measured=measured(
            count,
            frame="the whole picture: first hits beside the mirror, the mirror's rays over both depth images, colors; "
            "rays of the mirror are kept, since mirror and eye stand still, and so is Mitsuba's tree",
            ratio="over the same picture with the same rays traced by Mitsuba",
            slower="over the first row of the table, and in the paper over the same row",
            steps="of the teapot's depth image, mean over the mirror's pixels",
            error="root mean square over the whole picture, against Mitsuba's",
            memory="bytes of the device arrays: depth and color of each pixel, the patches and ranges of depth that "
            "rays are followed over, and for each ray what goes in and comes out; all else stays in registers",
            paper=CARD,
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _of_paper(rates: Any, key: Any, first: dict[Any, float]) -> tuple[float | None, float]:
    """The paper's frames a second, and those of its first row."""
    return rates.get(key), next(iter(first.values()))


def _part(picture: Reflection) -> ByDepthImages:
    assert isinstance(picture.part, ByDepthImages)
    return picture.part


def _thing_of(picture: Reflection) -> DepthImage:
    return next(shown for shown in _part(picture).shown if shown.view.meshes == (0,)).images[0]


def _found(picture: Reflection) -> Intersections:
    part = _part(picture)
    return _thing_of(picture).intersect(part.posed, coarse=part.choice.coarse, fine=part.choice.fine)


def memory_row(image: DepthImage, picture: Reflection) -> dict[str, Any]:
    """Bytes of a depth image and of rays that are followed over it."""
    part, surface = _part(picture), image.any_surface()
    pixels = image.camera.width * image.camera.height
    found = _found(picture)
    outcome = (found.device_hit, found.device_distance, *found.device_pixel, found.device_number, found.device_front)
    rays = [part.posed.ray.origin, part.posed.ray.direction, part.posed.ray.valid]
    count = len(np.asarray(part.ray.valid))
    in_image = bytes_of(image.device_depth) + bytes_of(image.device_color)
    in_surface = bytes_of(surface.patches) + bytes_of(surface.ranges)
    return {
        "image": image.camera.width,
        "image_mib": in_image / 2**20,
        "surface_mib": in_surface / 2**20,
        "bytes_per_pixel": (in_image + in_surface) / pixels,
        "rays": count,
        "rays_mib": sum(map(bytes_of, (*rays, *outcome, found.device_steps))) / 2**20,
        "bytes_per_ray": sum(map(bytes_of, (*rays, *outcome, found.device_steps))) / count,
    }


def bytes_of(array: Any) -> int:
    """Bytes of a device array of numbers or of small vectors."""
    import drjit as dr

    if dr.depth_v(array) > 1:
        return sum(bytes_of(part) for part in array)
    return dr.width(array) * dr.itemsize_v(array)


def _size(output: tuple[int, int]) -> str:
    return f"{output[0]} × {output[1]}"


def _table(name: str, title: str, rows: Rows, note: str) -> Table:
    columns = (
        Column("output", "Output", "px"),
        Column("fine", "Fine step", "px"),
        Column("image", "Image", "px", "Along a side.", brief=name == "image"),
        Column("coarse", "Coarse step", "px", brief=name == "coarse"),
        Column("ms", "Frame", "ms", "Median."),
        Column("spread", "Spread", "ms", "How far the middle half of the frames lies apart.", brief=False),
        Column("ratio", "Ratio", "", "Over Mitsuba's frame."),
        Column("slower", "Slower", "", "Over the first row."),
        Column("paper_slower", "Slower", "", "The paper's, over the same row.", paper=True),
        Column("paper_fps", "Rate", "fps", "The paper's.", paper=True),
        Column("steps", "Steps", "", "Of a ray, mean."),
        Column("rmse", "Error", "", "To Mitsuba's picture."),
    )
    return Table(name, title, columns, tuple(rows), note)


def _memory_table(rows: Rows) -> Table:
    columns = (
        Column("image", "Image", "px", "Along a side."),
        Column("image_mib", "Image", "MiB", "Depth and color."),
        Column("surface_mib", "Surface", "MiB", "Patches and ranges of depth."),
        Column("bytes_per_pixel", "Each pixel", "bytes"),
        Column("rays", "Rays"),
        Column("rays_mib", "Rays", "MiB", "What goes in and comes out."),
        Column("bytes_per_ray", "Each ray", "bytes"),
    )
    return Table("memory", "Memory", columns, tuple(rows))


def _plot(rows: Rows) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        for number, output in enumerate(dict.fromkeys(row["output"] for row in rows)):
            mine = [row for row in rows if row["output"] == output]
            x, color = [f"{row['fine']:g}" for row in mine], theme.palette[number]
            axes.errorbar(
                x,
                [row["ms"] for row in mine],
                [0.5 * row["spread"] for row in mine],
                None,
                "o-",
                color=color,
                label=output,
            )
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("fine step, pixels of the depth image")
        axes.set_ylabel("ms a frame")
        axes.grid()
        figure.legend(loc="outside right upper")

    return Plot("time", "Time of a frame by fine step and output, with its spread.", "Lines of time by fine step", draw)


def _reading(whole: Rows, by_image: Rows, by_coarse: Rows, memory: Rows) -> str:
    """The finding, from the figures themselves."""
    first, last = whole[0], whole[-1]
    finest = [row for row in whole if row["output"] == first["output"]][-1]
    large, small = by_image[-1], by_image[0]
    fastest = min(by_coarse, key=lambda row: row["ms"])

    def text(value: float, digits: int = 2) -> str:
        return format_number(value, digits)

    return (
        f"At {first['output']} a frame takes {text(first['ms'], 3)} ms, {text(first['ratio'])} of Mitsuba's. Fine "
        f"steps of {finest['fine']:g} pixels in place of 1 cost {text(finest['slower'], 3)} times as much (the paper: "
        f"{_or_none(finest['paper_slower'])}), since they are taken near the surface alone; {last['output']} with the "
        f"same fine steps {text(last['slower'], 3)} times (the paper: {_or_none(last['paper_slower'])}). A depth image "
        f"of {large['image']} pixels in place of {small['image']}: {text(large['slower'], 3)} times (the paper: "
        f"{_or_none(large['paper_slower'])}); its error is {text(large['rmse'])} in place of {text(small['rmse'])}. "
        f"Coarse steps of {fastest['coarse']} pixels are the fastest here; larger ones pass more at once and stop more "
        f"often. A depth image takes {text(memory[-1]['bytes_per_pixel'], 3)} bytes a pixel with the surface that rays "
        f"are followed over, a ray {text(memory[-1]['bytes_per_ray'], 3)} bytes."
    )


def _or_none(value: float | None) -> str:
    return "no figure" if value is None else format_number(value, 3)
