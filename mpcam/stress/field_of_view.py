"""Devernay and Faugeras' lens at its limits: nearly a pinhole, nearly a turn in the image, the rim at 90 degrees."""

from typing import Any

from mpcam.cameras.field_of_view import FieldOfView
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import focal_length, pose
from mpcam.stress.exact import Real, parameters
from mpcam.stress.lenses import Definition, lens_suite
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 512


def cameras() -> dict[str, FieldOfView]:
    """A real lens, omega at both of its ends, and domains that end before 90 degrees."""

    def lens(omega: float, focal: float = 200.0, **rest: Any) -> FieldOfView:
        return FieldOfView(SIZE, SIZE, focal, 1.01 * focal, 0.49 * SIZE, 0.51 * SIZE, omega, **rest)

    return {
        "real": lens(0.93),
        "wide": lens(2.2, 300.0),
        "nearly a pinhole": lens(0.05),
        "nearly pi": lens(3.1, 400.0),
        "narrow": lens(0.5, 1e7),
        "narrower than a domain": lens(0.5, 1e5, max_angle=1e-4),
        "ends at 60 degrees": lens(1.3, max_angle=1.0471975511965976),
    }


def definition(camera: FieldOfView) -> Definition:
    """Devernay and Faugeras 2001, equation 13."""
    import mpmath

    def radius(rho: Real, z: Real, omega: Real) -> Real:
        return mpmath.atan2(2 * mpmath.tan(omega / 2) * rho, z) / omega

    return Definition(radius, lambda omega: min(mpmath.mpf(camera.max_angle), mpmath.pi / 2), parameters(camera.omega))


def narrow_view(distance: float, width: float) -> FieldOfView:
    """For distant eyes: see `distant`."""
    focal = focal_length(distance, width)
    return FieldOfView(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, 0.9, pose(distance))


run = lens_suite(cameras, definition, narrow_view)
