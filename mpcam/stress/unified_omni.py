"""The unified omnidirectional model at its limits: pinholes, paraboloids, and ellipsoids of all shapes."""

from typing import Any

from mpcam.cameras.unified_omni import UnifiedOmni
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import focal_length, pose
from mpcam.stress.exact import Parameter, Real, largest_angle
from mpcam.stress.lenses import Definition, lens_suite
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 512


def cameras() -> dict[str, UnifiedOmni]:
    """alpha from 0, a pinhole, over 1/2, where the image goes to infinity straight behind, to 1, where it folds."""

    def lens(alpha: float, beta: float = 1.0, focal: float = 150.0, **rest: Any) -> UnifiedOmni:
        return UnifiedOmni(SIZE, SIZE, focal, 1.01 * focal, 0.49 * SIZE, 0.51 * SIZE, alpha, beta, **rest)

    return {
        "real": lens(0.5903, 1.1005, 310.0),
        "catadioptric": UnifiedOmni.mei(SIZE, SIZE, 567.0, 566.0, 257.0, 250.0, 0.95),
        "fisheye": UnifiedOmni.mei(SIZE, SIZE, 480.0, 488.0, 240.0, 264.0, 2.3),
        "pinhole": lens(0.0),
        "nearly a pinhole": lens(1e-10),
        "stereographic": lens(0.5),
        "stereographic to the antipode": lens(0.5, 1.0, 0.01),
        "alpha = 1/2 - 1e-10": lens(0.5 - 1e-10, 1.0, 0.01),
        "alpha = 1/2 + 1e-10": lens(0.5 + 1e-10, 1.0, 0.01),
        "alpha = 1": lens(1.0, 0.7),
        "alpha = 1 - 1e-10": lens(1 - 1e-10, 1.3),
        "flat": lens(0.6, 1e4, 2e4),
        "flat, alpha = 1/2": lens(0.5, 1e4, 100.0),
        "long": lens(0.6, 1e-4, 3.0),
        "cut": lens(0.59, 1.1, max_angle=1.2),
    }


def definition(camera: UnifiedOmni) -> Definition:
    """Khomutenko, Garcia and Martinet 2016, equation 5."""
    import mpmath

    def radius(rho: Real, z: Real, alpha: Real, beta: Real) -> Real:
        return rho / (alpha * mpmath.sqrt(beta * rho * rho + z * z) + (1 - alpha) * z)

    def largest(alpha: Real, beta: Real) -> Real:
        most = min(mpmath.mpf(camera.max_angle), mpmath.pi)
        return largest_angle(lambda theta: radius(mpmath.sin(theta), mpmath.cos(theta), alpha, beta), most)

    alpha, beta = camera.alpha, camera.beta
    return Definition(
        radius, largest, (Parameter(alpha, min(alpha, 1 - alpha, abs(2 * alpha - 1))), Parameter(beta, beta))
    )


def narrow_view(distance: float, width: float) -> UnifiedOmni:
    """For distant eyes: see `distant`."""
    focal = focal_length(distance, width)
    return UnifiedOmni(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, 0.6, 1.1, pose(distance))


run = lens_suite(cameras, definition, narrow_view)
