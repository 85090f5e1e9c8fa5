"""Cameras with three rays at their limits: images of points against 50 digits, in both precisions."""

from functools import cache, partial
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.three_rays import project
from mpcam.stress import camera_triangle_bounds as bounds
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, pose
from mpcam.stress.report import EPS, LIMIT, Case, Progress, StressRow, check_counts, run_cases
from mpcam.stress.three_ray_inputs import KINDS
from mpcam.stress.three_ray_truth import truths

FAR = 1e3
"""Images that are off by more than this many LIMIT belong to no solution."""


def run(triangles: int = 100_000, points: int = 80, progress: Progress | None = None) -> list[StressRow]:
    """All cases, `points` of each kind and precision. Raises InputError below 1.

    triangles: how many pairs of a camera triangle and a scene triangle are looked at for each kind of rays, to find
    pixels that a bound leaves out.
    """
    check_counts(triangles=triangles, points=points)
    cases = [*projection_cases(points), ("not finite", lambda: [not_finite_row()])]
    cases += [(f"bounds, {kind}", partial(bounds.bound_rows, kind, triangles)) for kind in bounds.KINDS]
    return run_cases([*cases, *distant_cases(narrow_view)], progress)


def narrow_view(distance: float, width: float) -> CameraTriangles:
    """For distant eyes (see `distant`): a plane pinhole of two camera triangles."""
    camera_from_world = pose(distance)
    turn, shift = camera_from_world[:3, :3], camera_from_world[:3, 3]
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * width / distance + [0, 0, 1]
    return CameraTriangles(
        vertices=(corners - shift) @ turn,
        faces=[[0, 1, 2], [0, 2, 3]],
        directions=corners @ turn,
        resolution=VIEW,
        ray_scale="plane",
    )


def projection_cases(count: int, seed: int = 1) -> list[Case]:
    """`project` of all kinds in float64 (NumPy) and float32 (Dr.Jit, as kernels run it), against 50 digits."""
    given = [kind(np.random.default_rng(seed), count) for kind in KINDS.values()]
    inputs = [np.concatenate(parts) for parts in zip(*given, strict=True)]

    @cache
    def images(precision: str) -> tuple[list[np.ndarray], np.ndarray]:
        """Inputs as the precision holds them, and their images; at once, so that kernels are compiled once."""
        rounded = [x.astype(precision).astype(np.float64) for x in inputs]
        return rounded, (_images_double if precision == "float64" else _images_single)(*rounded)

    def rows(kind: str, number: int, precision: str) -> list[StressRow]:
        rounded, found = images(precision)
        part = slice(number * count, (number + 1) * count)
        return [judged(kind, precision, [x[part] for x in rounded], found[:, :, part], EPS[precision])]

    kinds = [(kind, number, precision) for precision in EPS for number, kind in enumerate(KINDS)]
    return [(f"{kind}, {precision}", partial(rows, kind, number, precision)) for kind, number, precision in kinds]


def _images_double(v: np.ndarray, d: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Three images, each w1, w2, c, valid, of each input: (3, 4, count)."""
    images = project(v.transpose(1, 2, 0), d.transpose(1, 2, 0), q.T)
    return np.array([[image.w1, image.w2, image.c, image.valid] for image in images])


def _images_single(v: np.ndarray, d: np.ndarray, q: np.ndarray) -> np.ndarray:
    import drjit as dr

    from mpcam.backend import types

    corners, rays = [[types().Array3f(*x[:, i].T.astype(np.float32)) for i in range(3)] for x in (v, d)]
    images = [list(image) for image in project(corners, rays, types().Array3f(*q.T.astype(np.float32)))]
    dr.eval(images)
    return np.array([[np.broadcast_to(x.numpy(), len(q)) for x in image] for image in images], np.float64)


def not_finite_row() -> StressRow:
    """Numbers that are none in each place in turn, and triangles and rays that are nothing."""
    v, d, q = [x[0] for x in KINDS["everywhere"](np.random.default_rng(1), 1)]
    inputs = [(v, 0 * d, q), (0 * v, d, 0 * q), (0 * v + q, d, q), (0 * v, 0 * d, 0 * q)]
    for which in range(3):
        for bad in (np.nan, np.inf, -np.inf):
            changed = [x.copy() for x in (v, d, q)]
            changed[which].flat[which] = bad
            inputs.append(tuple(changed))
    images = [image for given in inputs for image in project(*given)]
    invented = sum(int(image.valid) or not np.isfinite(image[:3]).all() for image in images)
    return StressRow("random", "images, not finite, or nothing", "float64", len(inputs), float("nan"), 0, invented)


def judged(kind: str, precision: str, given: Any, found: np.ndarray, eps: float) -> StressRow:
    """One row: found (3, 4, count) against the truth of each input."""
    worst, missed, invented = 0.0, 0, 0
    for i in range(found.shape[2]):
        one = judge_one(given[0][i], given[1][i], given[2][i], found[:, :, i], eps)
        worst, missed, invented = max(worst, one[0]), missed + one[1], invented + one[2]
    return StressRow("random", f"images, {kind}", precision, found.shape[2], worst, missed, invented)


def judge_one(v: Any, d: Any, q: Any, found: np.ndarray, eps: float) -> tuple[float, int, int]:
    """Largest error, solutions missed and images invented, for one input; found (3, 4): w1, w2, c, valid.

    Near a fold, and where rounding of the input decides whether a solution is inside, both answers are right.
    """
    known, folds = truths(v, d, q, eps)
    images = [row[:3] for row in found if row[3]]
    worst, taken, invented = 0.0, set(), False
    for image in images:
        errors = [np.max(np.abs(image - t.values) / (eps * t.condition)) for t in known]
        error, nearest = min([(e, i) for i, e in enumerate(errors) if i not in taken], default=(np.inf, -1))
        if error > LIMIT and any(low <= image[2] <= high for low, high in folds):
            continue
        if error > FAR * LIMIT:
            invented = True
            continue
        taken.add(nearest)
        worst = max(worst, float(error))
        invented |= bool((known[nearest].margins < -LIMIT).any())
    sure = [i for i, t in enumerate(known) if (t.margins > LIMIT).all()]
    return worst, int(any(i not in taken for i in sure)), int(invented)
