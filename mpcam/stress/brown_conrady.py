"""Brown and Conrady's lens at its limits: folds, poles, strong decentering, and coefficients of all sizes."""

from functools import partial
from typing import Any

import numpy as np

from mpcam.cameras.brown_conrady import BrownConrady
from mpcam.cameras.calibrated import FARTHEST
from mpcam.cameras.folds import WIDEST
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.exact import DIGITS, Exact, Real, parameters
from mpcam.stress.folds import Folds, distorted
from mpcam.stress.inputs import central_points, pixels
from mpcam.stress.projections import image_rows, ray_rows
from mpcam.stress.report import EPS, Case, Progress, StressRow, check_counts, run_cases
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 512


def cameras() -> dict[str, BrownConrady]:
    """Real lenses; folds in the image, on one side, near the axis, nearly none; poles; coefficients of all sizes."""

    def lens(k: Any, p: Any = (), focal: float = 300.0, **rest: Any) -> BrownConrady:
        center = {"cx": 0.49 * SIZE, "cy": 0.51 * SIZE} | {key: rest.pop(key) for key in ("cx", "cy") if key in rest}
        return BrownConrady(SIZE, SIZE, focal, 1.01 * focal, k=k, p=p, **center, **rest)

    return {
        "real": lens((-0.28340811, 0.07395907), (0.00019359, 1.76187114e-05), 458.0),
        "rational": lens((9.1, 5.2, 0.19, 9.4, 8.1, 1.1), (1e-4, -2e-4), 180.0),
        "pinhole": lens((), (), 40.0),
        "folds in the image": lens((-0.5, 0.02), (-0.01, 0.02)),
        "folds, no decentering": lens((-0.5, 0.02)),
        "folds near the axis": lens((-1e6,), (3.0, -2.0), 4e5),
        "folds on one side": lens((-0.28, 0.027), (-0.004, 0.01), 250.0),
        "nearly folds": lens(nearly_double(1.0, 1e-6)),
        "folds twice": lens(nearly_double(1.0, -1e-6)),
        "only decentering": lens((), (0.1, 0.15), max_angle=1.2),
        "strong decentering": lens((-0.2,), (0.15, -0.2)),
        "pole": lens((0.1, 0.02, 0, -0.4, 0.01), (0.01, 0.02), 60.0),
        "pole near the axis": lens((0.3, 0, 0, -1e4), (0.1, 0), 2e4),
        "stretches": lens((0.9, 0.7, 0.3), (0.02, 0.01), 60.0),
        "cancels": lens((30.0, -20.0, 3.4, 29.9, -19.8, 3.3), (), 100.0),
        "telephoto": lens((-0.3, 900.0), (1e-3, 0), 1e7),
        "tiny": lens((-0.3, 0.05, -0.01), (1e-3, -1e-3), 1e-4, cx=0.0, cy=0.0),
        "narrower than a domain": lens((0.1, 0.2), (0.01, -0.02), max_angle=0.3),
    }


def nearly_double(r: float, apart: float) -> tuple[float, float]:
    """k for which (r R)' = 1 + 3 k1 s + 5 k2 s^2 comes within `apart` of zero at r, or goes below it by as much."""
    s = r * r
    return -2 / (3 * s * (1 + apart)), 1 / (5 * s * s * (1 + apart))


def exact_camera(camera: BrownConrady, folds: Folds) -> Exact:
    """The camera by its published formula."""
    import mpmath

    cx, cy, fx, fy = (mpmath.mpf(float(x)) for x in (camera.cx, camera.cy, camera.fx, camera.fy))
    edge, rim = folds.conditions()
    # The pixel is a sum with the principal point, and rounded as that.
    rim += 2 * max(abs(cx), abs(cy)) / (min(fx, fy) * mpmath.hypot(*folds.image(*folds.at_rim(0))))

    def image(x: Real, y: Real, z: Real, *numbers: Real) -> tuple[Real, Real]:
        u, v = distorted(numbers[:6], numbers[6:], x / z, y / z)
        return cx + fx * u, cy + fy * v

    def beyond(x: Real, y: Real, z: Real) -> Real:
        return folds.beyond(x / z, y / z) if z > 0 else mpmath.mpf(1)

    def outside(u: Real, v: Real) -> Real:
        return folds.outside((u - cx) / fx, (v - cy) / fy)

    return Exact(image, beyond, outside, float(fx + fy), parameters(*camera.k, *camera.p), edge=edge, rim=float(rim))


def lens_rows(name: str, camera: BrownConrady, count: int) -> list[StressRow]:
    """Domain, images and rays of one camera, called `name` in the table."""
    import mpmath

    with mpmath.workdps(DIGITS):
        k, p = ([mpmath.mpf(float(x)) for x in numbers] for numbers in (camera.k, camera.p))
        folds = Folds(k, p, float(camera.max_angle))
        exact = exact_camera(camera, folds)
        domain = domain_row(name, camera, folds, exact)
        points, images = near_folds(camera, folds, count)
        points = {"near the fold": points} | central_points(camera, camera.domain.max_angle or 0.0, count)
        places = {"near the fold": images} | pixels(camera, camera.domain.image_radius, count)
        return [domain, *image_rows(name, camera, exact, points), *ray_rows(name, camera, exact, places)]


def near_folds(camera: BrownConrady, folds: Folds, count: int, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Points (count, 3) next to where the domain ends, at any azimuth, and pixels (count, 2) next to their images."""
    rng = np.random.default_rng(seed)
    ends = [folds.at_rim(float(phi)) for phi in rng.uniform(-np.pi, np.pi, count)]
    away = 1 + 10.0 ** rng.uniform(-12, -2, (count, 1)) * rng.choice([-1.0, 1.0], (count, 1))
    images = np.array([[float(c) for c in folds.image(*end)] for end in ends])
    points = np.array([[float(x), float(y)] for x, y in ends]) * away
    center, focal = np.array([camera.cx, camera.cy]), np.array([camera.fx, camera.fy])
    return np.concatenate([points, np.ones((count, 1))], 1), center + focal * images * away


def domain_row(name: str, camera: BrownConrady, folds: Folds, exact: Exact) -> StressRow:
    """`Camera.domain` and `inner_angle` against the folds towards (p2, p1), and on the other side."""
    import mpmath

    toward = [float(mpmath.atan2(sign * folds.p[0], sign * folds.p[1])) for sign in (1, -1)]
    (outer, inner), radius = ([folds.at_rim(phi) for phi in toward], camera.domain.image_radius)
    wide = max(camera.fx, camera.fy) * mpmath.hypot(*folds.image(*outer))
    truths = [
        (camera.domain.max_angle, mpmath.atan(mpmath.hypot(*outer)), exact.edge),
        (camera.inner_angle, mpmath.atan(mpmath.hypot(*inner)), exact.edge),
    ]
    truths += [(radius, wide, exact.rim)] if radius is not None else []
    errors = [abs(mpmath.mpf(float(found)) / truth - 1) / (EPS["float64"] * part) for found, truth, part in truths]
    endless = wide > 0.9 * FARTHEST * max(camera.fx, camera.fy) or mpmath.hypot(*outer) > 0.9 * WIDEST
    return StressRow(name, "domain", "float64", len(truths), float(max(errors)), int((radius is None) != endless), 0)


def narrow_view(distance: float, width: float) -> BrownConrady:
    """For distant eyes: see `distant`."""
    focal, size = focal_length(distance, width), width / distance
    k, p = (-0.05 * size**-2, 0.02 * size**-4), (0.005 / size, -0.01 / size)  # as others are at 45 degrees
    return BrownConrady(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, k, p, pose(distance))


def run(triangles: int = 20_000, points: int = 25, progress: Progress | None = None) -> list[StressRow]:
    """All cases: `points` per kind of point; there are no bounds to try on triangles. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases: list[Case] = [(name, partial(lens_rows, name, camera, points)) for name, camera in cameras().items()]
    return run_cases([*cases, *distant_cases(narrow_view)], progress)
