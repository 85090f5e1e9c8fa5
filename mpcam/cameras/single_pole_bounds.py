"""Boxes around what is moved away from a pole in a pinhole's image."""

from mpcam.cameras.pinhole import FAR
from mpcam.cameras.types import Box
from mpcam.math import Array, Vector, epsilon, maximum, minimum, norm, vector, where


def directions_from(
    focal: tuple[Array, Array], pole: tuple[Array, ...], corners: list[Vector]
) -> list[tuple[Array, Array]]:
    """Least and largest u, and v, of unit vectors from the pole to the images of the points of a triangle.

    pole: from the principal point, pixels. With z > 0 that vector has the direction of (fx x - pole_u z, fy y - pole_v
    z), which is linear in the point: so the directions are those of a triangle in the plane, the part behind the camera
    plane included, which can only make them more. Conservative for rounding too.
    """
    places, doubts, ends = [], [], [[1.0, -1.0], [1.0, -1.0]]
    for x, y, z in corners:
        parts = (focal[0] * x, pole[0] * z), (focal[1] * y, pole[1] * z)
        place = [first - second for first, second in parts]
        doubt = 4.0 * epsilon(x) * sum(abs(first) + abs(second) for first, second in parts)
        length = norm(vector(*place, 0.0 * place[0]))
        sure = length > doubt
        wide = where(sure, 2.0 * doubt / where(sure, length, 1.0), 2.0)
        for i in range(2):
            along = where(sure, place[i] / where(sure, length, 1.0), 0.0)
            ends[i] = [minimum(ends[i][0], along - wide), maximum(ends[i][1], along + wide)]
        places.append(place)
        doubts.append(doubt)
    for p, q in ((0, 1), (1, 2), (2, 0)):
        for i in range(2):
            ends[i] = _widened(ends[i], places[p], places[q], doubts[p], doubts[q], i)
    return [(maximum(low, -1.0), minimum(high, 1.0)) for low, high in ends]


def _widened(ends: list[Array], p: list[Array], q: list[Array], of_p: Array, of_q: Array, i: int) -> list[Array]:
    """The ends of coordinate i, where the edge from p to q crosses that axis on either side of the pole."""
    j = 1 - i
    crosses = (p[j] > 0) != (q[j] > 0)
    toward = p[i] * q[j] - q[i] * p[j]  # sign of the crossing point's coordinate, times that of q - p across
    toward = where(q[j] > p[j], toward, -toward)
    slack = of_p * (abs(q[0]) + abs(q[1])) + of_q * (abs(p[0]) + abs(p[1])) + of_p * of_q
    low = where(crosses & (toward <= slack), -1.0, ends[0])
    return [low, where(crosses & (toward >= -slack), 1.0, ends[1])]


def shifted_box(straight: Box, ends: list[tuple[Array, Array]], least: Array, most: Array) -> Box:
    """A pinhole's box, with its points moved by `least` to `most` pixels in directions whose u and v lie between ends.

    Sides at +-FAR, where a box has no end, stay there.
    """
    lows, highs = [], []
    for low, high, (left, right) in zip(straight.low, straight.high, ends, strict=True):
        down, up = low + minimum(least * left, most * left), high + maximum(least * right, most * right)
        lows.append(where(low <= -FAR, -FAR, maximum(minimum(down, FAR), -FAR)))
        highs.append(where(high >= FAR, FAR, maximum(minimum(up, FAR), -FAR)))
    return Box(vector(*lows), vector(*highs), straight.valid)
