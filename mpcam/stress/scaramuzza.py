"""Scaramuzza's camera at its limits: angles that turn back within the image, rays straight to the side, pinholes."""

import functools
from typing import Any

from mpcam.cameras.scaramuzza import LEAST, Scaramuzza
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import focal_length, pose
from mpcam.stress.exact import Real, parameters
from mpcam.stress.lenses import Definition, lens_suite
from mpcam.stress.report import LIMIT as LIMIT

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


def definition(camera: Scaramuzza) -> Definition:
    """Scaramuzza et al. 2006, equation 11: the smallest r along a direction."""
    import mpmath

    def ahead(r: Real, a: tuple[Real, ...]) -> Real:
        return 1 + sum(x * r ** (i + 2) for i, x in enumerate(a))

    def slope(r: Real, a: tuple[Real, ...]) -> Real:
        return sum((i + 2) * x * r ** (i + 1) for i, x in enumerate(a))

    @functools.lru_cache(maxsize=64)
    def end(a: tuple[Real, ...]) -> tuple[Real, Real]:
        """The first r at which the angle's derivative is LEAST, and the angle there: by samples, then by halving."""

        def excess(r: Real) -> Real:
            p = ahead(r, a)
            return (p - r * slope(r, a)) / (r * r + p * p) - mpmath.mpf(LEAST)

        step = mpmath.mpf(1) / 500
        low = next(i * step for i in range(500_000) if excess((i + 1) * step) <= 0)
        r = mpmath.findroot(excess, (low, low + step), solver="anderson", tol=mpmath.mpf(10) ** -140, verify=False)
        return r, mpmath.atan2(r, ahead(r, a))

    def radius(rho: Real, z: Real, *a: Real) -> Real:
        """The smallest positive root of r z = rho P(r): Newton's steps, or halves of the bracket that they leave."""
        if rho == 0 and z > 0:
            return mpmath.mpf(0)
        farthest, turn = end(a)
        if turn <= mpmath.atan2(rho, z):
            return farthest
        length = mpmath.hypot(rho, z)
        side, front = rho / length, z / length
        low, high = mpmath.mpf(0), farthest
        r = min(side / front, high / 2) if front > 0 else high / 2
        for _ in range(600):
            value = r * front - side * ahead(r, a)
            low, high = (r, high) if value <= 0 else (low, r)
            rate = front - side * slope(r, a)
            after = r - value / rate if rate > 0 else low
            after = after if low < after < high else (low + high) / 2
            done = abs(after - r) <= abs(r) * mpmath.mpf(10) ** -75
            r = after
            if done:
                break
        return r

    def largest(*a: Real) -> Real:
        return min(mpmath.mpf(camera.max_angle), end(a)[1])

    return Definition(radius, largest, parameters(*camera.a))


def narrow_view(distance: float, width: float) -> Scaramuzza:
    """For distant eyes: see `distant`."""
    focal = focal_length(distance, width)
    return Scaramuzza(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, (-0.3, 0.05), pose(distance), max_angle=1.5)


run = lens_suite(cameras, definition, narrow_view)
