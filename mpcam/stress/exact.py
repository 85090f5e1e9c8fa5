"""A camera by its definition at 50 digits, and how much rounding of what goes in changes what comes out.

Nothing here is the code under test: the image of a point is the published formula in mpmath, the end of the domain is
found by mpmath's own root finders, and a ray is judged by the pixel that the formula gives it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mpcam.cameras.calibrated import FARTHEST

DIGITS = 80
"""Digits of the arithmetic, of which 50 are right where formulas cancel."""

Real = Any  # a number of mpmath


@dataclass(frozen=True)
class Parameter:
    """A number of a camera whose rounding counts: `size` times eps is its rounding error, by default its own size."""

    value: float
    size: float


def parameters(*values: float) -> tuple[Parameter, ...]:
    """Numbers that are rounded to their own last places."""
    return tuple(Parameter(float(value), abs(float(value))) for value in values)


@dataclass(frozen=True)
class Exact:
    """One camera in its own frame, for numbers of mpmath.

    image: pixel (u, v) of a point x, y, z, and of the values of `numbers`. beyond: by how many parts a point lies
    outside of the domain, negative inside. outside: the same for a pixel u, v. scale: pixels that count beside u and v.
    numbers: whose rounding counts too. depth: distance along the ray. edge, rim: parts by which the ends of the domain,
    of points and of pixels, move when what they depend on is off by one part in float64.
    """

    image: Callable[..., tuple[Real, Real]]
    beyond: Callable[[Real, Real, Real], Real]
    outside: Callable[[Real, Real], Real]
    scale: float
    numbers: tuple[Parameter, ...] = ()
    depth: Callable[[Real, Real, Real], Real] = lambda x, y, z: (x * x + y * y + z * z) ** 0.5
    edge: float = 1.0
    rim: float = 1.0

    def pixel(self, point: Any) -> tuple[Real, Real]:
        """Pixel of a point of floats or numbers of mpmath."""
        import mpmath

        return self.image(*map(mpmath.mpf, point), *self._values())

    def condition(self, point: Any) -> Real:
        """Pixels by which errors of one part in the coordinates, the numbers and the scale change the pixel."""
        import mpmath

        given, step = [mpmath.mpf(x) for x in point], mpmath.mpf(10) ** -25
        values = self._values()
        u, v = self.image(*given, *values)
        total = abs(u) + abs(v) + mpmath.mpf(self.scale)
        sizes = [abs(x) for x in given] + [mpmath.mpf(number.size) for number in self.numbers]
        for i, size in enumerate(sizes):
            if size == 0:
                continue
            moved = [*given, *values]
            moved[i] += step * size
            a, b = self.image(*moved)
            total += (abs(a - u) + abs(b - v)) / step
        return total

    def _values(self) -> list[Real]:
        import mpmath

        return [mpmath.mpf(number.value) for number in self.numbers]


def focal_lengths(camera: Any) -> tuple[float, float]:
    """Pixels that r = 1 is wide and high; a radial camera's r is 1 at its rim."""
    return (camera.radius, camera.radius) if hasattr(camera, "radius") else (camera.fx, camera.fy)


def largest_angle(radius: Callable[[Real], Real], most: Real) -> Real:
    """Where r = radius(theta), from 0 on, stops increasing or reaches FARTHEST, radians; at most `most`.

    Looked for on angles that crowd at both ends, then by mpmath's solver for brackets. 1 / r falls until there, and is
    finite where r is not.
    """
    import mpmath

    with mpmath.workdps(DIGITS):
        part = [mpmath.mpf(10) ** (-mpmath.mpf(k) / 8) for k in range(1, 170)]
        angles = sorted({most * p for p in part} | {most - most * p for p in part})
        far = 1 / mpmath.mpf(FARTHEST)

        def left(theta: Real) -> Real:
            """1 / r, less than FARTHEST's where r goes on beyond."""
            return 1 / radius(theta) - far

        def falling(theta: Real) -> Real:
            return mpmath.diff(left, theta)

        values = [left(theta) for theta in angles]
        for i in range(1, len(angles)):
            if values[i] < values[i - 1] and values[i] > 0:
                continue
            low, high = angles[max(i - 2, 0)], angles[i]
            turns = falling(high) > 0
            found = [_root(left, low, high)] if values[i] <= 0 else []
            found += [_root(falling, low, found[0] if found else high)] if turns and not found else []
            return min(found)
        return most


def _root(function: Callable[[Real], Real], low: Real, high: Real) -> Real:
    """The root of a function that changes its sign between two places."""
    import mpmath

    return mpmath.findroot(function, (low, high), solver="anderson", tol=mpmath.mpf(10) ** -140, verify=False)
