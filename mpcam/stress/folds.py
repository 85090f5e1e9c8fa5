"""Where a distorted image folds, by its published formula at 50 digits, azimuth by azimuth."""

import functools
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polymul, polysub

from mpcam.cameras.calibrated import FARTHEST
from mpcam.cameras.folds import WIDEST
from mpcam.stress.exact import Real

_AZIMUTHS = 256
_RADII = np.concatenate([[0.0], np.geomspace(1e-12, 1, 4000)])
_TOLERANCE = 1e-100  # of squares
_NEAR = 1e-3  # parts within which a float64, or a rim between two azimuths, does not tell on which side a place is


class Folds:
    """The plane z = 1 and its image in focal lengths, in numbers of mpmath; k: k1 to k6, p: p1 and p2.

    Along each azimuth the domain ends at the first zero of the derivative's determinant, or where the image, the plane
    or max_angle ends.
    """

    def __init__(self, k: list[Real], p: list[Real], max_angle: float):
        import mpmath

        self.k, self.p, self.max_angle = k, p, max_angle
        self._floats = [float(x) for x in k], [float(x) for x in p]
        above, below = [mpmath.mpf(1), *k[:3]], [mpmath.mpf(1), *k[3:]]
        ends = [mpmath.mpf(WIDEST)] + ([mpmath.tan(mpmath.mpf(max_angle))] if max_angle < np.pi / 2 else [])
        ends += [mpmath.sqrt(s) for s in _positive_roots(below)]
        # The image is widest towards (p2, p1): there it is r R + 3 |p| r^2.
        far = polymul([mpmath.mpf(FARTHEST), 0, -3 * mpmath.hypot(*p)], _even(below))
        ends += _positive_roots(polysub(far, polymul([0, 1], _even(above))))
        ends += [mpmath.sqrt(s) for s in _positive_roots(polysub(polymul([mpmath.mpf(FARTHEST)], below), above))]
        if not any(p):
            slope = polysub(polymul(_derived(above), below), polymul(above, _derived(below)))
            ends += [mpmath.sqrt(s) for s in _positive_roots(polysub(polymul(above, below), polymul([0, -2], slope)))]
        self.end = min(ends)
        self._radii = float(self.end) * _RADII

    def image(self, x: Real, y: Real) -> tuple[Real, Real]:
        """The image of a point."""
        return distorted(self.k, self.p, x, y)

    def radius(self, x: Real, y: Real) -> Real:
        """Where the domain ends along a unit vector."""
        import mpmath

        a, b = float(x), float(y)
        low, high = self._bracket(a, b)
        if not high:
            return self.end
        while low < (middle := 0.5 * (low + high)) < high:
            inside = _determinant(*self._floats, middle * a, middle * b) > 0
            low, high = (middle, high) if inside else (low, middle)

        def determinant(r: Real) -> Real:
            return _determinant(self.k, self.p, r * x, r * y)

        near = (mpmath.mpf(low), low * (1 + mpmath.mpf(10) ** -12))
        return mpmath.findroot(determinant, near, solver="secant", tol=_TOLERANCE, verify=False)

    def beyond(self, x: Real, y: Real) -> Real:
        """By how many parts a point lies outside, negative inside."""
        import mpmath

        r = mpmath.hypot(x, y)
        if r == 0:
            return mpmath.mpf(-1)
        low, high = self._bracket(float(x / r), float(y / r))
        for end in (low, high) if high else ():
            if (r > end) == (end == high) and abs(r / end - 1) > _NEAR:
                return r / end - 1
        return r / self.radius(x / r, y / r) - 1

    def outside(self, u: Real, v: Real) -> Real:
        """By how many parts an image lies outside of that of the domain, negative inside."""
        import mpmath

        length = mpmath.hypot(u, v)
        if length == 0:
            return mpmath.mpf(-1)
        toward, azimuth, rim = self._rim
        at = float(mpmath.atan2(v, u))
        after = int(np.searchsorted(toward, at))
        near = length / rim[after - 1], length / rim[after]
        if min(near) > 1 + _NEAR or max(near) < 1 - _NEAR:
            return near[0] - 1

        def across(phi: Real) -> Real:
            a, b = self.image(*self.at_rim(phi))
            return (a * v - b * u) / length

        start = mpmath.mpf(float(np.interp(at, toward, azimuth)))
        phi = mpmath.findroot(across, (start, start + 1e-6), solver="secant", tol=_TOLERANCE, verify=False)
        return length / mpmath.hypot(*self.image(*self.at_rim(phi))) - 1

    def at_rim(self, phi: Real) -> tuple[Real, Real]:
        """The point at the end of the domain, of an azimuth in radians."""
        import mpmath

        x, y = mpmath.cos(phi), mpmath.sin(phi)
        radius = self.radius(x, y)
        return radius * x, radius * y

    def conditions(self) -> tuple[float, float]:
        """By how many parts one part in k, p and r moves the ends of the domain, and those of its image."""
        import mpmath

        size = mpmath.hypot(*self.p) or mpmath.mpf(1)
        toward = (self.p[1] / size, self.p[0] / size) if any(self.p) else (mpmath.mpf(1), mpmath.mpf(0))
        found = [self._conditions(sign * toward[0], sign * toward[1]) for sign in (1, -1)]
        return max(edge for edge, _ in found), max(rim for _, rim in found)

    def _conditions(self, x: Real, y: Real) -> tuple[float, float]:
        """The same along a unit vector, where the determinant or the image decides where the domain ends."""
        import mpmath

        numbers, step = [self.radius(x, y), *self.k, *self.p], mpmath.mpf(10) ** -25

        def width(r: Real, *numbers: Real) -> Real:
            return mpmath.hypot(*distorted(numbers[:6], numbers[6:], r * x, r * y))

        def fold(r: Real, *numbers: Real) -> Real:
            return _determinant(numbers[:6], numbers[6:], r * x, r * y)

        def moved(function: Any) -> list[Real]:
            """What one part in r, and in each of the numbers, makes of a function."""
            here = function(*numbers)
            each = [[*numbers[:i], number * (1 + step), *numbers[i + 1 :]] for i, number in enumerate(numbers)]
            return [abs(function(*several) - here) / step for several in each]

        by_r, *others = moved(fold if abs(fold(*numbers)) < 1e-20 else width)
        ends_by_numbers = self.end not in (WIDEST, mpmath.tan(mpmath.mpf(self.max_angle)))
        edge = 1 + (sum(others) / by_r if ends_by_numbers or self.radius(x, y) < self.end else 0)
        by_r, *others = moved(width)
        return float(edge), float(1 + (sum(others) + by_r * edge) / width(*numbers))

    @functools.cached_property
    def _rim(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Azimuths of images at the end of the domain, rising; those of their points; and the images' radii."""
        azimuth = np.linspace(-2 * np.pi, 2 * np.pi, _AZIMUTHS + 1)
        half = [self.image(*self.at_rim(float(phi))) for phi in azimuth[: _AZIMUTHS // 2]]
        images = np.array([[float(c) for c in image] for image in (*half, *half, half[0])])
        toward = np.unwrap(np.arctan2(images[:, 1], images[:, 0]))
        return toward - 2 * np.pi * round((toward[_AZIMUTHS // 2]) / (2 * np.pi)), azimuth, np.hypot(*images.T)

    def _bracket(self, x: float, y: float) -> tuple[float, float]:
        """Radii between which the determinant first changes its sign along a unit vector; 0, 0 if it does not."""
        r = self._radii
        negative = _determinant(*self._floats, r * x, r * y) <= 0 if any(self.p) else np.zeros(1, bool)
        first = int(np.argmax(negative))
        return (float(r[first - 1]), float(r[first])) if negative[first] else (0.0, 0.0)


def distorted(k: Any, p: Any, x: Any, y: Any) -> tuple[Any, Any]:
    """OpenCV's formula."""
    (p1, p2), s = p, x * x + y * y
    radial = _ratio(k, s)[0]
    u = x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x)
    return u, y * radial + p1 * (s + 2 * y * y) + 2 * p2 * x * y


def _ratio(k: Any, s: Any) -> tuple[Any, Any]:
    """R and R'."""
    k1, k2, k3, k4, k5, k6 = k
    above, below = 1 + s * (k1 + s * (k2 + s * k3)), 1 + s * (k4 + s * (k5 + s * k6))
    slope = (k1 + s * (2 * k2 + 3 * s * k3)) * below - above * (k4 + s * (2 * k5 + 3 * s * k6))
    return above / below, slope / (below * below)


def _determinant(k: Any, p: Any, x: Any, y: Any) -> Any:
    """Of the derivative of the image."""
    value, slope = _ratio(k, x * x + y * y)
    p1, p2 = p
    xx = value + 2 * slope * x * x + 2 * p1 * y + 6 * p2 * x
    yy = value + 2 * slope * y * y + 6 * p1 * y + 2 * p2 * x
    xy = 2 * slope * x * y + 2 * p1 * x + 2 * p2 * y
    return xx * yy - xy * xy


def _positive_roots(coefficients: Any) -> list[Real]:
    """All of them that are real, of a polynomial with the constant first."""
    import mpmath

    coefficients = list(coefficients)
    while coefficients and coefficients[-1] == 0:
        coefficients.pop()
    if len(coefficients) < 2:
        return []
    roots = mpmath.polyroots(coefficients, maxsteps=500, extraprec=500, asc=True)
    return [mpmath.re(r) for r in roots if abs(mpmath.im(r)) < 1e-40 * abs(r) and mpmath.re(r) > 0]


def _derived(coefficients: Any) -> list[Any]:
    return [i * c for i, c in enumerate(coefficients)][1:]


def _even(coefficients: Any) -> list[Any]:
    """A polynomial in s = r^2 as one in r."""
    return [c for value in coefficients for c in (value, 0)][:-1]
