"""The double sphere at its limits: spheres that nearly touch, centers near a sphere, and what it has in real lenses."""

from typing import Any

from mpcam.cameras.double_sphere import DoubleSphere
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import focal_length, pose
from mpcam.stress.exact import Parameter, Real, largest_angle
from mpcam.stress.lenses import Definition, lens_suite
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 512


def cameras() -> dict[str, DoubleSphere]:
    """xi from just above -1, where a whole lens shrinks into the axis, over 1, where the domain is everything, up."""

    def lens(xi: float, alpha: float, focal: float = 160.0, **rest: Any) -> DoubleSphere:
        return DoubleSphere(SIZE, SIZE, focal, 1.01 * focal, 0.49 * SIZE, 0.51 * SIZE, xi, alpha, **rest)

    return {
        "real": lens(-0.172131, 0.593118, 158.0),
        "narrow": lens(-0.5, 0.1),
        "xi = -1 + 1e-4": lens(-1 + 1e-4, 0.0),
        "xi = -1 + 1e-8": lens(-1 + 1e-8, 0.3),
        "xi = -1 + 1e-12, alpha = 0": lens(-1 + 1e-12, 0.0),
        "xi = -1 + 1e-12, alpha = 0.6": lens(-1 + 1e-12, 0.6),
        "xi = -1 + 1e-12, alpha = 1": lens(-1 + 1e-12, 1.0),
        "xi as near -1 as can be": lens(-1 + 2.0**-53, 0.5),
        "xi = 1 - 1e-10": lens(1 - 1e-10, 0.6, 100.0),
        "xi = 1": lens(1.0, 0.5, 120.0),
        "xi = 1 + 1e-10": lens(1 + 1e-10, 0.2, 30.0),
        "center outside": lens(1.5, 0.3, 200.0),
        "center far outside": lens(1e3, 0.4, 1e5),
        "alpha = 1/2 + 1e-10": lens(0.3, 0.5 + 1e-10, 100.0),
        "cut": lens(-0.2, 0.59, max_angle=1.2),
    }


def definition(camera: DoubleSphere) -> Definition:
    """Usenko, Demmel and Cremers 2018, equations 40 to 42, for points at distance 1."""
    import mpmath

    def radius(rho: Real, z: Real, xi: Real, alpha: Real) -> Real:
        d1 = mpmath.sqrt(rho * rho + z * z)
        shifted = xi * d1 + z
        return rho / (alpha * mpmath.sqrt(rho * rho + shifted * shifted) + (1 - alpha) * shifted)

    def largest(xi: Real, alpha: Real) -> Real:
        most = min(mpmath.mpf(camera.max_angle), mpmath.pi)
        return largest_angle(lambda theta: radius(mpmath.sin(theta), mpmath.cos(theta), xi, alpha), most)

    xi, alpha = camera.xi, camera.alpha
    numbers = (
        Parameter(xi, min(abs(1 + xi), abs(1 - xi), abs(xi))),
        Parameter(alpha, min(alpha, 1 - alpha, abs(2 * alpha - 1))),
    )
    return Definition(radius, largest, numbers)


def narrow_view(distance: float, width: float) -> DoubleSphere:
    """For distant eyes: see `distant`."""
    xi = -0.2
    focal = (1 + xi) * focal_length(distance, width)
    return DoubleSphere(VIEW, VIEW, focal, focal, VIEW / 2, VIEW / 2, xi, 0.6, pose(distance))


run = lens_suite(cameras, definition, narrow_view)
