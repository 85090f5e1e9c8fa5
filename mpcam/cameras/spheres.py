"""What lenses made of spheres and a pinhole share, in closed form both ways.

A unit direction (side, ahead), the sine and the cosine of its angle theta from the axis, appears from the center of the
last sphere along (across, height), of length d, and in the image at the radius r = side / (alpha d + (1 - alpha)
height). Sums stand for differences of nearly equal numbers wherever the formulas have them: for directions far from the
axis, and for parameters near those of simpler lenses.
"""

import dataclasses
from typing import Any

from mpcam.cameras.calibrated import FARTHEST, Calibrated
from mpcam.cameras.profiles import Profile
from mpcam.cameras.symmetric import within
from mpcam.math import Array, atan2, cos, epsilon, library, maximum, minimum, safe_sqrt, sin, sqrt, where

_ENDLESS = 1e15  # whose square float32 can hold


class Spheres(Calibrated):
    """f, f' and the inverse from how the last sphere sees directions, which a model supplies.

    Derived field, set at construction where alpha is a plain number: excess, 2 alpha - 1 before it is rounded to
    float32; the rim depends on it where alpha is near 1/2.
    """

    alpha: Any
    excess: Any

    def stretch(self) -> Array:
        """across / side."""
        return 1.0

    def elevation(self, side: Array, ahead: Array) -> Array:
        """Height of a unit direction over the last sphere's center."""
        raise TypeError(f"{type(self).__name__} must define elevation")

    def turning(self, side: Array, ahead: Array) -> Array:
        """ahead height + side^2: by how much (side, height) turns with theta, times its length squared."""
        raise TypeError(f"{type(self).__name__} must define turning")

    def seen_at(self, across: Array, height: Array) -> tuple[Array, Array]:
        """The unit direction that appears from the last sphere's center along a unit vector (across, height)."""
        raise TypeError(f"{type(self).__name__} must define seen_at")

    def radius_toward(self, side: Array, ahead: Array) -> Array:
        """r of a unit direction, focal lengths."""
        across, height, d = self._last_sphere(side, ahead)
        return side / self._below(side, across, height, d)

    def direction_at(self, r: Array) -> tuple[Array, Array]:
        """Unit direction of r, up to where r is largest."""
        scaled = minimum(r * self.stretch(), self._widest())
        return self.seen_at(*_on_unit_sphere(self.alpha, self._excess(), scaled))

    def radius_at(self, theta: Array) -> Array:
        """r = f(theta) in focal lengths, theta in radians from the axis."""
        return self.radius_toward(*_direction(theta))

    def slope_at(self, theta: Array) -> Array:
        """f'(theta)."""
        side, ahead = _direction(theta)
        across, height, d = self._last_sphere(side, ahead)
        below = self._below(side, across, height, d)
        rising = _mixed(1 - self.alpha, self.alpha, -self._excess(), across, height, d)
        return (self.turning(side, ahead) / below) * (rising / d) / below

    def angle_at(self, r: Array) -> Array:
        """theta of r, up to the end of the domain."""
        return minimum(atan2(*self.direction_at(r)), self.angle_limit())

    def largest_angle(self) -> Array:
        """Where r is largest, or FARTHEST, radians."""
        border = atan2(*self.border())
        far = atan2(*self.direction_at(FARTHEST + 0.0 * self.alpha))
        return where(self.radius_at(border) < FARTHEST, border, minimum(border, far))

    def border(self) -> tuple[Array, Array]:
        """Unit direction from which on r does not increase, or is infinite: at the height -w of the last sphere."""
        alpha, other = self.alpha, 1 - self.alpha
        larger = maximum(alpha, other)
        return self.seen_at(safe_sqrt(abs(self._excess())) / larger, -minimum(alpha, other) / larger)

    def _last_sphere(self, side: Array, ahead: Array) -> tuple[Array, Array, Array]:
        """across, height and their length d."""
        across, height = self.stretch() * side, self.elevation(side, ahead)
        return across, height, safe_sqrt(across * across + height * height)

    def _below(self, side: Array, across: Array, height: Array, d: Array) -> Array:
        """The denominator of r, at least side / (2 FARTHEST)."""
        below = _mixed(self.alpha, 1 - self.alpha, self._excess(), across, height, d)
        return maximum(below, 0.5 / FARTHEST * side)

    def _widest(self) -> Array:
        """Largest r of the unit sphere, 1 / sqrt(2 alpha - 1); a large number where there is none."""
        excess = self._excess()
        finite = excess > _ENDLESS**-2
        return where(finite, 1 / sqrt(where(finite, excess, 1.0)), _ENDLESS)

    def _excess(self) -> Array:
        return 2 * self.alpha - 1 if self.excess is None else self.excess

    def _profile(self, limit: Array, convex: bool = False) -> Profile:
        profile, rim = super()._profile(limit, convex), self._rim()

        def radius(theta: Array) -> Array:
            # Up to the rim f may rise by any amount between two neighboring angles near pi.
            return where(within(limit, theta), rim, self.radius_at(theta))

        return dataclasses.replace(profile, radius=radius, toward=self.radius_toward, direction=self.direction_at)

    def _derive(self) -> None:
        object.__setattr__(self, "excess", 2 * self.alpha - 1 if library(self.alpha) == "numpy" else None)


def _direction(theta: Array) -> tuple[Array, Array]:
    """Sine and cosine of an angle from 0 to pi, the sine above 0 where rounding takes the angle for more than pi."""
    side, ahead = sin(theta), cos(theta)
    return where(ahead < 0, maximum(side, epsilon(theta) ** 2), side), ahead


def _mixed(p: Array, q: Array, difference: Array, across: Array, height: Array, d: Array) -> Array:
    """p d + q height for p + q = 1, difference = p - q and d = |(across, height)|, without cancellation."""
    total = p * d + q * abs(height)
    squares = p * p * across * across + difference * height * height
    return where(height < 0, squares / where(total > 0, total, 1.0), total)


def _on_unit_sphere(alpha: Array, excess: Array, r: Array) -> tuple[Array, Array]:
    """Unit vector (across, height) with r = across / (alpha + (1 - alpha) height), the larger height of two."""
    other = 1 - alpha
    root = safe_sqrt(1 - excess * r * r)
    shrink = 1 / (1 + other * other * r * r)
    return r * (alpha + other * root) * shrink, (root - alpha * other * r * r) * shrink
