"""Single-pole occlusion cameras at their limits: the pole's axis, the limits of the range, and what nearly is none."""

from typing import Any

import numpy as np

from mpcam.cameras.single_pole import SinglePoleOcclusion
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.exact import DIGITS
from mpcam.stress.inputs import BAD_PIXELS, BAD_POINTS
from mpcam.stress.projections import images, rays, rounded
from mpcam.stress.regions import bound_rows
from mpcam.stress.report import EPS, Case, Progress, StressRow, check_counts, run_cases
from mpcam.stress.report import LIMIT as LIMIT
from mpcam.stress.single_pole_truth import (
    bent_ray,
    conditions,
    depth_of,
    distance,
    end_of_middle,
    exact,
    numbers,
    pixel_of,
)

SIZE = 512


def _camera(near: float, far: float, first: float, last: float, **more: Any) -> SinglePoleOcclusion:
    lens = {"fx": 400.0, "fy": 380.0, "cx": 250.0, "cy": 262.0, "pole": (271.0, 240.0)} | more
    return SinglePoleOcclusion(SIZE, SIZE, **lens, near=near, far=far, shift_near=first, shift_far=last)


def cameras() -> dict[str, SinglePoleOcclusion]:
    """Usual ones, and extremes of the shifts, of the range, of the pole and of the focal lengths."""
    return {
        "usual": _camera(1.0, 3.0, 0.0, 60.0),
        "with a hole": _camera(1.0, 3.0, 25.0, 60.0),
        "no shift": _camera(1.0, 3.0, 0.0, 0.0),
        "equal shifts": _camera(1.0, 3.0, 30.0, 30.0),
        "tiny shift": _camera(1.0, 3.0, 0.0, 1e-8),
        "huge shift": _camera(1.0, 3.0, 0.0, 1e8),
        "huge shifts": _camera(1.0, 3.0, 1e7, 1e8),
        "short range": _camera(1.0, 1.0 + 1e-5, 0.0, 60.0),
        "hardly a range": _camera(1.0, 1.0 + 1e-12, 10.0, 60.0),
        "long range": _camera(1e-6, 1e6, 0.0, 60.0),
        "pole at the center": _camera(1.0, 3.0, 5.0, 60.0, pole=(250.0, 262.0)),
        "pole far away": _camera(1.0, 3.0, 5.0, 60.0, pole=(1e6, -3e5)),
        "narrow": _camera(1.0, 3.0, 0.0, 60.0, fx=1e6, fy=1.1e6),
        "wide": _camera(1.0, 3.0, 0.0, 60.0, fx=1.0, fy=7.0),
        "scale 1e-8": _camera(1e-8, 3e-8, 0.0, 60.0),
        "scale 1e8": _camera(1e8, 3e8, 0.0, 60.0),
    }


def points(camera: SinglePoleOcclusion, count: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Points (count, 3) in the camera frame by kind."""
    rng = np.random.default_rng(seed)
    near, far, fx, fy = camera.near, camera.far, camera.fx, camera.fy
    size = np.array([camera.width, camera.height])

    def seen(z: np.ndarray, pixel: np.ndarray | None = None) -> np.ndarray:
        """Points at depths z (count,), of random pixels of the pinhole or given ones (count, 2)."""
        pixel = rng.uniform(-0.5, 1.5, (count, 2)) * size if pixel is None else pixel
        return np.stack([(pixel[:, 0] - camera.cx) * z / fx, (pixel[:, 1] - camera.cy) * z / fy, z], -1)

    everywhere = near * (far / near) ** rng.uniform(-1.0, 2.0, count)
    inside = near + (far - near) * rng.uniform(0, 1, count)
    limit = rng.choice([near, far], count)
    tiny = 10.0 ** rng.uniform(-14, -1, (count, 1)) * rng.choice([-1.0, 1.0], (count, 1))
    angle = rng.uniform(0, 2 * np.pi, count)
    beside = np.stack([np.cos(angle), np.sin(angle)], -1)
    pole = np.array(camera.pole)
    return {
        "everywhere": seen(everywhere),
        "in the range": seen(inside),
        "at its limits": seen(limit),
        "next to its limits": seen(limit * (1 + tiny[:, 0])),
        "on the pole's axis": seen(everywhere, np.broadcast_to(pole, (count, 2))),
        "near the pole's axis": seen(everywhere, pole + np.abs(tiny) * beside * size),
        "at right angles": seen(everywhere, pole + rng.choice([[1, 0], [0, 1], [-1, 0], [0, -1]], count) * size),
        "far away": seen(far * 10.0 ** rng.uniform(0, 8, count)),
        "close to the eye": seen(near * 10.0 ** rng.uniform(-8, 0, count)),
        "behind": seen(-everywhere),
        "in the camera plane": seen(everywhere) * [1, 1, 0],
        "at the center": np.zeros((1, 3)),
        "out of range": np.stack([*rng.normal(size=(2, count)), 10.0 ** rng.uniform(-300, -30, count)], -1),
    }


def pixels(camera: SinglePoleOcclusion, count: int, seed: int = 2) -> dict[str, np.ndarray]:
    """Pixels (count, 2) by kind."""
    rng = np.random.default_rng(seed)
    size, pole = np.array([camera.width, camera.height]), np.array(camera.pole)
    tiny = 10.0 ** rng.uniform(-14, -1, (count, 1)) * rng.choice([-1.0, 1.0], (count, 1))
    angle = rng.uniform(0, 2 * np.pi, count)
    around = np.stack([np.cos(angle), np.sin(angle)], -1)
    low, high = camera.shift_near, camera.shift_far
    return {
        "everywhere": rng.uniform(0, 1, (count, 2)) * size,
        "that end": pole + (low + (high - low) * rng.uniform(0, 1, (count, 1))) * around,
        "that go on": pole + (high + rng.uniform(0, 1, (count, 1)) * size) * around,
        "near the shifts": pole + rng.choice([low, high], (count, 1)) * (1 + tiny) * around,
        "near the pole": pole + np.abs(tiny) * around,
        "at the pole": pole[None],
        "far outside": pole + 10.0 ** rng.uniform(0, 8, (count, 1)) * around * size,
    }


def image_rows(name: str, camera: SinglePoleOcclusion, count: int) -> list[StressRow]:
    """Images of points against the definition: pixel and length along the bent ray."""
    rows = [
        judge_images(name, f"images, {kind}", precision, camera, given, images(camera, given, precision))
        for kind, precision, given in rounded(points(camera, count))
    ]
    for precision in EPS:
        pixel, depth, valid = images(camera, BAD_POINTS, precision)
        invented = int(valid.sum() + (~np.isfinite(pixel)).sum() + (~np.isfinite(depth)).sum())
        rows.append(StressRow(name, "images, not finite", precision, len(valid), float("nan"), 0, invented))
    return rows


def judge_images(
    name: str, case: str, precision: str, camera: SinglePoleOcclusion, given: np.ndarray, found: Any
) -> StressRow:
    """Valid in front of the camera plane, unless numbers are too large or too small for the precision."""
    import mpmath

    eps, (worst, missed, invented) = EPS[precision], (0.0, 0, 0)
    limits = np.finfo(precision)

    def image(values: list[Any]) -> list[list[Any]]:
        x, y, z, *rest = values
        return [list(pixel_of(x, y, z, rest)), [depth_of(x, y, z, rest)]]

    with mpmath.workdps(DIGITS):
        for point, pixel, depth, claimed in zip(given, *found, strict=True):
            values = exact([*point, *numbers(camera)])
            if not values[2] > 0:
                invented += int(claimed)
                continue
            truth, length = image(values)
            size = max(*map(abs, truth), length[0])
            if size > limits.max / 4 or values[2] < 4 * limits.tiny:
                invented += int(claimed and size > 4 * limits.max)
            elif not claimed:
                missed += 1
            else:
                allowed = conditions(image, values, mpmath.mpf(eps) / 2)
                for numbers_, exact_, room in (([*pixel], truth, allowed[0]), ([depth], length, allowed[1])):
                    worst = max(worst, _error(numbers_, exact_, eps * room))
    return StressRow(name, case, precision, len(given), worst, missed, invented)


def ray_rows(name: str, camera: SinglePoleOcclusion, count: int) -> list[StressRow]:
    """Pieces of the rays of pixels against the definition, and the middle one as `local_ray` produces it."""
    rows = []
    for kind, precision, given in rounded(pixels(camera, count)):
        found = ray_pieces(camera, given, precision), rays(camera, given, precision)
        rows.append(judge_rays(name, f"rays, {kind}", precision, camera, given, *found))
    for precision in EPS:
        found = [*ray_pieces(camera, BAD_PIXELS, precision), rays(camera, BAD_PIXELS, precision)]
        invented = sum(int(piece[-1].sum()) + sum(int((~np.isfinite(x)).sum()) for x in piece[:-1]) for piece in found)
        rows.append(StressRow(name, "rays, not finite", precision, len(BAD_PIXELS), float("nan"), 0, invented))
    return rows


def ray_pieces(camera: SinglePoleOcclusion, given: np.ndarray, precision: str) -> list[tuple[np.ndarray, ...]]:
    """Origin (N, 3), direction (N, 3), start, end and valid (N,) of each of the three pieces, as float64."""
    if precision == "float64":
        with np.errstate(all="ignore"):
            pieces = camera.local_ray_pieces(given.T)
        return [(p.origin.T, p.direction.T, p.start, p.end, p.valid) for p in pieces]
    from mpcam.backend import opaque_zero, types
    from mpcam.rendering.device_camera import on_device

    lens: Any = on_device(camera)
    pieces = lens.local_ray_pieces(types().Array2f(np.ascontiguousarray(given.T, np.float32)) + opaque_zero())
    found = []
    for piece in pieces:
        parts = [np.asarray(part.numpy()) for part in piece]
        found.append(tuple(np.broadcast_to(part.T, (len(given), *part.shape[:-1])) for part in parts))
    return found


def judge_rays(
    name: str,
    case: str,
    precision: str,
    camera: SinglePoleOcclusion,
    given: np.ndarray,
    pieces: list[tuple[np.ndarray, ...]],
    middle: tuple[np.ndarray, ...],
) -> StressRow:
    """Each piece is there where it should be, starts and ends where it should, and runs where it should."""
    import mpmath

    eps, (worst, missed, invented) = EPS[precision], (0.0, 0, 0)
    one, *rest = exact([1.0, *numbers(camera)])
    names = list(bent_ray(one, one, rest))

    def ray(values: list[Any]) -> list[list[Any]]:
        return list(bent_ray(values[0], values[1], values[2:]).values())

    def reach(values: list[Any]) -> list[list[Any]]:
        r = distance(values[0], values[1], values[2:])
        return [[r - values[10]], [r - values[11]], [end_of_middle(values[0], values[1], values[2:]) - values[8]]]

    with mpmath.workdps(DIGITS):
        step = mpmath.mpf(eps) / 2
        for number, pixel in enumerate(given):
            values = exact([*pixel, *numbers(camera)])
            ends = [part[0] for part in reach(values)]
            doubts = [LIMIT * eps * room for room in conditions(reach, values, step)]
            there = [ends[0] >= 0, ends[0] >= 0 and (ends[2] > 0 or values[10] == values[11]), ends[1] >= 0]
            margins = [abs(ends[0]) - doubts[0], min(abs(ends[0]) - doubts[0], abs(ends[2]) - doubts[2])]
            margins += [abs(ends[1]) - doubts[1]]
            claims = [bool(piece[-1][number]) for piece in pieces]
            for claimed, true, margin in zip(claims, there, margins, strict=True):
                missed += int(true and not claimed and margin > 0)
                invented += int(claimed and not true and margin > 0)
            invented += int(bool(middle[-1][number]) != claims[1])
            truth = dict(zip(names, ray(values), strict=True))
            room = dict(zip(names, conditions(ray, values, step), strict=True))
            room["produced"] += truth["start 1"][0]  # its points from there on are what counts
            for key, found in _told(pieces, middle, claims, number):
                worst = max(worst, _error(found, truth[key], eps * room[key]))
            invented += int(claims[2] and not np.isposinf(pieces[2][3][number]))
            invented += int(claims[0] and bool(np.any(pieces[0][0][number]) or pieces[0][2][number]))
    return StressRow(name, case, precision, len(given), worst, missed, invented)


def _told(
    pieces: list[tuple[np.ndarray, ...]], middle: tuple[np.ndarray, ...], claims: list[bool], number: int
) -> list[tuple[str, list[float]]]:
    """What the pieces of one pixel say, and the names that `bent_ray` has for it."""
    found: list[tuple[str, list[float]]] = []
    for k, (origin, direction, start, end, _) in enumerate(pieces):
        if not claims[k]:
            continue
        found.append((f"direction {k}", [*direction[number]]))
        if k > 0:
            found += [(f"origin {k}", [*origin[number]]), (("start 1", "end 1")[k - 1], [start[number]])]
        if k < 2:
            found.append((("start 1", "end 1")[k], [end[number]]))
        if k == 1:
            found.append(("produced", [*middle[0][number]]))
    return found


def _error(found: list[Any], truth: list[Any], unit: Any) -> float:
    """Largest difference in units of what rounding allows; infinite for what is no number."""
    import mpmath

    if not np.isfinite(np.asarray(found, np.float64)).all():
        return float("inf")
    off = max(abs(mpmath.mpf(float(a)) - b) for a, b in zip(found, truth, strict=True))
    return float(off / unit) if unit else (0.0 if off == 0 else float("inf"))


def narrow_view(distance: float, width: float) -> SinglePoleOcclusion:
    """For distant eyes: see `distant`."""
    focal, middle = focal_length(distance, width), 0.5 * VIEW
    return SinglePoleOcclusion(
        VIEW,
        VIEW,
        focal,
        focal,
        middle,
        middle,
        pole=(0.4 * VIEW, 0.55 * VIEW),
        near=distance - 1.5,
        far=distance + 1.5,
        shift_far=0.1 * VIEW,
        camera_from_world=pose(distance),
    )


BOUNDED = ("usual", "with a hole", "no shift", "short range", "pole at the center", "pole far away", "wide")
"""Cameras whose boxes are tried: those of which something is in the image."""


def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
    """All cases: a quarter of `points` per kind of point and pixel, each with some 25 evaluations at 80 digits;
    `triangles` per camera. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    count = -(-points // 4)

    def of(name: str, camera: SinglePoleOcclusion) -> Any:
        return lambda: [*image_rows(name, camera, count), *ray_rows(name, camera, count)]

    cases: list[Case] = [(name, of(name, camera)) for name, camera in cameras().items()]
    for name in BOUNDED:
        camera = cameras()[name]
        cases.append((f"{name}, bounds", lambda name=name, camera=camera: bound_rows(name, camera, triangles)))
    return run_cases([*cases, *distant_cases(narrow_view)], progress)
