"""Scaramuzza's camera at its limits: angles that turn back within the image, rays straight to the side, pinholes."""

import functools
from typing import Any

import numpy as np

from mpcam.cameras.calibrated import FARTHEST
from mpcam.cameras.scaramuzza import Scaramuzza
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.exact import Real, parameters
from mpcam.stress.lenses import Definition, lens_cases
from mpcam.stress.report import LIMIT as LIMIT
from mpcam.stress.report import Progress, StressRow, check_counts, run_cases

SIZE = 512


def cameras() -> dict[str, Scaramuzza]:
    """Real lenses, division models of both signs, angles that turn back, and narrow views."""

    def lens(a: Any, focal: float = 150.0, **rest: Any) -> Scaramuzza:
        return Scaramuzza(SIZE, SIZE, focal, 1.01 * focal, 0.49 * SIZE, 0.51 * SIZE, a, **rest)

    return {
        "real": lens((-0.378, 0.0639, -0.1438), 160.0, max_angle=1.9),
        "barrel": lens((-0.25,), 140.0, max_angle=2.5),
        "pincushion": lens((0.3,), 120.0),
        "turns back in the image": lens((0.9, -0.1), 180.0),
        "narrow": lens((-0.3, 0.05), 1e7, max_angle=1.0),
        "narrower than a domain": lens((-0.3, 0.05), 1e5, max_angle=1e-4),
    }


def smallest_root(powers: list[Real], most: float) -> Real | None:
    """The smallest positive root of a polynomial, lowest power first, by Newton's steps from that in float64.

    None where there is none up to `most`; two that meet count as one.
    """
    import mpmath

    roots = np.roots([float(x) for x in reversed(powers)])
    near = [r.real for r in roots if abs(r.imag) < 1e-5 * abs(r) and 0 < r.real < 1.001 * most]
    if not near:
        return None
    r = mpmath.mpf(min(near))
    for _ in range(300):
        value, slope = mpmath.polyval(powers[::-1], r, derivative=True)
        if slope == 0:
            break
        r, before = r - value / slope, r
        if abs(r - before) <= abs(r) * mpmath.mpf(10) ** -75:
            break
    return r


def definition(camera: Scaramuzza) -> Definition:
    """Scaramuzza et al. 2006, equation 11: the smallest r along a direction."""
    import mpmath

    def ahead(r: Real, a: tuple[Real, ...]) -> Real:
        return 1 + sum(x * r ** (i + 2) for i, x in enumerate(a))

    @functools.lru_cache(maxsize=64)
    def end(a: tuple[Real, ...]) -> tuple[Real, Real]:
        """Where the angle turns back: r and the angle."""
        found = smallest_root([mpmath.mpf(1), mpmath.mpf(0), *(-(i + 1) * x for i, x in enumerate(a))], FARTHEST)
        r = mpmath.mpf(FARTHEST) if found is None else found
        return r, mpmath.atan2(r, ahead(r, a))

    def radius(rho: Real, z: Real, *a: Real) -> Real:
        """The smallest positive root of r z = rho P(r)."""
        if rho == 0 and z > 0:
            return mpmath.mpf(0)
        farthest, turn = end(a)
        if turn <= mpmath.atan2(rho, z):
            return farthest
        length = mpmath.hypot(rho, z)
        side, front = rho / length, z / length
        found = smallest_root([side, -front, *(side * x for x in a)], float(farthest))
        return farthest if found is None else found

    def largest(*a: Real) -> Real:
        return min(mpmath.mpf(camera.max_angle), end(a)[1])

    return Definition(radius, largest, parameters(*camera.a))


def narrow_view(distance: float, width: float) -> Scaramuzza:
    """For distant eyes: see `distant`."""
    focal = focal_length(distance, width)
    return Scaramuzza(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, (-0.3, 0.05), pose(distance), max_angle=1.5)


def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
    """All cases: `points` per kind of point, `triangles` per camera. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases = []
    for name, camera in cameras().items():
        cases += lens_cases(name, camera, definition(camera), points, triangles)
    return run_cases([*cases, *distant_cases(narrow_view)], progress)
