"""The first pass of two-pass rasterization: scene triangles, cut where images break, sampled in patches.

A sampler says what is linear over a scene triangle (coefficients at its corners) and how an image comes from it. Two
are here: general linear cameras, one or many, and any camera that knows the one image of a point.
"""

from typing import Any

from mpcam.backend import types
from mpcam.cameras.base import Camera
from mpcam.cameras.general_linear_bounds import box
from mpcam.cameras.general_linear_map import BEYOND, Coefficients, LinearMap
from mpcam.math import vector

# How far from a slit triangles end, relative to its depth, or to the mesh's scale where it lies in the plane z = 0; and
# where they are cut on the way there, since images run away faster and faster.
_STEPS = (2.0**-14, 2.0**-10, 2.0**-7, 2.0**-4)
_FLAT = 1e-6


class LinearSampler:
    """General linear cameras: images by two equations whose entries are linear (Yu et al. 2009, eq. 5).

    data: 24 tables of numbers for each piece (the rotation and shift from device vertices to its frame in scene units,
    then its map), and the mesh's scale; one piece: numbers.
    """

    rows = 2
    zones = 5 * len(_STEPS) - 2  # before, between and behind two slits

    def __init__(self, many: bool):
        self.many = many

    def of(self, data: Any, piece: Any) -> tuple[list[Any], LinearMap]:
        """Frame and map of pieces."""
        import drjit as dr

        numbers, _ = data
        if self.many:
            numbers = [dr.gather(types().Float, table, piece) for table in numbers]
        return numbers[:12], LinearMap(*numbers[12:])

    def place(self, data: Any, piece: Any, point: Any) -> Any:
        """Device vertices in the frame of a piece, scene units."""
        from mpcam_kernels.poses import placed

        return placed(types(), self.of(data, piece)[0], point)

    def planes(self, data: Any, piece: Any) -> list[tuple[Any, Any]]:
        """Depths between which images do not break."""
        import drjit as dr

        _, linear = self.of(data, piece)
        first, second = linear.slits()
        across = linear.u_x * linear.v_y - linear.u_y * linear.v_x
        size = dr.abs(linear.u_x * linear.v_y) + dr.abs(linear.u_y * linear.v_x)
        starts = dr.abs(across) <= _FLAT * size  # with a slit
        begin = [dr.select(starts, step * data[1], 0.0) for step in _STEPS]

        def away(slit: Any) -> list[Any]:
            """Depths of cuts behind a slit, nearest to it first."""
            return [dr.maximum(begin[0], slit * (1.0 + step)) for step in _STEPS]

        def toward(slit: Any) -> list[Any]:
            """Depths of cuts before a slit, nearest to it last."""
            return [slit * (1.0 - step) for step in reversed(_STEPS)]

        chains = [(begin, toward(first)), (away(first), toward(second)), (away(second), [second * 0.0 + BEYOND])]
        zones = []
        for low, high in chains:
            middle = 0.5 * low[0] + 0.5 * high[-1]
            chain = [dr.minimum(depth, middle) for depth in low] + [dr.maximum(depth, middle) for depth in high]
            zones += list(zip(chain[:-1], chain[1:], strict=True))
        return zones

    def coefficients(self, data: Any, piece: Any, point: Any) -> list[Any]:
        """Entries of the equations for points in the frame of a piece."""
        return list(self.of(data, piece)[1].coefficients(point))

    def image(self, data: Any, piece: Any, entries: list[Any]) -> tuple[Any, Any, Any]:
        """Pixel and depth; NaN where there is no image."""
        import drjit as dr

        (x, y), depth, valid = self.of(data, piece)[1].solve(Coefficients(*entries))
        return x, y, dr.select(valid, depth, dr.nan)

    def may_show(self, data: Any, piece: Any, area: Any, points: list[Any]) -> Any:
        """Whether the image of a triangle may meet the area (left, top, right, bottom) of a piece."""
        found = box(self.of(data, piece)[1], *(vector(*point) for point in points))
        return (
            found.valid
            & (found.low[0] <= area[2])
            & (found.high[0] >= area[0])
            & (found.low[1] <= area[3])
            & (found.high[1] >= area[1])
        )


class PointSampler:
    """Any camera that knows the one image of a point, or goes on smoothly beyond its domain.

    data: the camera on the device, its pose, and the mesh's scale.
    """

    rows = 1

    def __init__(self, model: type[Camera], half: bool, unbounded: bool):
        """half: only what lies before the plane z = 0 has an image."""
        self.model, self.half, self.unbounded = model, half, unbounded
        self.geometry = model.ray_geometry
        self.zones = len(_STEPS) if half else 1

    def place(self, data: Any, piece: Any, point: Any) -> Any:
        """Device vertices in the camera frame: scene units, or units of the mesh's scale where there is a center."""
        from mpcam_kernels.poses import placed

        _, pose, unit = data
        point = placed(types(), pose, point)
        return point if self.geometry == "central" else point * unit

    def planes(self, data: Any, piece: Any) -> list[tuple[Any, Any]]:
        """Depths between which images do not break."""
        zero = 0.0 * data[2]
        ends = [*(_STEPS if self.half else (-BEYOND,)), BEYOND]
        return [(zero + near, zero + far) for near, far in zip(ends[:-1], ends[1:], strict=True)]

    def coefficients(self, data: Any, piece: Any, point: Any) -> list[Any]:
        """The point itself."""
        return list(point)

    def image(self, data: Any, piece: Any, entries: list[Any]) -> tuple[Any, Any, Any]:
        """Pixel and depth; NaN where there is no image, a negative depth beyond the rim of a disc."""
        import drjit as dr

        from mpcam.rendering.vertex import corner

        camera, _, unit = data
        point = types().Array3f(*entries)
        if self.geometry == "parallel":
            pixel, _ = camera.local_image(point)
            return pixel.x, pixel.y, point.z
        if self.geometry == "central":
            row = corner(camera, point, dr.norm(point) * unit, self.unbounded)
            return row.x, row.y, row.z
        (x, y), depth, valid = camera.local_project(point)[0]
        return x, y, dr.select(valid, depth, dr.nan)


def sorted_out(sampler: Any, pair: Any, data: Any, areas: Any, vertices: Any, faces: Any, triangles: int) -> Any:
    """Of pairs of a piece and a triangle: 0 where no pixel sees it, 1 where it is whole, 2 where it has to be cut."""
    import drjit as dr

    t = types()
    piece, corners = _pair(sampler, pair, data, vertices, faces, triangles)
    points = [corner.point for corner in corners]
    low, high = _depths(corners)
    finite = dr.isfinite(sum(part for point in points for part in point))
    seen, whole = t.Bool(False), t.Bool(False)
    for near, far in sampler.planes(data, piece):
        seen = seen | ((high >= near) & (low <= far))
        whole = whole | ((low >= near) & (high <= far))
    seen = seen & finite & _may_show(sampler, piece, data, areas, points)
    return dr.select(seen, dr.select(whole, t.UInt(1), 2), 0)


def _may_show(sampler: Any, piece: Any, data: Any, areas: Any, points: list[Any]) -> Any:
    """Whether a triangle may show in its piece; areas: of all pieces, or None where there is one."""
    import drjit as dr

    if areas is None:
        return types().Bool(True)
    return sampler.may_show(data, piece, [dr.gather(types().Float, table, piece) for table in areas], points)


def most_parts(sampler: Any) -> int:
    """Patches that one scene triangle can be cut into."""
    from mpcam_kernels import slabs

    return slabs.FANS * sampler.zones


def parts_of(
    sampler: Any, item: Any, parts: Any, pairs: Any, data: Any, areas: Any, vertices: Any, faces: Any, triangles: int
) -> Any:
    """Whether the parts of pairs that are cut, `most_parts` of each, are there (parts: None), or may show (numbers)."""
    import drjit as dr

    part = item if parts is None else dr.gather(types().UInt, parts, item)
    piece, corners, there = _part(sampler, part, pairs, data, vertices, faces, triangles)
    if parts is None:
        return there
    return _may_show(sampler, piece, data, areas, [corner.point for corner in corners])


def set_up(
    sampler: Any,
    item: Any,
    pairs: Any,
    parts: Any,
    start: Any,
    rows: list[Any],
    data: Any,
    vertices: Any,
    faces: Any,
    triangles: int,
) -> Any:
    """Write the rows of patches from `start` on: coefficients of three corners, their weights, piece and triangle.

    parts: None where each pair is one patch, else the numbers of those parts of pairs that are there.
    """
    import drjit as dr

    from mpcam_kernels import slabs

    t = types()
    if parts is None:
        pair = dr.gather(t.UInt, pairs, item)
        piece, corners = _pair(sampler, pair, data, vertices, faces, triangles)
    else:
        part = dr.gather(t.UInt, parts, item)
        pair = dr.gather(t.UInt, pairs, part // most_parts(sampler))
        piece, corners, _ = _part(sampler, part, pairs, data, vertices, faces, triangles)
    at = start + item
    known: list[Any] = []
    for number, corner in enumerate(slabs.in_order(corners)):
        entries = sampler.coefficients(data, piece, corner.point)
        entries += [t.Float(0)] * (4 * sampler.rows - len(entries))
        for row in range(sampler.rows):
            dr.scatter(rows[sampler.rows * number + row], t.Array4f(*entries[4 * row : 4 * row + 4]), at)
        known += [corner.second, corner.third]
    names = [dr.reinterpret_array(t.Float, number) for number in (piece, pair % triangles)]
    dr.scatter(rows[-2], t.Array4f(*known[:4]), at)
    dr.scatter(rows[-1], t.Array4f(*known[4:], *names), at)
    return rows


def _part(
    sampler: Any, item: Any, pairs: Any, data: Any, vertices: Any, faces: Any, triangles: int
) -> tuple[Any, list[Any], Any]:
    """Piece and corners of a part of a pair that is cut, and whether it is there."""
    import drjit as dr

    from mpcam_kernels import slabs

    t, most = types(), most_parts(sampler)
    pair, part = dr.gather(t.UInt, pairs, item // most), item % most
    piece, corners = _pair(sampler, pair, data, vertices, faces, triangles)
    near, far = t.Float(0), t.Float(-1)
    for zone, (low, high) in enumerate(sampler.planes(data, piece)):
        mine = part // slabs.FANS == zone
        near, far = dr.select(mine, low, near), dr.select(mine, high, far)
    low, high = _depths(corners)
    fans = slabs.between(corners, near, far)
    found = fans[0]
    for number, fan in enumerate(fans[1:], 1):
        mine = part % slabs.FANS == number
        found = [slabs.chosen(mine, x, y) for x, y in zip(fan, found, strict=True)]
    a, b, c = (corner.point for corner in found)
    flat = dr.all(a == b) | dr.all(b == c) | dr.all(c == a)
    return piece, found, (far > near) & (high >= near) & (low <= far) & ~flat


def _depths(corners: list[Any]) -> tuple[Any, Any]:
    """Lowest and highest depth of the corners of a triangle."""
    import drjit as dr

    a, b, c = (corner.point.z for corner in corners)
    return dr.minimum(dr.minimum(a, b), c), dr.maximum(dr.maximum(a, b), c)


def sampled(sampler: Any, number: Any, target: Any, grid: Any, rows: list[Any], data: Any, divisions: int) -> Any:
    """Write pixel, depth and piece of the grid points of all patches: a lane each.

    The entries are mixed corner by corner, by whole numbers, in an order that neighbors share, for the same samples.
    """
    import drjit as dr

    t = types()
    points = (divisions + 1) * (divisions + 2) // 2
    patch = number // points
    second, third = (dr.round(part * divisions) for part in dr.gather(t.Array2f, grid, number % points))
    entries: list[Any] = []
    for row in range(sampler.rows):
        first = dr.gather(t.Array4f, rows[row], patch) * (divisions - second - third)
        mixed = dr.fma(dr.gather(t.Array4f, rows[sampler.rows + row], patch), second, first)
        entries += list(dr.fma(dr.gather(t.Array4f, rows[2 * sampler.rows + row], patch), third, mixed))
    entries = [entry * (1.0 / divisions) for entry in entries]
    name = dr.gather(t.Array4f, rows[-1], patch).z
    piece = dr.reinterpret_array(t.UInt, name)
    x, y, depth = sampler.image(data, piece, entries[: 7 if sampler.rows == 2 else 3])
    dr.scatter(target, t.Array4f(x, y, depth, t.Float(piece)), number)
    return target


def _pair(sampler: Any, pair: Any, data: Any, vertices: Any, faces: Any, triangles: int) -> tuple[Any, list[Any]]:
    """Piece of a pair, and the corners of its triangle in the frame of the piece."""
    import drjit as dr

    from mpcam_kernels.slabs import Corner

    t = types()
    piece, triangle = pair // triangles, pair % triangles
    points = [
        sampler.place(data, piece, dr.gather(t.Array3f, vertices, number))
        for number in dr.gather(t.Array3u, faces, triangle)
    ]
    zero = t.Float(0)
    weights = ((zero, zero), (zero + 1, zero), (zero, zero + 1))
    return piece, [Corner(point, *weight) for point, weight in zip(points, weights, strict=True)]
