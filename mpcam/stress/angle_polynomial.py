"""Polynomials of the angle at their limits: even powers, many coefficients, folds."""

from typing import Any

from mpcam.cameras.angle_polynomial import AnglePolynomial
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import focal_length, pose
from mpcam.stress.exact import Real, parameters
from mpcam.stress.lenses import Definition, lens_suite
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 512


def cameras() -> dict[str, AnglePolynomial]:
    """Real lenses, none and many coefficients, folds within and beyond the image, and terms that cancel."""

    def lens(k: Any, focal: float = 150.0, **rest: Any) -> AnglePolynomial:
        return AnglePolynomial(SIZE, SIZE, focal, 1.01 * focal, 0.49 * SIZE, 0.51 * SIZE, k, **rest)

    return {
        "of a car": lens((-0.09415, 0.14209, -0.0212), 140.0),
        "six odd terms": lens((0, 0.4, 0, -0.5, 0, -0.2, 0, 1.1, 0, -0.9, 0, 0.24), 200.0, max_angle=1.2),
        "equidistant": lens((), 80.0),
        "folds in the image": lens((-0.2, -0.05), 180.0),
        "folds near the axis": lens((-1e3,), 4e5),
        "stretches": lens((0.5, 0.2, 0, 0.01), 60.0),
        "cancels": lens((0.9, -0.8, 0.3, -0.03), 120.0),
        "narrow": lens((0.1, 0.2, -0.1, 0.02), 1e7),
        "narrower than a domain": lens((0.1, 0.2, -0.1, 0.02), 1e5, max_angle=1e-4),
    }


def definition(camera: AnglePolynomial) -> Definition:
    """The class's own formula."""
    import mpmath

    def radius(rho: Real, z: Real, *k: Real) -> Real:
        theta = mpmath.atan2(rho, z)
        return theta + sum(x * theta ** (i + 2) for i, x in enumerate(k))

    def largest(*k: Real) -> Real:
        """The first angle at which r' changes its sign, by all roots of r'(theta)."""
        slopes = [(i + 2) * x for i, x in enumerate(k)]
        while slopes and slopes[-1] == 0:
            slopes.pop()
        most = min(mpmath.mpf(camera.max_angle), mpmath.pi)
        if not slopes:
            return most
        roots = mpmath.polyroots([mpmath.mpf(1), *slopes], maxsteps=500, extraprec=500, asc=True)
        return min([most, *(r.real for r in roots if abs(r.imag) < 1e-40 * abs(r) and r.real > 0)])

    return Definition(radius, largest, parameters(*camera.k))


def narrow_view(distance: float, width: float) -> AnglePolynomial:
    """For distant eyes: see `distant`."""
    focal = focal_length(distance, width)
    return AnglePolynomial(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, (0.1, -0.05, 0.01), pose(distance))


run = lens_suite(cameras, definition, narrow_view)
