"""Kernels of caustics: where photons land, how many points each triangle of them is dropped at, and their spreading.

Positions are in the frame of the receivers' device mesh (`DeviceMesh`), or turned into that of the eye, in its units.
"""

import functools
from typing import Any

from mpcam.backend import types

DENSITY = 2.0
"""Points that a landed triangle is dropped at, for each pixel that it covers."""
MOST_DROPS = 4096
"""Such points of one triangle at most."""
SLACK = 2.0
"""Pixels' widths that a photon may lie off the surface that the eye sees there."""
_BEND = 0.25
"""Sine of the angle at which neighboring photons no longer lie on one smooth surface."""
_SHADE = 2e-3
"""Part of the distance to the reflector that something must be nearer to the light to shade it."""
_STEP = (0.7548776662466927, 0.5698402909980532)
"""Two irrational steps, over the plastic number: points that are even whatever number of them there is."""


def _face(t: Any, vertices: Any, faces: Any, face: Any, active: Any) -> tuple[list[Any], Any]:
    """Corners and unit normals of faces; the normal is 0 for faces without area."""
    import drjit as dr

    numbers = dr.gather(t.Array3u, faces, t.UInt(dr.maximum(face, 0)), active)
    corners = [dr.gather(t.Array3f, vertices, number, active) for number in numbers]
    normal = dr.cross(corners[1] - corners[0], corners[2] - corners[0])
    squared = dr.squared_norm(normal)
    return corners, normal * dr.select(squared > 0, dr.rsqrt(squared), 0.0)


def _inside(corners: list[Any], normal: Any, place: Any) -> Any:
    """Whether places on the planes of triangles lie in them."""
    import drjit as dr

    a, b, c = corners
    sides = [dr.dot(dr.cross(q - p, place - p), normal) for p, q in ((a, b), (b, c), (c, a))]
    return (sides[0] >= 0) & (sides[1] >= 0) & (sides[2] >= 0)


@functools.cache
def land() -> Any:
    """Kernel from photons, and what the camera triangles' pixels see, to where they land: place, normal, receiver."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def land(rays: Any, triangle: Any, depth: Any, lit: Any, vertices: Any, faces: Any, objects: Any) -> Any:
        t = types()
        origin, along = rays["origin"], rays["along"]
        face, place, normal = t.Int(-1), t.Array3f(0.0), t.Array3f(0.0)
        for k, texel in enumerate(rays["texels"]):
            some = (texel >= 0) & (face < 0)
            number = t.UInt(dr.maximum(texel, 0))
            found = dr.select(some, dr.gather(t.Int, triangle, number, some), -1)
            some &= found >= 0
            corners, across = _face(t, vertices, faces, found, some)
            # The photon's own ray on the plane that the pixel's ray met: exact on flat receivers.
            towards = dr.dot(along, across)
            reach = dr.dot(corners[0] - origin, across) / towards
            if k == 0:
                near = dr.gather(t.Float, depth, number, some) / rays["unit"]
                sure = (abs(towards) > 0.02) & (abs(reach - near) <= 0.5 * near)
                there = origin + along * dr.select(sure, reach, near)
            else:
                # The nearest pixel sees nothing, but the photon may: a mirror that stands on its receiver.
                there = origin + along * reach
                some &= (reach > 0) & dr.isfinite(reach) & _inside(corners, across, there)
            face = dr.select(some, found, face)
            place, normal = dr.select(some, there, place), dr.select(some, across, normal)
        some = face >= 0
        some &= (lit >= rays["reach"] * (1.0 - _SHADE)) & (rays["flux"] > 0)
        receiver = dr.gather(t.Int, objects, t.UInt(dr.maximum(face, 0)), some)
        return place, normal, dr.select(some, receiver, -1)

    return land


@functools.cache
def surface() -> Any:
    """Kernel from the eye's hits to what photons need to know of the pixels, in the eye's frame."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def surface(seen: Any, angles: Any, pose: Any, rays: Any, vertices: Any, faces: Any, objects: Any) -> Any:
        t, (triangle, depth, direction) = types(), seen
        some = (triangle >= 0) & (triangle < rays["count"]) & (angles > 0)
        _, normal = _face(t, vertices, faces, triangle, some)
        normal = t.Array3f(*(sum(pose[3 * i + j] * normal[j] for j in range(3)) for i in range(3)))
        way = t.Array3f(*direction)
        cosine = dr.maximum(abs(dr.dot(normal, way)), 1e-3)
        far = dr.select(some, depth, 0.0)
        wide = depth * dr.sqrt(angles)
        width = dr.select(some, wide, 0.0)
        slope = width * (1.0 + 2.0 * dr.sqrt(1.0 - dr.minimum(cosine * cosine, 1.0)) / cosine)
        receiver = dr.gather(t.Int, objects, t.UInt(dr.maximum(triangle, 0)), some)
        return {
            "receiver": dr.select(some, receiver, -1),
            "normal": normal,
            "offset": dr.dot(normal, way) * far / rays["unit"],
            "slack": SLACK * width / rays["unit"],
            "depth": far,
            # How much farther the next pixel may be on the same surface.
            "slope": slope,
            # Nearer than this, nothing is hidden by what the pixel shows, receiver or not.
            "front": depth + dr.select(some, slope, 2.0 * wide),
            "area": dr.select(some, angles * far * far / cosine, 0.0),
        }

    return surface


def _corners(t: Any, number: Any, size: int) -> list[Any]:
    """Photons of triangles: two to each four of a grid of `size` columns, at their upper left and lower right."""
    import drjit as dr

    cell, upper = number >> 1, (number & 1) == 0
    row = cell // (size - 1)
    first = row * size + (cell - row * (size - 1))
    return [t.UInt(dr.select(upper, first + a, first + b)) for a, b in ((0, size + 1), (1, size), (size, 1))]


@functools.lru_cache(maxsize=16)
def plan(size: int, width: int, height: int, model: Any) -> Any:
    """Kernel that counts the points at which each triangle of photons is dropped, and tells which are smooth."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.poses import placed

    @frozen
    def plan(number: Any, landed: Any, flux: Any, camera: Any, pose: Any) -> tuple[Any, Any]:
        t, (place, normal, receiver) = types(), landed
        corners = _corners(t, number, size)
        ids = [dr.gather(t.Int, receiver, corner) for corner in corners]
        alive = [(one >= 0) & (dr.gather(t.Float, flux, c) > 0) for one, c in zip(ids, corners, strict=True)]
        places = [dr.gather(t.Array3f, place, corner) for corner in corners]
        normals = [dr.gather(t.Array3f, normal, corner) for corner in corners]
        smooth = alive[0] & alive[1] & alive[2] & (ids[0] == ids[1]) & (ids[1] == ids[2])
        for i, j in ((0, 1), (1, 2), (2, 0)):
            edge = places[j] - places[i]
            off = dr.maximum(abs(dr.dot(edge, normals[i])), abs(dr.dot(edge, normals[j])))
            smooth &= (off <= _BEND * dr.norm(edge) + 1e-6) & (abs(dr.dot(normals[i], normals[j])) > 0.7)
        pixels = []
        for where in places:
            image = camera.local_project(placed(t, pose, where))[0]
            smooth &= image.valid
            pixels.append(image.pixel)
        (ax, ay), (bx, by), (cx, cy) = pixels
        area = 0.5 * abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay))
        wanted = dr.clip(dr.ceil(area * DENSITY), 1.0, float(MOST_DROPS))
        low = [dr.minimum(dr.minimum(ax, bx), cx), dr.minimum(dr.minimum(ay, by), cy)]
        high = [dr.maximum(dr.maximum(ax, bx), cx), dr.maximum(dr.maximum(ay, by), cy)]
        seen = (high[0] >= 0) & (high[1] >= 0) & (low[0] <= width) & (low[1] <= height)
        single = sum(dr.select(one, t.UInt(1), 0) for one in alive)
        return dr.select(smooth, dr.select(seen, t.UInt(wanted), 0), single), smooth

    return plan


@functools.lru_cache(maxsize=16)
def drop(size: int, width: int, height: int, model: Any) -> Any:
    """Kernel that drops the flux of triangles of photons into the eye's picture, at the places it can see."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.poses import placed

    @frozen
    def drop(
        number: Any,
        starts: Any,
        counts: Any,
        smooth: Any,
        landed: Any,
        flux: Any,
        camera: Any,
        pose: Any,
        unit: Any,
        seen: Any,
        target: Any,
    ) -> Any:
        t, (place, _, receiver) = types(), landed
        many = 2 * (size - 1) * (size - 1)
        after = dr.binary_search(0, many, lambda i: dr.gather(t.UInt, starts, t.UInt(i)) <= number)
        triangle = t.UInt(dr.maximum(after, 1)) - 1
        which, count = number - dr.gather(t.UInt, starts, triangle), dr.gather(t.UInt, counts, triangle)
        whole = dr.gather(t.Bool, smooth, triangle)
        corners = _corners(t, triangle, size)
        ids = [dr.gather(t.Int, receiver, corner) for corner in corners]
        powers = [
            dr.select(one >= 0, dr.gather(t.Float, flux, c), 0.0) / 6 for one, c in zip(ids, corners, strict=True)
        ]
        places = [dr.gather(t.Array3f, place, corner) for corner in corners]
        x, y = (1 / 3 + t.Float(which) * step for step in _STEP)
        x, y = x - dr.floor(x), y - dr.floor(y)
        over = x + y > 1
        x, y = dr.select(over, 1 - x, x), dr.select(over, 1 - y, y)
        # Where the three do not belong together each has its own point: number `which` of those that landed.
        alive = [power > 0 for power in powers]
        rank = [t.UInt(0), dr.select(alive[0], t.UInt(1), 0)]
        rank.append(rank[1] + dr.select(alive[1], t.UInt(1), 0))
        chosen = [a & (r == which) for a, r in zip(alive, rank, strict=True)]
        weights = [
            dr.select(whole, even, dr.select(one, 1.0, 0.0))
            for even, one in zip((1 - x - y, x, y), chosen, strict=True)
        ]
        power = sum(
            dr.select(whole, p / t.Float(dr.maximum(count, 1)), p * w) for p, w in zip(powers, weights, strict=True)
        )
        where = sum((p * w for p, w in zip(places, weights, strict=True)), t.Array3f(0.0))
        owner = dr.select(whole | chosen[0], ids[0], dr.select(chosen[1], ids[1], ids[2]))
        longest = dr.maximum(dr.norm(places[1] - places[0]), dr.norm(places[2] - places[0]))
        slack = dr.select(whole, 0.05 * longest, 0.0)
        point = placed(t, pose, where)
        image = camera.local_project(point)[0]
        u, v = image.pixel
        inside = image.valid & (u >= 0) & (v >= 0) & (u < width) & (v < height) & (power > 0)
        u, v = dr.select(inside, u, 0.5) - 0.5, dr.select(inside, v, 0.5) - 0.5
        left, top = dr.floor(u), dr.floor(v)
        fx, fy = u - left, v - top
        # What is hidden in the pixel that it lies in is hidden, whatever the next pixel sees.
        home = t.UInt(dr.select(inside, t.Int(v + 0.5) * width + t.Int(u + 0.5), 0))
        inside &= image.depth * unit <= dr.gather(t.Float, seen["front"], home)
        taps, mine, any_ = [], t.Float(0.0), t.Float(0.0)
        for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
            column, row = t.Int(left) + i, t.Int(top) + j
            good = inside & (column >= 0) & (row >= 0) & (column < width) & (row < height)
            pixel = t.UInt(dr.select(good, row * width + column, 0))
            other = dr.gather(t.Int, seen["receiver"], pixel)
            normal, offset = dr.gather(t.Array3f, seen["normal"], pixel), dr.gather(t.Float, seen["offset"], pixel)
            off = abs(dr.dot(normal, point) - offset)
            good &= (other >= 0) & (off <= dr.gather(t.Float, seen["slack"], pixel) + slack)
            share = dr.select(good, (fx if i else 1 - fx) * (fy if j else 1 - fy), 0.0)
            own = dr.select(other == owner, share, 0.0)
            taps.append((pixel, share, own))
            mine, any_ = mine + own, any_ + share
        # Where no pixel around shows the same receiver, others in the same plane take the light.
        alone = mine <= 1e-6
        total = dr.select(alone, any_, mine)
        scale = dr.select(total > 1e-6, power / dr.maximum(total, 1e-6), 0.0)
        for pixel, share, own in taps:
            amount = dr.select(alone, share, own) * scale
            dr.scatter_reduce(dr.ReduceOp.Add, target, amount, pixel, amount > 0)
        return target

    return drop


@functools.lru_cache(maxsize=16)
def spread(width: int, height: int, radius: float) -> Any:
    """Kernels that spread dropped flux over pixels of the same surface, all of it, and divide it by their areas."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    reach = int(radius)
    taps = [(dx, dy) for dy in range(-reach, reach + 1) for dx in range(-reach, reach + 1)]
    kernel = {(dx, dy): 1.0 - (dx * dx + dy * dy) / (radius + 1.0) ** 2 for dx, dy in taps}
    kernel = {tap: weight for tap, weight in kernel.items() if weight > 0}

    def around(t: Any, pixel: Any) -> Any:
        """Neighbors: number, weight, steps away, and whether they lie in the picture."""
        row = pixel // width
        column = pixel - row * width
        for (dx, dy), weight in kernel.items():
            x, y = t.Int(column) + dx, t.Int(row) + dy
            inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
            yield t.UInt(dr.select(inside, y * width + x, 0)), weight, float(abs(dx) + abs(dy)), inside

    @frozen
    def shares(pixel: Any, seen: Any, dropped: Any) -> Any:
        t = types()
        total = t.Float(0.0)
        for other, weight, steps, inside in around(t, pixel):
            alike = inside & (dr.gather(t.Int, seen["receiver"], other) == seen["receiver"])
            alike &= abs(dr.gather(t.Float, seen["depth"], other) - seen["depth"]) <= steps * seen["slope"]
            total += dr.select(alike, weight, 0.0)
        return dropped / total

    @frozen
    def gathered(pixel: Any, seen: Any, share: Any) -> Any:
        t = types()
        total = t.Float(0.0)
        for other, weight, steps, inside in around(t, pixel):
            alike = inside & (dr.gather(t.Int, seen["receiver"], other) == seen["receiver"])
            slope = dr.gather(t.Float, seen["slope"], other)
            alike &= abs(dr.gather(t.Float, seen["depth"], other) - seen["depth"]) <= steps * slope
            total += dr.select(alike, weight * dr.gather(t.Float, share, other), 0.0)
        area = seen["area"]
        return dr.select(area > 0, total / dr.select(area > 0, area, 1.0), 0.0)

    def run(pixel: Any, seen: Any, dropped: Any) -> Any:
        used = {name: seen[name] for name in ("receiver", "depth", "slope")}
        return gathered(pixel, used | {"area": seen["area"]}, shares(pixel, used, dropped))

    return run
