"""Kannala and Brandt's fisheye at its limits: polynomials that fold over, nearly do, and cancel."""

from typing import Any

import numpy as np

from mpcam.cameras.kannala_brandt import KannalaBrandt
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import focal_length, pose
from mpcam.stress.exact import Real, parameters
from mpcam.stress.lenses import Definition, lens_suite
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 512


def cameras() -> dict[str, KannalaBrandt]:
    """Real lenses, folds within and beyond the image, slopes that nearly vanish, and coefficients of all sizes."""

    def lens(k: Any, focal: float = 150.0, **rest: Any) -> KannalaBrandt:
        return KannalaBrandt(SIZE, SIZE, focal, 1.01 * focal, 0.49 * SIZE, 0.51 * SIZE, k, **rest)

    return {
        "real": lens((0.00348239, 0.000715035, -0.002053236, 0.000202937), 191.0),
        "220 degrees": lens((-0.02, -0.003, 5e-4, -1e-4), 137.0, max_angle=1.92),
        "equidistant": lens((0, 0, 0, 0), 80.0),
        "folds in the image": lens((0.05, -0.05, 0, 0), 180.0),
        "folds near the axis": lens((-1e6, 0, 0, 0), 4e5),
        "folds at 90 degrees": lens((-4 / (3 * np.pi**2), 0, 0, 0)),
        "folds at 180 degrees": lens((-1 / (3 * np.pi**2), 0, 0, 0), 100.0),
        "nearly folds": lens(nearly_double(1.0, 1e-6), 200.0),
        "folds twice": lens(nearly_double(1.0, -1e-6), 200.0),
        "nearly folds at the rim": lens(nearly_double(1.0, -1e-13), 200.0),
        "stretches": lens((0.5, 0.2, 0, 0.01), 60.0),
        "cancels": lens((0.9, -0.8, 0.3, -0.03), 120.0),
        "narrow": lens((0.1, 0.2, -0.1, 0.02), 1e7),
        "narrower than a domain": lens((0.1, 0.2, -0.1, 0.02), 1e5, max_angle=1e-4),
    }


def nearly_double(theta: float, apart: float) -> tuple[float, ...]:
    """k for which f' comes within `apart` of zero at theta, or goes below it by as much."""
    square = theta * theta
    # (1 - s / square)^2 (1 + s / 9) + apart, over its value at s = 0, in powers of s = theta^2.
    coefficients = np.array([1, 1 / 9 - 2 / square, 1 / square**2 - 2 / (9 * square), 1 / (9 * square**2), 0])
    coefficients[0] += apart
    k = coefficients[1:] / coefficients[0] / [3, 5, 7, 9]
    return tuple(float(x) for x in k)


def definition(camera: KannalaBrandt) -> Definition:
    """Kannala and Brandt 2006, equation 6."""
    import mpmath

    def radius(rho: Real, z: Real, *k: Real) -> Real:
        theta = mpmath.atan2(rho, z)
        return theta + sum(x * theta ** (2 * i + 3) for i, x in enumerate(k))

    def largest(*k: Real) -> Real:
        """The first angle at which r' changes its sign, by all roots of r'(theta^2)."""
        slopes = [(2 * i + 3) * x for i, x in enumerate(k)]
        while slopes and slopes[-1] == 0:
            slopes.pop()
        most = min(mpmath.mpf(camera.max_angle), mpmath.pi)
        if not slopes:
            return most
        roots = mpmath.polyroots([mpmath.mpf(1), *slopes], maxsteps=500, extraprec=500, asc=True)
        return min([most, *(mpmath.sqrt(r.real) for r in roots if abs(r.imag) < 1e-40 * abs(r) and r.real > 0)])

    return Definition(radius, largest, parameters(*camera.k))


def narrow_view(distance: float, width: float) -> KannalaBrandt:
    """For distant eyes: see `distant`."""
    focal = focal_length(distance, width)
    return KannalaBrandt(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, (0.1, -0.05, 0.01, 0), pose(distance))


run = lens_suite(cameras, definition, narrow_view)
