"""The definition of general linear cameras at 50 digits: areas of the generators' triangle in the plane of a point.

A point P at depth z is the combination of the points T1, T2, T3 where the generators meet that plane; its weights are
ratios of areas (Yu et al. 2009, eq. 5), and its pixel the same combination of the generators' places in the image.
"""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.general_linear import GeneralLinear
from mpcam.stress.exact import DIGITS

Real = Any  # a number of mpmath


class Image(NamedTuple):
    """pixel: (u, v). depth: along the ray. area: twice that of the generators' triangle. weights: of the generators."""

    pixel: tuple[Real, Real]
    depth: Real
    area: Real
    weights: tuple[Real, Real, Real]


class Truth:
    """One camera, in its own frame. rays (3, 4) and places (3, 2), pixels: of its generators."""

    def __init__(self, camera: GeneralLinear):
        import mpmath

        self.rays = np.asarray(camera.rays, np.float64)
        image = self.rays[:, 2:] if camera.image is None else np.asarray(camera.image, np.float64)
        self.places = image * [camera.width, camera.height]
        with mpmath.workdps(DIGITS):
            self._rays = [[mpmath.mpf(x) for x in row] for row in self.rays]
            sides = [mpmath.mpf(camera.width), mpmath.mpf(camera.height)]
            self._places = [[mpmath.mpf(x) * side for x, side in zip(row, sides, strict=True)] for row in image]

    def image(self, point: Any) -> Image | None:
        """The image of a point of floats, whatever its sign of z; None in the plane of a slit."""
        import mpmath

        x, y, z = (mpmath.mpf(float(value)) for value in point)
        corners = [(u + z * sigma, v + z * tau) for sigma, tau, u, v in self._rays]
        area = _area(*corners)
        if area == 0:
            return None
        weights = (_area((x, y), corners[1], corners[2]) / area, _area(corners[0], (x, y), corners[2]) / area)
        weights = (*weights, 1 - weights[0] - weights[1])
        pixel = tuple(sum(w * place[k] for w, place in zip(weights, self._places, strict=True)) for k in range(2))
        slopes = [sum(w * ray[k] for w, ray in zip(weights, self._rays, strict=True)) for k in range(2)]
        depth = abs(z) * mpmath.sqrt(slopes[0] ** 2 + slopes[1] ** 2 + 1)
        return Image(pixel, depth, area, weights)  # pyright: ignore[reportArgumentType]

    def condition(self, points: np.ndarray, areas: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """By how many pixels, and by how much depth, errors of one part in all numbers change the images of points.

        points (N, 3), areas (N,) and weights (N, 3) as of `image`. The numbers are those of the points, of the
        generators and of their places.
        """
        x, y, z = points.T
        corner = self.rays[:, 2:, None] + z * self.rays[:, :2, None]
        size = np.abs(self.rays[:, 2:, None]) + np.abs(z * self.rays[:, :2, None])
        share = np.abs(weights).T
        # Errors of the two equations, sum of weights times corners = point, and what they do to the weights.
        off = [np.abs(value) + (share * size[:, k]).sum(0) for k, value in enumerate((x, y))]
        moved = np.zeros((3, len(points)))
        for i in range(3):
            edge = np.abs(corner[(i + 1) % 3] - corner[(i + 2) % 3])
            moved[i] = (edge[1] * off[0] + edge[0] * off[1]) / np.abs(areas)
        pixels = np.stack([((moved + 2 * share) * np.abs(self.places[:, k, None])).sum(0) for k in range(2)]).sum(0)
        slopes = np.stack([((moved + 2 * share) * np.abs(self.rays[:, k, None])).sum(0) for k in range(2)]).sum(0)
        return pixels, np.abs(z) * (1.0 + slopes)

    def ray(self, pixel: Any) -> tuple[list[Real], list[Real]]:
        """(u, v, 0) and (sigma, tau, 1) of the ray of a pixel, not brought to length 1, and their sizes."""
        import mpmath

        place = [mpmath.mpf(float(value)) for value in pixel]
        area = _area(*self._places)
        weights = [
            _area(place, self._places[1], self._places[2]) / area,
            _area(self._places[0], place, self._places[2]) / area,
        ]
        weights.append(1 - weights[0] - weights[1])
        found = [sum(w * ray[k] for w, ray in zip(weights, self._rays, strict=True)) for k in range(4)]
        sizes = [sum(abs(w * ray[k]) for w, ray in zip(weights, self._rays, strict=True)) for k in range(4)]
        return found, sizes


def _area(a: Any, b: Any, c: Any) -> Real:
    """Twice the signed area of a triangle in the plane."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
