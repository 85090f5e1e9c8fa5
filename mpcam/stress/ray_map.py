"""Ray maps at their limits: all images of points against brute force, in both precisions."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.ray_map import RayMap
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.ray_map_truth import Truth, truths
from mpcam.stress.report import EPS, Case, Progress, StressRow, check_counts, run_cases
from mpcam.stress.report import LIMIT as LIMIT

IMAGES = 12
_MAPS = 8
"""Maps of each kind."""


def run(triangles: int = 20_000, points: int = 100, progress: Progress | None = None) -> list[StressRow]:
    """All cases, `points` of each kind. Raises InputError below 1. triangles: not used, since maps bound none."""
    check_counts(triangles=triangles, points=points)

    def of(kind: str) -> Any:
        return lambda: projection_rows(kind, points)

    cases: list[Case] = [(kind, of(kind)) for kind in KINDS]
    cases += [
        ("borders of cells", lambda: [border_row(points)]),
        ("rays", lambda: [ray_row(points)]),
        ("what has no image", lone_rows),
    ]
    return run_cases([*cases, *distant_cases(narrow_view)], progress)


def narrow_view(distance: float, width: float) -> RayMap:
    """For distant eyes: see `distant`."""
    return RayMap.of(Pinhole(VIEW, VIEW, focal_length(distance, width), camera_from_world=pose(distance)))


def _grid(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A small map: origins on a grid of step 1, directions along +z."""
    width, height = rng.integers(2, 5, 2)
    y, x = np.mgrid[0:height, 0:width] * 1.0
    return np.stack([x, y, 0 * x], -1), np.stack([0 * x, 0 * x, 1 + 0 * x], -1)


def _scattered(origin: float, direction: float) -> Callable[[np.random.Generator], Any]:
    """Origins and directions off the grid by so much."""

    def rays(rng: np.random.Generator) -> Any:
        o, d = _grid(rng)
        return o + origin * rng.normal(size=o.shape), d + direction * rng.normal(size=o.shape)

    return rays


def _random(rng: np.random.Generator) -> Any:
    o, _ = _grid(rng)
    return rng.normal(size=o.shape), rng.normal(size=o.shape)


def _twisted(rng: np.random.Generator) -> Any:
    o, d = _scattered(0.05, 0.02)(rng)
    x, y = o[..., 0], o[..., 1]
    return o, d + rng.uniform(0.2, 2) * np.stack([-y, x, 0 * x], -1)


def _folded(rng: np.random.Generator) -> Any:
    o, d = _scattered(0.05, 0.02)(rng)
    return o, d + np.stack([*(rng.uniform(-2, 2) * np.sin(2 * o[..., k]) for k in range(2)), 0 * o[..., 0]], -1)


def _nearly_central(rng: np.random.Generator) -> Any:
    o, d = _scattered(0.0, 0.05)(rng)
    return rng.normal(size=3) + 1e-5 * rng.normal(size=o.shape), d + 0.4 * o


def _holes(rng: np.random.Generator) -> Any:
    o, d = _scattered(0.2, 0.3)(rng)
    lost = rng.random(o.shape[:2]) < 0.15
    return o, np.where(lost[..., None], rng.choice([0.0, np.nan, np.inf]), d)


def _lengths(rng: np.random.Generator) -> Any:
    o, d = _scattered(0.1, 0.3)(rng)
    return o, d * 10 ** rng.uniform(-2, 2, (*d.shape[:2], 1))


def _thin(rng: np.random.Generator) -> Any:
    o, d = _scattered(0.1, 0.1)(rng)
    return o * [1, 1e-4, 1], d * [1, 1e-4, 1]


def _scaled(scale: float) -> Callable[[np.random.Generator], Any]:
    def rays(rng: np.random.Generator) -> Any:
        o, d = _scattered(0.2, 0.3)(rng)
        return scale * o, d

    return rays


def _distant(rng: np.random.Generator) -> Any:
    o, d = _scattered(0.2, 0.3)(rng)
    return o + [1000, -2000, 500], d


KINDS: dict[str, Callable[[np.random.Generator], Any]] = {
    "smooth": _scattered(0.05, 0.1),
    "rough": _scattered(0.3, 0.5),
    "random": _random,
    "twisted": _twisted,
    "folded": _folded,
    "nearly parallel": _scattered(0.1, 1e-5),
    "nearly central": _nearly_central,
    "holes": _holes,
    "directions of many lengths": _lengths,
    "thin cells": _thin,
    "scale 1e-8": _scaled(1e-8),
    "scale 1e8": _scaled(1e8),
    "far from the origin": _distant,
}


def inputs(kind: str, count: int, seed: int = 1) -> list[tuple[RayMap, np.ndarray]]:
    """Maps with points (n, 3) near to them, on their rays, and on their rays backwards; `count` points in all."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    found = []
    for part in np.array_split(np.arange(count), min(_MAPS, count)):
        camera = RayMap(*KINDS[kind](rng), images=IMAGES)
        size = np.ptp(camera.origins, axis=(0, 1)).max()
        pixel = rng.uniform(0, 1, (len(part), 2)) * [camera.width, camera.height]
        ray = camera.ray(pixel)
        distance = size * 10 ** rng.uniform(-2, 2, (len(part), 1)) * rng.choice([1, 1, 1, -1], (len(part), 1))
        around = ray.origin + 2 * size * rng.normal(size=(len(part), 3))
        on_ray = ray.valid[:, None] & (rng.random((len(part), 1)) < 0.7)
        found.append((camera, np.where(on_ray, ray.origin + distance * ray.direction, around)))
    return found


def projection_rows(kind: str, count: int) -> list[StressRow]:
    """`project` of points that single precision holds, so that both precisions have one truth."""
    from mpcam.backend import types

    given = [(camera, points.astype(np.float32).astype(np.float64)) for camera, points in inputs(kind, count)]
    exact = [truth for camera, points in given for truth in truths(camera, points)]
    rows = []
    for precision, eps in EPS.items():
        found = []
        for camera, points in given:
            if precision == "float64":
                image = camera.project(points)
                found += list(zip(image.pixel, image.depth, image.valid, strict=True))
                continue
            image = camera.project(types().Array3f(*points.T.astype(np.float32)))
            pixel, depth, valid = (np.stack([x.numpy() for x in part], -1) for part in image)
            found += list(zip(np.moveaxis(pixel, 0, -1), depth, valid, strict=True))
        rows.append(judged(kind, precision, exact, found, eps))
    return rows


def judged(kind: str, precision: str, exact: list[Truth], found: list[Any], eps: float) -> StressRow:
    """Images that were found against the true ones; an image belongs to the nearest true one."""
    worst, missed, invented = 0.0, 0, 0
    for truth, (pixel, depth, valid) in zip(exact, found, strict=True):
        matched = np.zeros(len(truth.pixel), bool)
        for place, far in zip(pixel[valid].astype(np.float64), depth[valid], strict=True):
            off = np.abs(truth.pixel - place).max(-1, initial=0.0)
            if len(off) == 0 or off.min() > 1e-6 + 64 * eps * truth.pixel_condition[off.argmin()]:
                invented += 1
                continue
            one = int(off.argmin())
            invented += int(matched[one] and truth.sure[one])
            matched[one] = True
            if truth.sure[one]:
                error = [
                    off[one] / truth.pixel_condition[one],
                    abs(far - truth.depth[one]) / truth.depth_condition[one],
                ]
                worst = max(worst, max(error) / eps)
        missed += int((truth.sure & ~matched).sum())
    return StressRow("random maps", f"images, {kind}", precision, len(exact), worst, missed, invented)


def border_row(count: int) -> StressRow:
    """Points on the rays of pixels and of lines between them, where two or four cells meet: one image each."""
    rng = np.random.default_rng(5)
    missed = invented = 0
    for _ in range(_MAPS):
        camera = RayMap(*_scattered(0.1, 0.2)(rng), images=IMAGES)
        pixel = rng.uniform(0, 1, (-(-count // _MAPS), 2)) * [camera.width, camera.height]
        center = np.floor(pixel) + 0.5
        pixel = np.where(rng.random(pixel.shape) < 0.7, center, pixel)
        ray = camera.ray(pixel)
        image = camera.project(ray.origin + rng.uniform(0.1, 30, (len(pixel), 1)) * ray.direction)
        same = image.valid & (np.abs(image.pixel - pixel[:, None]).max(-1) < 1e-9)
        missed += int((~same.any(-1)).sum())
        invented += int((same.sum(-1) > 1).sum())
    return StressRow("random maps", "images, borders of cells", "float64", count, float("nan"), missed, invented)


def ray_row(count: int) -> StressRow:
    """Rays between the centers of pixels, against the bilinear formula in exact fractions."""
    from fractions import Fraction

    rng, worst = np.random.default_rng(7), 0.0
    camera = RayMap(*_scattered(0.3, 0.5)(rng))
    pixel = rng.uniform(0, 1, (count, 2)) * [camera.width, camera.height]
    ray = camera.ray(pixel)
    for (u, v), origin, direction in zip(pixel, ray.origin, ray.direction, strict=True):
        place, corner = [], []
        for x, size in ((u, camera.width), (v, camera.height)):
            corner.append(min(max(int(np.floor(x - 0.5)), 0), size - 2))
            place.append(Fraction(float(x)) - Fraction(1, 2) - corner[-1])
        (i, j), (s, t) = corner, place
        weights = {(0, 0): (1 - s) * (1 - t), (0, 1): s * (1 - t), (1, 0): (1 - s) * t, (1, 1): s * t}

        def mixed(table: np.ndarray, i: int = i, j: int = j, weights: Any = weights) -> np.ndarray:
            values = [
                sum(w * Fraction(float(table[j + b, i + a, k])) for (b, a), w in weights.items()) for k in range(3)
            ]
            return np.array([float(x) for x in values])

        size = np.abs(camera.origins).max() + np.abs(camera.directions).max()
        along = mixed(camera.directions)
        length = np.linalg.norm(along)
        off = max(np.abs(mixed(camera.origins) - origin).max(), np.abs(along - length * direction).max())
        worst = max(worst, off / (2.0**-52 * size))
    return StressRow("random maps", "rays between centers", "float64", count, worst, 0, 0)


def lone_rows() -> list[StressRow]:
    """Where no image is isolated, or none is there: an eye, a focus, one row or column, numbers that are not finite."""
    y, x = np.mgrid[0:9, 0:9] / 4.0 - 1
    flat, ahead = np.stack([x, y, 0 * x], -1), np.stack([0 * x, 0 * x, 1 + 0 * x], -1)
    central, focus = RayMap(0 * flat, flat + ahead), RayMap(flat, ahead - flat)
    twisted = RayMap(flat, ahead + np.stack([-y, x, 0 * x], -1))
    bad = np.array([[np.nan, 0, 1], [np.inf, 0, 1], [0, -np.inf, 1], [np.inf, np.nan, -np.inf]])
    row = RayMap(flat[:1], (ahead + 0.3 * flat)[:1])
    one = RayMap(flat[:1, :1], ahead[:1, :1])
    none = RayMap(flat, 0 * ahead)
    rows = []
    for name, camera, points in (
        ("the eye of a central map", central, np.zeros((1, 3))),
        ("a focus", focus, np.array([[0.0, 0.0, 1.0]])),
        ("not finite", twisted, bad),
        ("one row", row, row.ray([[1.2, 0.5], [3.0, 0.2]]).direction + 0.1),
        ("one column", RayMap(flat[:, :1], ahead[:, :1]), np.array([[-1.0, 0.2, 3.0], [0.0, 0.0, 1.0]])),
        ("one pixel", one, np.array([[-1.0, -1.0, 3.0], [0.0, 0.0, 1.0]])),
        ("no ray at all", none, np.array([[0.0, 0.0, 1.0]])),
        ("behind", RayMap(flat, ahead), np.array([[0.1, 0.2, -1.0], [0.0, 0.0, -1e-9]])),
    ):
        image = camera.project(points)
        wrong = int(image.valid.sum() + (~np.isfinite(image.pixel)).sum() + (~np.isfinite(image.depth)).sum())
        rows.append(StressRow(name, "images, none", "float64", len(points), float("nan"), 0, wrong))
    return rows
