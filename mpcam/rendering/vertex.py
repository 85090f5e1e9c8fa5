"""The usual approximation: project vertices, join them by straight edges, interpolate linearly in the image."""

import functools
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Images, Projects, need
from mpcam.checks import whole_number
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.device import to_camera
from mpcam.rendering.z_buffer import ZBuffered

MOST_LEVELS = 7
MOST_TRIANGLES = 1 << 26


class VertexProjected(ZBuffered):
    """Frames by projected vertices; each edge of the mesh is split 2**level times first.

    Depth and barycentric weights are linear in the image, as a game's vertex shader would have them. A corner beyond
    the rim is projected as far as f goes on; small triangles wholly out of view, or with a corner that has no image at
    all, are left out.
    """

    method = "vertex"

    @exclusive
    def __init__(self, camera: Camera, mesh: Mesh, level: int = 0):
        level = whole_number("level", level, 0, MOST_LEVELS, hint="edges split 2**level times")
        total = mesh.triangle_count * 4**level
        if total > MOST_TRIANGLES:
            raise InputError(
                f"level={level} makes {total} triangles of {mesh.triangle_count}: at most {MOST_TRIANGLES}"
            )
        super().__init__(camera, mesh)
        self.level = level
        self.parts = Subdivision(2**self.level)
        self.corners = self.faces  # of the whole triangles
        self.faces = self.parts.faces(self.corners, mesh.triangle_count)

    def test_for(self, camera: Camera) -> str:
        return straight_test(camera, self.method)

    def place(self, vertices: Any) -> list[Any]:
        import drjit as dr

        from mpcam_kernels.threads import threads

        points = self.parts.points * self.mesh.triangle_count if self.level else dr.width(vertices) // 3
        number = threads(types(), 0, points)
        target = dr.empty(types().Float, 4 * points)
        place = _frozen_place(type(self.camera), self.camera.domain.image_radius is None, self.level)
        data = (self.device_camera.on_device, self.pose, self.unit, vertices, self.corners)
        return [place(number, target, self.parts.grid, *data)]

    def parent(self, triangle: Any) -> Any:
        import drjit as dr

        parent = dr.select(triangle >= 0, triangle // self.parts.count, -1)
        dr.eval(parent)
        return parent

    def parent_weights(self, triangle: Any, second: Any, third: Any) -> tuple[Any, Any]:
        return self.parts.parent_weights(triangle, second, third)


def straight_test(camera: Camera, method: str) -> str:
    """The test for corners that a camera projects one by one; raises InputError where a point has no one image."""
    instead = "use method='invert' or 'raytrace'"
    if camera.ray_geometry != "general":
        need(camera, Images, f"method={method!r}", instead)
        return "screen_triangle" if camera.ray_geometry == "central" else "pixel_triangle"
    need(camera, Projects, f"method={method!r}", instead)
    if camera.images_per_point != 1:
        raise InputError(
            f"method={method!r} needs one image for each point; a {type(camera).__name__} has up to "
            f"{camera.images_per_point}: {instead}"
        )
    return "screen_triangle"


@functools.cache
def _frozen_place(model: type[Camera], unbounded: bool, level: int) -> Any:
    """Kernel that makes the tessellation's vertices and projects them to (pixel, depth); NaN: there is no image."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    geometry = model.ray_geometry

    @frozen
    def place(
        number: Any, target: Any, grid: Any, camera: Any, pose: list[Any], unit: Any, vertices: Any, faces: Any
    ) -> Any:
        if level == 0:
            point = to_camera(pose, vertices, number)
        else:
            points = (2**level + 1) * (2**level + 2) // 2
            point = tessellated(grid, lambda number: to_camera(pose, vertices, number), faces, number, points)
        if geometry == "parallel":
            point = point * unit
            pixel, _ = camera.local_image(point)
            row = types().Array4f(pixel.x, pixel.y, point.z, 0)
        elif geometry == "central":
            row = corner(camera, point, dr.norm(point) * unit, unbounded)
        else:
            ((u, v), depth, valid) = camera.local_project(point * unit)[0]
            row = types().Array4f(u, v, dr.select(valid, depth, dr.nan), 0)
        dr.scatter(target, row, number)
        return target

    return place


def corner(camera: Any, point: Any, depth: Any, unbounded: bool) -> Any:
    """Pixel and depth of points in the frame of a camera with a center, as corners of straight-edged triangles.

    Behind a pinhole there is no image; beyond the rim of a disc there is one, marked by a negative depth.
    """
    import drjit as dr

    pixel, inside = camera.local_image(point)
    return types().Array4f(pixel.x, pixel.y, dr.select(inside, depth, dr.nan if unbounded else -depth), 0)


def tessellated(grid: Any, at: Any, faces: Any, point: Any, points: int) -> Any:
    """Place of grid point number `point` of a triangle cut into parts, of which there are `points`; at(corner)."""
    import drjit as dr

    t = types()
    a, b, c = (at(number) for number in dr.gather(t.Array3u, faces, point // points))
    second, third = dr.gather(t.Array2f, grid, point % points)
    return a + (b - a) * second + (c - a) * third


class Subdivision:
    """A triangle cut into divisions**2 equal parts: grid points row by row, from the first corner to the other two.

    grid: weights of corners 2 and 3 at the grid points. count: parts per triangle. points: grid points per triangle.
    """

    @exclusive
    def __init__(self, divisions: int):
        rows = [(row, column) for row in range(divisions + 1) for column in range(row + 1)]
        number = {place: count for count, place in enumerate(rows)}
        parts = []
        for row in range(divisions):
            for column in range(row + 1):
                parts.append([number[row, column], number[row + 1, column], number[row + 1, column + 1]])
                if column < row:
                    parts.append([number[row, column], number[row + 1, column + 1], number[row, column + 1]])
        t = types()
        self.count, self.points = len(parts), len(rows)
        self.grid = t.Array2f(np.array([((r - c) / divisions, c / divisions) for r, c in rows], np.float32).T)
        self._pattern = t.UInt(aligned(parts, np.uint32))

    def faces(self, faces: Any, triangles: int) -> Any:
        """Vertex numbers of all parts of all triangles."""
        import drjit as dr

        if self.count == 1 or triangles == 0:  # the whole triangles themselves
            return faces
        number = dr.arange(types().UInt, 3 * self.count * triangles)
        offset = (number // (3 * self.count)) * self.points
        result = dr.gather(types().UInt, self._pattern, number % (3 * self.count)) + offset
        dr.eval(result)
        return result

    def parent_weights(self, part: Any, second: Any, third: Any) -> tuple[Any, Any]:
        """Weights of corners 2 and 3 of the whole triangle, from those of a part (-1: none)."""
        import drjit as dr

        t = types()
        within = t.UInt(dr.maximum(part, 0)) % self.count
        corners = [dr.gather(t.UInt, self._pattern, 3 * within + i) for i in range(3)]
        a, b, c = (dr.gather(t.Array2f, self.grid, corner) for corner in corners)
        mixed = a * (1 - second - third) + b * second + c * third
        return dr.select(part >= 0, mixed.x, 0.0), dr.select(part >= 0, mixed.y, 0.0)
