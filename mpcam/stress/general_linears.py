"""General linear cameras in one image: every piece against its own definition, inside of its part and outside."""

from typing import Any

import numpy as np

from mpcam.cameras.general_linear import GeneralLinear
from mpcam.cameras.general_linears import GeneralLinears
from mpcam.stress import general_linear as single
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.general_linear import LIMIT as LIMIT
from mpcam.stress.general_linear_truth import Truth
from mpcam.stress.projections import rounded
from mpcam.stress.report import Case, Progress, StressRow, check_counts, run_cases

SIZE = 96
_BORDER = 0.5  # pixels from the border of a piece that decide nothing
Rows = list[StressRow]


def cameras() -> dict[str, GeneralLinears]:
    """Each kind, slits in the scene and near-ties beside each other; and a grid whose halves share generators."""
    known = [camera for camera in single.cameras().values() if np.abs(np.asarray(camera.rays)).max() < 1e4]
    several = {
        f"beside each other, {start}": GeneralLinears.beside(known[start : start + 4])
        for start in range(0, len(known), 4)
    }
    grid: Any = GeneralLinears.examples(SIZE, SIZE)["grid"]
    return several | {"grid": grid}


def piece_images(camera: GeneralLinears, number: int, points: np.ndarray, precision: str) -> tuple[np.ndarray, ...]:
    """Images of points (N, 3) in one piece: pixel (N, 2), depth (N,), valid (N,), as float64."""
    if precision == "float64":
        with np.errstate(all="ignore"):
            pixel, depth, valid = camera.local_project(points.T)[number]
        return np.array(pixel.T), np.array(depth), np.array(valid)
    from mpcam.backend import types

    given = types().Array3f(np.ascontiguousarray(points.T, np.float32))
    (x, y), depth, valid = camera.local_project(given)[number]
    pixel = np.stack([np.asarray(part.numpy(), np.float64) for part in (x, y)], -1)
    return pixel, np.asarray(depth.numpy(), np.float64), np.asarray(valid.numpy())


def piece_rows(name: str, camera: GeneralLinears, count: int) -> Rows:
    """Points of all kinds in every piece: those that it shows, and those that belong to others."""
    rows = []
    for number in range(camera.count):
        piece = camera.piece(number)
        truth, what = Truth(piece), f"{name}, piece {number}"
        for kind, precision, given in rounded(single.inputs(piece, count, seed=number)):
            place, _, there = piece_images(GeneralLinears.beside([piece]), 0, given, "float64")
            ends = np.stack([place + shift for shift in _BORDER * np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])])
            owners = np.stack([camera.locate(*end.T) for end in ends])
            mine = there & (owners == number).all(axis=0)
            others = there & (owners != number).all(axis=0)
            found = piece_images(camera, number, given, precision)
            if mine.any():
                inside = [part[mine] for part in found]
                rows.append(single.judge(what, f"images, {kind}", precision, truth, given[mine], inside))
            shown = int((found[2] & others).sum())
            rows.append(StressRow(what, "images of other pieces", precision, int(others.sum()), float("nan"), 0, shown))
    return rows


def narrow_view(distance: float, width: float) -> GeneralLinears:
    """For distant eyes, as two halves: see `distant`."""
    half, focal = VIEW // 2, focal_length(distance, width)
    first = GeneralLinear.pinhole(half, VIEW, focal, cx=0.5 * VIEW)
    second = GeneralLinear.pinhole(VIEW - half, VIEW, focal, cx=0.5 * VIEW - half)
    return GeneralLinears.beside([first, second], pose(distance))


def run(triangles: int = 30_000, points: int = 20, progress: Progress | None = None) -> Rows:
    """All cases: `points` per kind of point and piece. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases: list[Case] = [
        (name, lambda name=name, camera=camera: piece_rows(name, camera, points)) for name, camera in cameras().items()
    ]
    return run_cases([*cases, *distant_cases(narrow_view)], progress)
