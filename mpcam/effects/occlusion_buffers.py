"""Occlusion by what other cameras see: their pixels' points, and lines through their images (Rosen et al. 2011, 6.3).

Seen from another camera, planes through its own ray of a point are lines of its image; so elevations are measured about
that ray. For a camera whose rays come from several centers it is the line along which the image of the point stays.
"""

import functools
from typing import Any

import numpy as np

from mpcam.backend import opaque_numbers, types
from mpcam.cameras.capabilities import Projects, need
from mpcam.effects.screen_elements import element
from mpcam.errors import InputError
from mpcam.rendering.device import device_mesh
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.hits import Hits

_STRIDE = 0.02  # of the radius, over which differences of images are taken
_AROUND = 1  # pixels on each side in which a sample is looked for that holds the same


def checked_buffer(zbuffer: Any, hits: Hits) -> Hits:
    """A z-buffer that fits hits; raises InputError for others."""
    if not isinstance(zbuffer, Hits):
        raise InputError(f"zbuffer is a {type(zbuffer).__name__}: give hits of another camera, mpcam.rasterize(...)")
    camera = zbuffer.camera
    need(camera, Projects, "zbuffer")
    if camera.images_per_point != 1:
        raise InputError(f"zbuffer needs one image for each point, and a {type(camera).__name__} may have more")
    if device_mesh(zbuffer.mesh) is not device_mesh(hits.mesh):
        raise InputError("zbuffer is of another mesh: rasterize the same one by both cameras")
    return zbuffer


def checked_backs(backs: Any, buffers: list[Hits], thickness: float | None) -> list[Hits | None]:
    """Hits on what is turned away from the z-buffers' cameras, one each; raises InputError for others."""
    if backs is None:
        return [None] * len(buffers)
    given = list(backs) if isinstance(backs, (list, tuple)) else [backs]
    if thickness is None:
        raise InputError("backs need thickness=, a length: how far surfaces without a back reach, and others at most")
    if len(given) != len(buffers):
        raise InputError(f"backs has {len(given)} entries for {len(buffers)} z-buffers: give one for each, in order")
    for back, front in zip(given, buffers, strict=True):
        if not isinstance(back, Hits) or back.camera != front.camera:
            raise InputError("backs: give hits of the z-buffers' own cameras, mpcam.rasterize(..., cull='front')")
    return given


def reaches_of(buffers: list[Hits], backs: list[Hits | None], thickness: float | None) -> list[Any]:
    """How far each sample reaches back, in the device's lengths, a Float for each z-buffer; None: without end."""
    import drjit as dr

    t, found = types(), []
    for front, back in zip(buffers, backs, strict=True):
        if thickness is None:
            found.append(None)
            continue
        (most, unit) = opaque_numbers([thickness / device_mesh(front.mesh).scale, 1.0 / device_mesh(front.mesh).scale])
        reach = most + dr.zeros(t.Float, front.camera.width * front.camera.height)
        if back is not None:
            behind = (back.device_depth - front.device_depth) * unit
            reach = dr.select(behind > 0, dr.minimum(behind, reach), reach)
        dr.eval(reach)
        found.append(reach)
    return found


def buffer_share(
    zbuffer: Hits,
    before: list[Hits],
    hits: Hits,
    own: tuple[dict[str, Any], Any, dict[str, Any]],
    settings: tuple[int, int, str],
    reach: Any,
) -> Any:
    """Share that a z-buffer's samples cover, of those that none before holds: a Float, one entry per pixel of hits.

    own: surface, buffer and numbers of the hits' own pinhole, in its frame; settings: directions, steps, falloff.
    reach: of each of its samples, see `reaches_of`.
    """
    from mpcam_kernels.horizon import PointBuffer

    surface, buffer, data = own
    points = _points_of(zbuffer, hits)
    for other in before:
        size, shape = ((one.camera.width, one.camera.height) for one in (zbuffer, other))
        known = device_camera(other.camera).on_device
        points = _without(size, shape)(points, _points_of(other, hits), known, _pose(other, hits), data["numbers"])
    size, shape = ((one.camera.width, one.camera.height) for one in (hits, zbuffer))
    kernel = _share(size, shape, *settings)
    camera = device_camera(zbuffer.camera).on_device
    return kernel(surface, buffer, PointBuffer(points), reach, camera, _pose(zbuffer, hits), data)


def _pose(zbuffer: Hits, hits: Hits) -> list[Any]:
    """To a camera's frame, in scene units, from the frame of the hits' camera, in the device's."""
    own = np.asarray(hits.camera.camera_from_world, np.float64)
    place = np.asarray(zbuffer.camera.camera_from_world, np.float64)
    scale = device_mesh(hits.mesh).scale
    eye = np.linalg.inv(own)[:3, 3]
    away = place[:3, :3] @ eye + place[:3, 3]
    return opaque_numbers([*(scale * place[:3, :3] @ own[:3, :3].T).ravel(), *away])


def _points_of(zbuffer: Hits, hits: Hits) -> Any:
    """What a camera's pixels see, in the frame of the hits' camera: flat Float, z is infinite for nothing."""
    import drjit as dr

    device = device_mesh(hits.mesh)
    own = np.asarray(hits.camera.camera_from_world, np.float64)
    shift = (own[:3, :3] @ device.anchor + own[:3, 3]) / device.scale
    pose = opaque_numbers([*own[:3, :3].ravel(), *shift])
    arrays = device.faces, device.vertices
    points = dr.ravel(_points()(zbuffer.device_triangle, zbuffer.device_weights, arrays, pose))
    dr.eval(points)
    return points


@functools.cache
def _points() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.poses import placed

    @frozen
    def kernel(triangle: Any, weights: tuple[Any, Any], arrays: tuple[Any, Any], pose: list[Any]) -> Any:
        t, hit = types(), triangle >= 0
        corners = dr.gather(t.Array3u, arrays[0], t.UInt(dr.maximum(triangle, 0)), hit)
        a, b, c = (dr.gather(t.Array3f, arrays[1], corner, hit) for corner in corners)
        x, y, z = placed(t, pose, a + (b - a) * weights[0] + (c - a) * weights[1])
        return t.Array3f(x, y, dr.select(hit, z, dr.inf))

    return kernel


@functools.cache
def _without(size: tuple[int, int], shape: tuple[int, int]) -> Any:
    """Kernel: points but for those that lie within the thickness of what another camera's pixels around them see."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.poses import placed

    @frozen
    def kernel(points: Any, others: Any, camera: Any, pose: list[Any], numbers: list[Any]) -> Any:
        t = types()
        pixel = dr.arange(t.UInt, size[0] * size[1])
        point = dr.gather(t.Array3f, points, pixel)
        there = point.z < dr.inf
        (u, v), _, seen = camera.local_project(placed(t, pose, dr.select(there, point, t.Array3f(0, 0, 1))))[0]
        seen &= there
        column, row = t.Int(dr.floor(dr.select(seen, u, -9))), t.Int(dr.floor(dr.select(seen, v, -9)))
        held = t.Bool(False)
        for down in range(-_AROUND, _AROUND + 1):
            for right in range(-_AROUND, _AROUND + 1):
                x, y = column + right, row + down
                inside = seen & (x >= 0) & (y >= 0) & (x < shape[0]) & (y < shape[1])
                other = dr.gather(t.Array3f, others, t.UInt(dr.select(inside, y * shape[0] + x, 0)), inside)
                held |= inside & (dr.squared_norm(other - point) < dr.square(numbers[3]))
        return dr.ravel(t.Array3f(point.x, point.y, dr.select(held, dr.inf, point.z)))

    return kernel


@functools.cache
def _share(size: tuple[int, int], shape: tuple[int, int], directions: int, steps: int, falloff: str) -> Any:
    """Kernel: share that another camera's samples cover."""
    import drjit as dr

    from mpcam_kernels import horizon
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.poses import placed

    @frozen
    def kernel(
        surface: dict[str, Any], buffer: Any, samples: Any, reach: Any, camera: Any, pose: list[Any], data: Any
    ) -> Any:
        t = types()
        pixel, point, hit = element(t, size, surface, buffer)
        radius, bias, _, _ = data["numbers"]
        stride = radius * _STRIDE

        def image(place: Any) -> tuple[Any, Any, Any, Any]:
            (u, v), depth, valid = camera.local_project(placed(t, pose, place))[0]
            return u, v, depth, valid

        u, v, depth, there = image(point)
        there &= hit
        across, down, deeper = [], [], []
        for axis in range(3):
            away = t.Array3f(*(stride if axis == k else t.Float(0) for k in range(3)))
            right, below, far, near = image(point + away)
            there &= near
            across.append((right - u) / stride)
            down.append((below - v) / stride)
            deeper.append(far - depth)
        across, down, deeper = (t.Array3f(*(dr.select(there, x, 0.0) for x in each)) for each in (across, down, deeper))
        view = dr.cross(across, down)
        view = view * dr.rsqrt(dr.maximum(dr.squared_norm(view), 1e-30))
        there &= dr.squared_norm(view) > 0.5
        view = dr.select(there, dr.select(dr.dot(view, deeper) > 0, -view, view), t.Array3f(0, 0, -1))
        if reach is None:  # what only the hits' camera sees is looked at as from there
            behind = dr.dot(view, surface["normal"]) <= 0
            view = dr.select(behind, -point * dr.rsqrt(dr.squared_norm(point)), view)

        def lines(way: Any) -> tuple[Any, Any, Any, Any]:
            return u, v, dr.dot(across, way) * radius, dr.dot(down, way) * radius

        settings = radius, bias, horizon.noise(t, pixel), directions, steps, falloff, there
        return horizon.covered(t, samples, shape, point, surface["normal"], view, lines, *settings, reach)

    return kernel
