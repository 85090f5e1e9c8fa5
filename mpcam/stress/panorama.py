"""Panoramas at their limits: the seam, the poles, narrow ranges and whole turns; and that every pixel is hit once."""

import math
from typing import Any

import numpy as np

from mpcam.cameras.panorama import Panorama
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, pose
from mpcam.stress.exact import DIGITS, Exact, Real, parameters
from mpcam.stress.inputs import BAD_PIXELS, central_points
from mpcam.stress.projections import images, judge_images, rays, rounded
from mpcam.stress.report import EPS, Case, Progress, StressRow, check_counts, run_cases
from mpcam.stress.report import LIMIT as LIMIT

WIDTH, HEIGHT = 512, 256
_STEEPEST = 1e-15  # parts of a point's distance from the axis, within which a cylinder has no image


def cameras() -> dict[str, Panorama]:
    """Whole turns with the seam behind, ahead and askew, parts, and cylinders of usual and extreme heights."""
    size = (WIDTH, HEIGHT)
    return {
        "equirectangular": Panorama.equirectangular(*size),
        "seam ahead": Panorama.equirectangular(*size, longitude=(0.0, 2 * math.pi)),
        "seam askew": Panorama.equirectangular(*size, longitude=(-1.1, 2 * math.pi - 1.1)),
        "part": Panorama.equirectangular(*size, longitude=(-0.7, 2.0), latitude=(-0.2, 1.1)),
        "narrow": Panorama.equirectangular(*size, longitude=(0.3, 0.3001), latitude=(0.1, 0.1001)),
        "cylindrical": Panorama.cylindrical(*size),
        "steep": Panorama.cylindrical(*size, longitude=(-1.0, 1.0), latitude=(-1.4, 1.5707)),
    }


def definition(camera: Panorama) -> Exact:
    """Longitude atan2(x, z) from the left border on, latitude or its tangent from the top border on.

    Ranges that float64 cannot tell from a turn are a turn.
    """
    import mpmath

    flat = camera.projection == "equirectangular"
    with mpmath.workdps(DIGITS):
        turn, (left, right) = 2 * mpmath.pi, map(mpmath.mpf, camera.longitude)
        middle, whole = (left + right) / 2, abs((right - left) / turn - 1) < 1e-15

    def image(x: Real, y: Real, z: Real, left: Real, right: Real, bottom: Real, top: Real) -> tuple[Real, Real]:
        angle = mpmath.atan2(x, z) - middle if x or z else mpmath.mpf(0)
        angle -= turn * mpmath.floor(angle / turn + mpmath.mpf(1) / 2)  # from -pi up to, not including, pi
        off = (left + right) / 2 - middle
        u = camera.width * ((angle - off) / (turn if whole else right - left) + mpmath.mpf(1) / 2)
        rho = mpmath.hypot(x, z)
        rise = mpmath.atan2(-y, rho) if flat else -y / rho
        low, high = (bottom, top) if flat else (mpmath.tan(bottom), mpmath.tan(top))
        return u, camera.height * (high - rise) / (high - low)

    def beyond(x: Real, y: Real, z: Real) -> Real:
        if not (x or y or z):
            return 1
        return -1 if flat else 1 - mpmath.hypot(x, z) / (max(abs(x), abs(y), abs(z)) * mpmath.mpf(_STEEPEST))

    numbers = parameters(*camera.longitude, *camera.latitude)
    return Exact(image, beyond, lambda u, v: -1, float(camera.width + camera.height), numbers)


def points(camera: Panorama, count: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Points (count, 3) of central cameras, and those near to the seam and the poles, and on them."""
    rng = np.random.default_rng(seed)
    tiny = 10.0 ** rng.uniform(-40, -2, count) * rng.choice([-1.0, 1.0], count)
    seam = 0.5 * sum(camera.longitude) + np.pi + tiny
    up = rng.uniform(-1, 1, count)
    pole = np.stack([tiny, rng.choice([-1.0, 1.0], count), tiny[::-1]], -1)
    return central_points(camera, np.pi, count, seed) | {
        "near the seam": np.stack([np.sin(seam), up, np.cos(seam)], -1),
        "on the seam": np.stack([rng.choice([0.0, -0.0], count), up, -1 + 0 * up], -1),
        "near the poles": pole,
        "the poles": np.array([[0.0, 1.0, 0.0], [-0.0, -1.0, -0.0]]),
        "above": np.stack([1e-3 * up, rng.choice([-1.0, 1.0], count), 1e-3 * np.roll(up, 1)], -1),
    }


def image_rows(name: str, camera: Panorama, count: int) -> list[StressRow]:
    """Images against the definition; across the seam of a turn the nearer of the two ways counts."""
    import mpmath

    exact, rows = definition(camera), []
    low, high = camera.longitude
    period = camera.width * 2 * math.pi / (high - low)
    for kind, precision, given in rounded(points(camera, count)):
        pixel, depth, valid = images(camera, given, precision)
        shifted = np.array(pixel)
        with mpmath.workdps(DIGITS):
            for number in np.flatnonzero(valid):
                u = float(exact.pixel(given[number])[0])
                shifted[number, 0] += period * round((u - pixel[number, 0]) / period)
        rows.append(judge_images(name, f"images, {kind}", precision, exact, given, (shifted, depth, valid)))
    return rows


def ray_rows(name: str, camera: Panorama, count: int, seed: int = 2) -> list[StressRow]:
    """Rays of pixels in the image and at its borders, against the direction of their longitude and latitude."""
    rng, size = np.random.default_rng(seed), np.array([camera.width, camera.height])
    sets = {
        "everywhere": rng.uniform(0, 1, (count, 2)) * size,
        "borders": np.where(rng.random((count, 2)) < 0.5, rng.integers(0, 2, (count, 2)), rng.random((count, 2)))
        * size,
    }
    rows = []
    for kind, precision, given in rounded(sets):
        _, direction, valid = rays(camera, given, precision)
        worst = max(_direction_error(camera, *pair, EPS[precision]) for pair in zip(given, direction, strict=True))
        rows.append(StressRow(name, f"rays, {kind}", precision, len(given), worst, int((~valid).sum()), 0))
    for precision in EPS:
        origin, direction, valid = rays(camera, BAD_PIXELS, precision)
        invented = int(valid.sum() + (~np.isfinite(origin)).sum() + (~np.isfinite(direction)).sum())
        rows.append(StressRow(name, "rays, not finite", precision, len(valid), float("nan"), 0, invented))
    return rows


def _direction_error(camera: Panorama, pixel: np.ndarray, direction: np.ndarray, eps: float) -> float:
    """Distance of a direction from the exact one, in units of eps times the angles that it is made of."""
    import mpmath

    with mpmath.workdps(DIGITS):
        (left, right), (bottom, top) = (tuple(map(mpmath.mpf, ends)) for ends in (camera.longitude, camera.latitude))
        u, v = (mpmath.mpf(float(x)) for x in pixel)
        angle = left + u / camera.width * (right - left)
        if camera.projection == "equirectangular":
            rise = top - v / camera.height * (top - bottom)
            slope = 1
        else:
            low, high = mpmath.tan(bottom), mpmath.tan(top)
            rise = mpmath.atan(high - v / camera.height * (high - low))
            slope = (abs(low) + abs(high) + abs(bottom) + abs(top)) * mpmath.cos(rise) ** 2
        exact = mpmath.sin(angle) * mpmath.cos(rise), -mpmath.sin(rise), mpmath.cos(angle) * mpmath.cos(rise)
        off = max(abs(mpmath.mpf(float(x)) - y) for x, y in zip(direction, exact, strict=True))
        size = 1 + abs(left) + abs(right) + slope * (abs(bottom) + abs(top))
        return float(off / (eps * size))


def pixel_rows(name: str, camera: Panorama, count: int) -> list[StressRow]:
    """Every pixel's ray has its image in that pixel and no other; a whole sphere lies wholly in the image."""
    v, u = np.indices((camera.height, camera.width)) + 0.5
    centers = np.stack([u.ravel(), v.ravel()], -1)
    whole = name in ("equirectangular", "seam ahead", "seam askew")
    rng, rows = np.random.default_rng(3), []
    around = np.concatenate(
        [rng.normal(size=(count, 3)), *(points(camera, 100)[k] for k in ("on the seam", "the poles"))]
    )
    for precision in EPS:
        _, direction, valid = rays(camera, centers, precision)
        back, _, there = images(camera, direction, precision)
        missed = int((~(valid & there & (np.floor(back) == np.floor(centers)).all(-1))).sum())
        invented = 0
        if whole:
            pixel, _, _ = images(camera, around, precision)
            invented = int(((pixel < 0) | (pixel >= [camera.width, camera.height])).any(-1).sum())
        rows.append(StressRow(name, "each pixel once", precision, len(centers) + count, float("nan"), missed, invented))
    return rows


def narrow_view(distance: float, width: float) -> Panorama:
    """For distant eyes: see `distant`."""
    ends = (-width / distance, width / distance)
    return Panorama.equirectangular(VIEW, VIEW, pose(distance), longitude=ends, latitude=ends)


def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
    """All cases: `points` per kind of point, `triangles` directions per camera. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)

    def of(name: str, camera: Panorama) -> Any:
        return lambda: [
            *image_rows(name, camera, points),
            *ray_rows(name, camera, points),
            *pixel_rows(name, camera, triangles),
        ]

    cases: list[Case] = [(name, of(name, camera)) for name, camera in cameras().items()]
    return run_cases([*cases, *distant_cases(narrow_view)], progress)
