"""The affine map from a pixel to the ray of a general linear camera, and the equations that invert it."""

from typing import Any, NamedTuple

from mpcam.math import Array, absolute, plain


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

    def equations(self, x: Array, y: Array, z: Array) -> tuple[tuple[Array, Array], ...]:
        """Rows and right sides of the two equations for the pixel of a point: all linear in the point."""
        rows = []
        for (place, slope), end in zip(
            (((self.u_x, self.u_y), (self.sigma_x, self.sigma_y)), ((self.v_x, self.v_y), (self.tau_x, self.tau_y))),
            ((x - self.u) - z * self.sigma, (y - self.v) - z * self.tau),
            strict=True,
        ):
            first, second = place[0] + z * slope[0], place[1] + z * slope[1]
            rows.append((first, second, end))
        (a, b, right), (c, d, below) = rows
        return (a, b), (c, d), (right, below)

    def sizes(self, z: Array) -> list[Array]:
        """Of each of the four entries of the equations, what its terms amount to: their rounding is a part of it."""
        pairs = (
            (self.u_x, self.sigma_x),
            (self.u_y, self.sigma_y),
            (self.v_x, self.tau_x),
            (self.v_y, self.tau_y),
        )
        return [absolute(place) + absolute(z) * absolute(slope) for place, slope in pairs]


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
