"""Images of points where rays are no linear function of the place: in curved camera triangles, and in all that bend the
rays of an eye about interpolated normals.

The triangle is cut into parts whose rays are nearly linear. Each part's cubic gives starts, and Newton's method the
images of the true rays.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras import three_rays
from mpcam.cameras.triangle_nodes import mixed
from mpcam.math import Array, Vector, cross, detach, dot, epsilon, library, norm, normalize, plain, vector, where

PARTS = 4  # along each side of a camera triangle
IMAGES = 4
WIDER = 2.0
"""Starts are looked for in a larger triangle around each part, whose linear rays miss the true ones a little."""
LOOSE = 3.0
"""Points are tried in a part if they lie within its cone of rays, widened so many times."""
_STEPS = 12

Bend = Callable[[Vector, Vector], tuple[Vector, Array]]
Image = tuple[Array, Array, Array, Array]


def project(bend: Bend, v: tuple[Vector, ...], n: tuple[Vector, ...], q: Vector) -> list[Image]:
    """Images of points q in camera triangles with nodes v and normals n there: weights 2 and 3, distance, validity.

    v, n: three vectors, or six (see `triangle_nodes`). All components first, broadcast against each other. bend: origin
    and normal, or what else is at the nodes, to direction and validity. At most
    IMAGES of them are found, in no order; two that nearly coincide (at a fold) may count as one.
    """
    kind = library(*q, *v[0])
    if kind == "numpy":
        return _compressed(bend, v, n, q)
    if kind == "jax":
        return _stacked(bend, v, n, q)
    found = _nothing(0.0 * (q[0] + v[0][0]))
    for corners in _parts():
        found = _merged(found, _in_part(bend, corners, v, n, q))
    return found


def _compressed(bend: Bend, v: tuple[Vector, ...], n: tuple[Vector, ...], q: Vector) -> list[Image]:
    """The same for NumPy, with only those points in each part that may have an image there."""
    shape = np.broadcast_shapes(*(np.shape(part) for one in (*v, *n, q) for part in one))

    def flat(one: Vector) -> np.ndarray:
        return np.stack([np.broadcast_to(part, shape).ravel() for part in one])

    v, n, q = tuple(map(flat, v)), tuple(map(flat, n)), flat(q)
    found = [tuple(part.copy() for part in image) for image in _nothing(np.zeros(q.shape[1]))]
    for corners in _parts():
        chosen = np.flatnonzero(_may_pass(_rays(bend, corners, v, n, 0.0 * q[0]), q))
        if len(chosen) == 0:
            continue
        places, normals = (tuple(x[:, chosen] for x in one) for one in (v, n))
        before = [tuple(part[chosen] for part in image) for image in found]
        after = _merged(before, _in_part(bend, corners, places, normals, q[:, chosen]))
        for image, values in zip(found, after, strict=True):
            for part, value in zip(image, values, strict=True):
                part[chosen] = value
    return [tuple(part.reshape(shape) for part in image) for image in found]  # pyright: ignore[reportReturnType]


def _stacked(bend: Bend, v: tuple[Vector, ...], n: tuple[Vector, ...], q: Vector) -> list[Image]:
    """The same for JAX, all parts along a leading axis: a sixteenth of the code to compile."""
    found = _nothing(0.0 * (q[0] + v[0][0]))
    wide = (-1, *(1,) * found[0][0].ndim)
    corners = np.moveaxis(np.array(_parts()), 0, -1)  # corner, weight, part
    images = _in_part(bend, [[weight.reshape(wide) for weight in corner] for corner in corners], v, n, q)
    for part in range(len(_parts())):
        found = _merged(found, [(a[part], b[part], c[part], d[part]) for a, b, c, d in images])
    return found


def _may_pass(rays: list[tuple[Vector, Vector, Array]], q: Vector) -> Array:
    """Whether points lie within the cone around three rays, widened."""
    center = sum(ray[0] for ray in rays) / 3.0
    axis = normalize(sum(ray[1] for ray in rays))
    reach, spread = (np.max([norm(ray[k] - one) for ray in rays], axis=0) for k, one in ((0, center), (1, axis)))
    reach, spread = LOOSE * reach, np.minimum(LOOSE * spread + 0.01, 2.0)
    away = q - center
    a, b, c = 1.0 - spread**2, dot(away, axis) + reach * spread, dot(away, away) - reach**2
    bent = rays[0][2] & rays[1][2] & rays[2][2]  # where some rays do not pass, the cone means little
    return (c <= 0) | (a <= 0) | ((b > 0) & (b * b >= a * c)) | ~bent


def _rays(bend: Bend, places: Any, v: Any, n: Any, blank: Array) -> list[tuple[Vector, Vector, Array]]:
    return [pixel_ray(bend, v, n, blank + second, blank + third) for second, third in places]


def pixel_ray(bend: Bend, v: Any, n: Any, second: Array, third: Array) -> tuple[Vector, Vector, Array]:
    """Origin, unit direction and validity at weights of corners 2 and 3."""
    origin, normal = (vector(*(mixed([node[k] for node in c], second, third) for k in range(3))) for c in (v, n))
    direction, valid = bend(origin, normal)
    return origin, normalize(direction), valid


def _in_part(bend: Bend, corners: Any, v: Any, n: Any, q: Vector) -> list[Image]:
    """Images that are found from the linear rays between three places of a camera triangle."""
    rays = _rays(bend, corners, v, n, 0.0 * (q[0] + v[0][0]))
    origins, ways = (_widened([one[k] for one in rays]) for k in range(2))
    starts = three_rays.project(origins, ways, q)
    places = _widened([np.array(corner) for corner in corners])
    found = []
    for start in starts:
        weights = (start.w1, start.w2, 1.0 - start.w1 - start.w2)
        second, third = (detach(sum(w * plain(p[i]) for w, p in zip(weights, places, strict=True))) for i in range(2))
        *image, good = refined(bend, v, n, q, second, third, detach(start.c))
        found.append((*image, good & start.valid))
    return found


def refined(
    bend: Bend, v: Any, n: Any, q: Vector, second: Array, third: Array, distance: Array, steps: int = _STEPS
) -> Image:
    """Newton's method on origin + distance direction = q; weights, distance, and whether they are an image.

    The derivative is that of the last step, which is the implicit-function theorem's.
    """
    small = epsilon(second)
    scale, valid, miss = second, second > 0, q
    for step in range(steps):
        last = step == steps - 1
        if last:
            second, third, distance = detach(second), detach(third), detach(distance)
        origin, direction, valid = pixel_ray(bend, v, n, second, third)
        miss = vector(*(origin[k] + distance * direction[k] - q[k] for k in range(3)))
        h = 0.3 * small**0.5
        columns = []
        for aside in (pixel_ray(bend, v, n, second + h, third), pixel_ray(bend, v, n, second, third + h)):
            moved = [aside[0][k] - origin[k] + distance * (aside[1][k] - direction[k]) for k in range(3)]
            columns.append(vector(*(detach(part / h) for part in moved)))
        a, b, c = *columns, detach(direction)
        across = cross(b, c)
        volume = dot(a, across)
        usable = abs(volume) > 0.1 * small * norm(a) * norm(b)
        inverse = where(usable, 1.0 / where(usable, volume, 1.0), 0.0)
        shift = dot(miss, across) * inverse, dot(miss, cross(c, a)) * inverse, dot(miss, cross(a, b)) * inverse
        if not last:  # not out of sight in one step: the linear part's start is near
            size = abs(shift[0]) + abs(shift[1])
            damp = where(size > 0.3, 0.3 / (size + 1e-30), 1.0)
            shift = tuple(damp * part for part in shift)
        second, third, distance = second - shift[0], third - shift[1], distance - shift[2]
        scale = abs(distance) + norm(vector(*(origin[k] - q[k] for k in range(3))))
    edge = -30.0 * small**0.75
    inside = (second >= edge) & (third >= edge) & (1.0 - second - third >= edge)
    good = valid & inside & (distance >= 0) & (norm(miss) <= 30.0 * small**0.75 * scale)
    return second, third, distance, good


def _widened(corners: list[Vector]) -> tuple[Vector, ...]:
    """The corners of the larger triangle, by going on linearly."""
    a, b, c = corners
    center = (a + b + c) * (1.0 / 3.0)
    return tuple(center + WIDER * (corner - center) for corner in (a, b, c))


def _parts() -> list[tuple[tuple[float, float], ...]]:
    """Weights 2 and 3 of the corners of each part."""
    step, parts = 1.0 / PARTS, []
    for j in range(PARTS):
        for i in range(PARTS - j):
            a, b, c, d = ((i + x, j + y) for x, y in ((0, 0), (1, 0), (0, 1), (1, 1)))
            parts.append((a, b, c))
            if i + j < PARTS - 1:
                parts.append((d, c, b))
    return [tuple((x * step, y * step) for x, y in part) for part in parts]


def _nothing(blank: Array) -> list[Image]:
    return [(blank, blank, blank, blank > 1.0) for _ in range(IMAGES)]


def _merged(found: list[Image], images: list[Image]) -> list[Image]:
    """The list with those of more images that it does not hold yet, each in the first free place."""
    for *values, left in images:
        near = 10.0 * epsilon(values[0]) ** 0.5
        for second, third, _, there in found:
            same = (abs(second - values[0]) < near) & (abs(third - values[1]) < near)
            left = left & ~(there & same)
        after = []
        for slot in found:
            put = left & ~slot[3]
            after.append((*(where(put, new, old) for new, old in zip(values, slot, strict=False)), slot[3] | put))
            left = left & ~put
        found = after
    return found
