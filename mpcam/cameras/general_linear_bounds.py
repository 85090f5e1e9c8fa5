"""Boxes around the curved images of triangles in a general linear camera.

Between two planes of slits the image is a ratio of quadratic forms over the triangle (Yu et al. 2009, eq. 5), with a
denominator of one sign. Over the convex hull of some points, such a ratio is a mean of its values for pairs of them
(its polar forms), so that the smallest and the largest of these hold it.
"""

from mpcam.cameras.general_linear_map import BEYOND, LinearMap
from mpcam.cameras.types import Box
from mpcam.math import Array, Vector, absolute, epsilon, isfinite, maximum, minimum, vector, where

FAR = 1e9
"""Pixels; stands for infinity in boxes, so that no arithmetic on boxes makes NaN."""

_LOOSE = 0.25  # of these roundings, by which values are widened
_SLACK = 16.0  # roundings that the sign of a denominator, or of a numerator over a slit, has to be sure of


def box(linear: LinearMap, a: Vector, b: Vector, c: Vector) -> Box:
    """Box of the part with z >= 0; unbounded sides, of triangles that meet the plane of a slit, are at +-1e9 pixels."""
    finite = isfinite(sum(corner[i] for corner in (a, b, c) for i in range(3)))
    a, b, c = (vector(*(where(finite, corner[i], 1.0) for i in range(3))) for corner in (a, b, c))
    zero = 0.0 * a[2]
    first, second = (zero + z for z in linear.slits())
    ends = [(zero, first), (first, second), (second, zero + BEYOND)]
    low, high, valid = [zero + FAR, zero + FAR], [zero - FAR, zero - FAR], finite & (zero > 1.0)
    for near, far in ends:
        seen = (maximum(maximum(a[2], b[2]), c[2]) >= near) & (minimum(minimum(a[2], b[2]), c[2]) <= far) & (far > near)
        part_low, part_high = _between(linear, (a, b, c), near, far)
        for i in range(2):
            low[i] = where(seen, minimum(low[i], part_low[i]), low[i])
            high[i] = where(seen, maximum(high[i], part_high[i]), high[i])
        valid = valid | (finite & seen)
    bounded = [maximum(minimum(side, FAR), -FAR) for side in (*low, *high)]
    return Box(vector(*bounded[:2]), vector(*bounded[2:]), valid)


def _between(
    linear: LinearMap, corners: tuple[Vector, Vector, Vector], near: Array, far: Array
) -> tuple[list[Array], list[Array]]:
    """Lowest and highest pixels of the part of a triangle between two depths, without a slit between them."""
    points = [(corner, (corner[2] >= near) & (corner[2] <= far)) for corner in corners]
    for k in range(3):
        p, q = corners[k], corners[(k + 1) % 3]
        for z in (near, far):
            crosses = (p[2] < z) != (q[2] < z)
            part = (z - p[2]) / where(crosses, q[2] - p[2], 1.0)
            part = where(crosses, part, 0.0)
            across = [p[i] + part * (q[i] - p[i]) for i in range(2)]
            points.append((vector(*across, where(crosses, z, p[2])), crosses))
    shapes = [_Terms(linear, point) for point, _ in points]
    middle = 0.5 * (near + minimum(far, maximum(maximum(corners[0][2], corners[1][2]), corners[2][2])))
    sign = where(_Terms(linear, vector(0.0 * middle, 0.0 * middle, middle)).determinant() < 0, -1.0, 1.0)
    low, high = [FAR + 0.0 * near] * 2, [-FAR + 0.0 * near] * 2
    for i, first in enumerate(shapes):
        for j in range(i, len(shapes)):
            both = points[i][1] & points[j][1]
            bottom, doubt, tops = first.paired(shapes[j])
            bottom, doubt = sign * bottom, _SLACK * epsilon(doubt) * doubt
            regular = bottom > doubt
            # A slit of the plane that bounds the part, or two ends so far apart that nothing is known between them.
            lost = bottom < -doubt
            inverse = 1.0 / where(regular, bottom, 1.0)
            for k, (top, top_doubt) in enumerate(tops):
                top, unsure = sign * top, _SLACK * epsilon(top_doubt) * top_doubt
                value = top * inverse
                # What a few roundings of both can change, next to a slit.
                loose = _LOOSE * (absolute(value) * doubt + unsure) * inverse
                upward = where(lost | (top >= -unsure), FAR, -FAR)
                downward = where(lost | (top <= unsure), -FAR, FAR)
                high[k] = where(both, maximum(high[k], where(regular, value + loose, upward)), high[k])
                low[k] = where(both, minimum(low[k], where(regular, value - loose, downward)), low[k])
    return low, high


class _Terms:
    """The entries of the equations for a point, from which ratios for pairs of points are made."""

    def __init__(self, linear: LinearMap, point: Vector):
        self.a, self.b, self.c, self.d, self.right, self.below, _ = linear.coefficients(point)
        z = absolute(point[2])
        self.sizes = linear.sizes(z)
        self.ends = [
            absolute(point[0]) + absolute(linear.u) + z * absolute(linear.sigma),
            absolute(point[1]) + absolute(linear.v) + z * absolute(linear.tau),
        ]

    def determinant(self) -> Array:
        return self.a * self.d - self.b * self.c

    def paired(self, other: "_Terms") -> tuple[Array, Array, list[tuple[Array, Array]]]:
        """Polar forms with another point: the denominator, its size, and both numerators with theirs."""
        bottom = 0.5 * (self.a * other.d + other.a * self.d - self.b * other.c - other.b * self.c)
        across = 0.5 * (self.d * other.right + other.d * self.right - self.b * other.below - other.b * self.below)
        down = 0.5 * (self.a * other.below + other.a * self.below - self.c * other.right - other.c * self.right)
        (a, b, c, d), (e, f, g, h) = self.sizes, other.sizes
        (right, below), (along, under) = self.ends, other.ends
        size = 0.5 * (a * h + e * d + b * g + f * c)
        wide = 0.5 * (d * along + h * right + b * under + f * below)
        deep = 0.5 * (a * under + e * below + c * along + g * right)
        return bottom, size, [(across, wide), (down, deep)]
