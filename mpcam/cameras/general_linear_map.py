"""The affine map from a pixel to the ray of a general linear camera, and the equations that invert it."""

from typing import Any, NamedTuple

from mpcam.cameras.types import Projection
from mpcam.math import (
    Array,
    Vector,
    absolute,
    detach,
    epsilon,
    isfinite,
    maximum,
    minimum,
    norm,
    plain,
    sqrt,
    vector,
    where,
)

BEYOND = 1e30
"""A depth that no triangle reaches."""
_UNSURE = 4.0  # roundings of the determinant that a point's image has to be sure of


class LinearMap(NamedTuple):
    """sigma, tau, u and v as affine functions of a pixel: how each changes with x, with y, and its value at (0, 0)."""

    sigma_x: Array
    sigma_y: Array
    sigma: Array
    tau_x: Array
    tau_y: Array
    tau: Array
    u_x: Array
    u_y: Array
    u: Array
    v_x: Array
    v_y: Array
    v: Array

    def at(self, x: Array, y: Array) -> tuple[Array, Array, Array, Array]:
        """sigma, tau, u and v of a pixel."""
        return (
            self.sigma + (self.sigma_x * x + self.sigma_y * y),
            self.tau + (self.tau_x * x + self.tau_y * y),
            self.u + (self.u_x * x + self.u_y * y),
            self.v + (self.v_x * x + self.v_y * y),
        )

    def coefficients(self, point: Vector) -> "Coefficients":
        """The equations for the pixel of a point, all affine in the point."""
        x, y, z = point
        return Coefficients(
            self.u_x + z * self.sigma_x,
            self.u_y + z * self.sigma_y,
            self.v_x + z * self.tau_x,
            self.v_y + z * self.tau_y,
            (x - self.u) - z * self.sigma,
            (y - self.v) - z * self.tau,
            z,
        )

    def solve(self, coefficients: "Coefficients") -> Projection:
        """The image of the point with these coefficients (Yu et al. 2009, eq. 5).

        Valid from z = 0 on, but in planes of slits, where rounding decides about the image, or there is none.
        """
        z = coefficients.z
        valid = (z >= 0) & isfinite(coefficients.right) & isfinite(coefficients.below) & isfinite(z)
        a, b, c, d, right, below, z = (where(valid, part, 1.0) for part in coefficients)
        # Near a center all entries are tiny, and float32 would lose their products.
        largest = maximum(maximum(absolute(a), absolute(b)), maximum(absolute(c), absolute(d)))
        unit = 1.0 / detach(where(largest > 0, largest, 1.0))
        a, b, c, d, right, below = (unit * part for part in (a, b, c, d, right, below))
        determinant = a * d - b * c
        sure = absolute(determinant) > _UNSURE * epsilon(z) * self._doubt(z, unit, a, b, c, d)
        inverse = 1.0 / where(sure, determinant, 1.0)
        px, py = (d * right - b * below) * inverse, (a * below - c * right) * inverse
        sure = sure & valid & isfinite(px) & isfinite(py)
        px, py = where(sure, px, 0.0), where(sure, py, 0.0)
        sigma, tau, _, _ = self.at(px, py)
        depth = where(sure, z * norm(vector(sigma, tau, 1.0 + 0.0 * sigma)), 0.0)
        return Projection(vector(px, py), depth, sure)

    def _doubt(self, z: Array, unit: Array, *entries: Array) -> Array:
        """What one rounding of each of the four entries, in some unit, can change in their determinant."""
        a, b, c, d = (absolute(detach(entry)) for entry in entries)
        sizes = [unit * size for size in self.sizes(detach(z))]
        return sizes[0] * d + a * sizes[3] + sizes[1] * c + b * sizes[2]

    def slits(self) -> tuple[Array, Array]:
        """Depths of the slits that lie before the plane z = 0, rising; 1e30 where there is none."""
        A = self.sigma_x * self.tau_y - self.sigma_y * self.tau_x
        C = self.u_x * self.v_y - self.u_y * self.v_x
        B = (self.u_x * self.tau_y + self.sigma_x * self.v_y) - (self.u_y * self.tau_x + self.sigma_y * self.v_x)
        discriminant = B * B - 4.0 * A * C
        real = discriminant >= 0
        root = sqrt(where(real, discriminant, 0.0))
        q = -0.5 * (B + where(B < 0, -root, root))
        found = []
        for top, bottom in ((q, A), (C, q)):
            z = top / where(bottom != 0, bottom, 1.0)
            found.append(where(real & (bottom != 0) & (z > 0) & (z < BEYOND), z, BEYOND))
        return minimum(*found), maximum(*found)

    def sizes(self, z: Array) -> list[Array]:
        """Of each of the four entries of the equations, what its terms amount to: their rounding is a part of it."""
        pairs = (
            (self.u_x, self.sigma_x),
            (self.u_y, self.sigma_y),
            (self.v_x, self.tau_x),
            (self.v_y, self.tau_y),
        )
        return [absolute(place) + absolute(z) * absolute(slope) for place, slope in pairs]


class Coefficients(NamedTuple):
    """Of the two equations a x + b y = right and c x + d y = below for the pixel of a point, and the point's depth."""

    a: Array
    b: Array
    c: Array
    d: Array
    right: Array
    below: Array
    z: Array


def linear_numbers(rays: Any, places: Any, width: int, height: int) -> list[Array]:
    """The twelve numbers of a `LinearMap`, of generators whose places in the image are given in widths and heights."""
    (x1, y1), (x2, y2), (x3, y3) = ((plain(row[0]), plain(row[1])) for row in places)
    right, below = (x2 - x1, y2 - y1), (x3 - x1, y3 - y1)
    area = right[0] * below[1] - right[1] * below[0]
    numbers: list[Array] = []
    for k in range(4):
        first, second, third = (plain(row[k]) for row in rays)
        across, down = second - first, third - first
        x = (across * below[1] - down * right[1]) / area
        y = (down * right[0] - across * below[0]) / area
        numbers += [x / width, y / height, first - (x * x1 + y * y1)]
    return numbers
