"""Ambient occlusion in screen space, from a z-buffer alone (Bavoil and Sainz 2008; Rosen et al. 2011, section 6.3).

The exposure of a surface element is the share of its hemisphere's solid angle that nothing nearer than a radius covers,

    A = 1 - 1 / (2 pi) integral of V W over the hemisphere,

V = 1 where a ray meets a surface and W a weight that falls from 1 to 0 at the radius. In the plane of the eye, the
element and any line of the image through its pixel, all of what covers it is found by walking along that line, if what
is seen from the eye is all that there is. Elevations are measured about the direction to the eye: so a plane covers
nothing of itself anywhere in the image, and a wall is right at every field of view.
"""

import functools
import math
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.capabilities import Projects, need
from mpcam.cameras.pinhole import Pinhole
from mpcam.checks import is_number, shown, whole_number
from mpcam.errors import InputError
from mpcam.rendering.device import device_mesh
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.hits import Hits

FALLOFFS = ("quadratic", "linear", "none")
MOST_LINES = 1024
_THICKNESS = 0.05  # of the radius: off the tangent plane, where the blur's weight has fallen to 1 / e
_STRIDE = 0.02  # of the radius, along which the way of a line in another camera's image is found
_UNBOUND = 1e6  # of the mesh's size: stands for an infinite radius


@exclusive
def screen_occlusion(
    hits: Hits,
    radius: float,
    *,
    directions: int = 6,
    steps: int = 6,
    falloff: str = "quadratic",
    bias: float = 0.05,
    blur: int = 21,
    zbuffer: Hits | None = None,
) -> np.ndarray:
    """Exposure of what a pinhole camera's pixels see to light from everywhere: (H, W) float32, 1 where nothing is hit.

    hits: of a Pinhole camera. radius: scene units within which surfaces cover each other; infinite for no limit.
    directions, steps: lines from each pixel and steps along each, 1 to 1024 (paper: 6 and 6, or 32 and 20). falloff:
    weight of what covers at a distance r, "quadratic" 1 - (r / radius)^2, "linear" 1 - r / radius, or "none". bias:
    radians above the tangent plane below which nothing counts. blur: pixels along a side of the blur that evens out the
    noise within surfaces, odd, 1 for none. zbuffer: hits on the same mesh by another camera whose samples are walked in
    place of the frame's own: one that sees more, and whose lines of the image are images of planes, such as a wider
    Pinhole or a graph camera; any camera with one image of each point is taken. Lines are turned and steps shifted by
    the pixel's own numbers, the same every time. Raises InputError.

    What the camera does not see covers nothing, and what it sees covers all that is behind it; the exposure is by solid
    angle, as `ambient_occlusion(weight="uniform")`, which is exact, and slow.
    """
    settings: dict[str, Any] = {"directions": directions, "steps": steps, "falloff": falloff, "bias": bias}
    exposure = screen_occlusion_device(hits, radius, blur=blur, zbuffer=zbuffer, **settings)
    return np.asarray(exposure.numpy()).reshape(hits.camera.height, hits.camera.width)


@exclusive
def screen_occlusion_device(
    hits: Hits,
    radius: float,
    *,
    directions: int = 6,
    steps: int = 6,
    falloff: str = "quadratic",
    bias: float = 0.05,
    blur: int = 21,
    zbuffer: Hits | None = None,
) -> Any:
    """As `screen_occlusion`, but it stays on the device: an evaluated Float, one entry per pixel."""
    import drjit as dr

    t = types()
    if not isinstance(hits, Hits):
        raise InputError(f"hits is a {type(hits).__name__}: give hits, mpcam.rasterize(pinhole, scene)")
    camera = check_screen(hits.camera)
    lines = whole_number("directions", directions, 1, MOST_LINES), whole_number("steps", steps, 1, MOST_LINES)
    length = checked_lengths(radius, falloff)
    if not is_number(bias) or not 0 <= bias < 0.5 * math.pi:
        raise InputError(f"bias={shown(bias)}: radians from 0 to below pi / 2 are needed")
    window = whole_number("blur", blur, 1, 255, unit="pixels")
    if window % 2 == 0:
        raise InputError(f"blur={blur}: an odd number of pixels is needed, so that it has a middle")
    count = camera.width * camera.height
    if hits.mesh.triangle_count == 0:
        return dr.ones(t.Float, count)
    device = device_mesh(hits.mesh)
    length = min(length / device.scale, _UNBOUND)
    pose = np.asarray(camera.camera_from_world, np.float64)[:3, :3]
    data = {
        "faces": device.faces,
        "vertices": device.vertices,
        "pose": opaque_numbers([*pose.ravel()]),
        "camera": opaque_numbers([camera.fx, camera.fy, camera.cx, camera.cy, 1.0 / device.scale]),
        "numbers": opaque_numbers([length, math.sin(bias), _THICKNESS * length]),
    }
    size = (camera.width, camera.height)
    surface = _surfaces(size)(hits.device_triangle, hits.device_depth, data)
    buffer = _planar(surface["z"], data)
    if zbuffer is None:
        exposure = _exposure(size, size, *lines, falloff)(surface, buffer, buffer, None, data)
    else:
        other, samples = _other(zbuffer, hits, device, data)
        shape = (zbuffer.camera.width, zbuffer.camera.height)
        exposure = _exposure(size, shape, *lines, falloff)(surface, buffer, samples, other, data)
    if window > 1:
        for step in ((1, 0), (0, 1)):
            exposure = _blur(size, step, window // 2)(exposure, surface, buffer, data)
    return exposure


def check_screen(camera: Any) -> Pinhole:
    """The camera, known to be a pinhole: its lines are images of planes through the eye."""
    if not isinstance(camera, Pinhole):
        raise InputError(f"screen occlusion is for a Pinhole camera, and this is a {type(camera).__name__}: give one")
    return camera


def checked_lengths(radius: Any, falloff: Any) -> float:
    """The radius, where it and the falloff are what they should be."""
    if not (is_number(radius) and radius > 0) and not (isinstance(radius, float) and radius == math.inf):
        raise InputError(f"radius={shown(radius)}: give a length above 0 in scene units, or math.inf")
    if falloff not in FALLOFFS:
        raise InputError(f"falloff={shown(falloff)}: allowed are {', '.join(FALLOFFS)}")
    if falloff != "none" and radius == math.inf:
        raise InputError(f"falloff={falloff!r} needs a radius that is not infinite: give one, or falloff='none'")
    return float(radius)


def _planar(z: Any, data: dict[str, Any]) -> Any:
    from mpcam_kernels.horizon import PlanarBuffer

    return PlanarBuffer(z, *data["camera"][:4])


@functools.cache
def _surfaces(size: tuple[int, int]) -> Any:
    """Kernel: z (infinite where nothing is hit) and unit normals towards the eye, in the camera's frame."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(triangle: Any, depth: Any, data: dict[str, Any]) -> Any:
        t = types()
        pixel = dr.arange(t.UInt, size[0] * size[1])
        hit = triangle >= 0
        face = t.UInt(dr.maximum(triangle, 0))
        corners = dr.gather(t.Array3u, data["faces"], face, hit)
        a, b, c = (dr.gather(t.Array3f, data["vertices"], corner, hit) for corner in corners)
        world, pose = dr.cross(b - a, c - a), data["pose"]
        normal = t.Array3f(*(pose[i] * world.x + pose[i + 1] * world.y + pose[i + 2] * world.z for i in (0, 3, 6)))
        fx, fy, cx, cy, scale = data["camera"]
        row = pixel // size[0]
        ahead = t.Array3f(
            (t.Float(pixel - row * size[0]) + 0.5 - cx) / fx, (t.Float(row) + 0.5 - cy) / fy, t.Float(1.0)
        )
        z = dr.select(hit, depth * scale * dr.rcp(dr.norm(ahead)), dr.inf)
        normal = dr.select(dr.dot(normal, ahead) > 0, -normal, normal)
        largest = dr.maximum(dr.maximum(abs(normal.x), abs(normal.y)), abs(normal.z))
        normal = normal * dr.select(largest > 0, 1.0 / largest, 0.0)
        normal = normal * dr.rsqrt(dr.maximum(dr.squared_norm(normal), 1e-30))
        # Edge-on, or without area: as if it faced the eye.
        facing = -dr.dot(normal, ahead) * dr.rcp(dr.norm(ahead))
        normal = dr.select(facing > 1e-4, normal, -ahead * dr.rcp(dr.norm(ahead)))
        return {"z": z, "normal": normal}

    return kernel


def _element(t: Any, size: tuple[int, int], surface: dict[str, Any], buffer: Any) -> tuple[Any, Any, Any]:
    """Pixel numbers, points and whether there is one."""
    import drjit as dr

    pixel = dr.arange(t.UInt, size[0] * size[1])
    row = pixel // size[0]
    hit = surface["z"] < dr.inf
    z = dr.select(hit, surface["z"], 1.0)
    x = (t.Float(pixel - row * size[0]) + 0.5 - buffer.cx) / buffer.fx
    y = (t.Float(row) + 0.5 - buffer.cy) / buffer.fy
    return pixel, t.Array3f(x * z, y * z, z), hit


def _other(zbuffer: Any, hits: Hits, device: Any, data: dict[str, Any]) -> tuple[Any, Any]:
    """Another camera as kernels take it, with the pose to its frame from that of the hits' camera, and its samples."""
    import drjit as dr

    from mpcam_kernels.horizon import PointBuffer

    if not isinstance(zbuffer, Hits):
        raise InputError(f"zbuffer is a {type(zbuffer).__name__}: give hits of another camera, mpcam.rasterize(...)")
    camera = zbuffer.camera
    need(camera, Projects, "zbuffer")
    if camera.images_per_point != 1:
        raise InputError(f"zbuffer needs one image for each point, and a {type(camera).__name__} may have more")
    if device_mesh(zbuffer.mesh) is not device:
        raise InputError("zbuffer is of another mesh: rasterize the same one by both cameras")
    own = np.asarray(hits.camera.camera_from_world, np.float64)
    eye = np.linalg.inv(own)[:3, 3]
    # To the hits' camera from the device's frame, and to the other camera's frame from there, in scene units.
    shift = (own[:3, :3] @ device.anchor + own[:3, 3]) / device.scale
    place = np.asarray(camera.camera_from_world, np.float64)
    turn = place[:3, :3] @ own[:3, :3].T
    away = place[:3, :3] @ eye + place[:3, 3]
    data["shift"] = opaque_numbers([*shift])
    data["other"] = opaque_numbers([*turn.ravel(), *away, device.scale])
    points = dr.ravel(_points()(zbuffer.device_triangle, zbuffer.device_weights, data))
    dr.eval(points)
    return device_camera(camera).on_device, PointBuffer(points)


@functools.cache
def _points() -> Any:
    """Kernel: what another camera's pixels see, in the frame of the hits' camera; z is infinite for nothing."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(triangle: Any, weights: tuple[Any, Any], data: dict[str, Any]) -> Any:
        t, hit = types(), triangle >= 0
        corners = dr.gather(t.Array3u, data["faces"], t.UInt(dr.maximum(triangle, 0)), hit)
        a, b, c = (dr.gather(t.Array3f, data["vertices"], corner, hit) for corner in corners)
        world = a + (b - a) * weights[0] + (c - a) * weights[1]
        pose, shift = data["pose"], data["shift"]
        rows = [pose[3 * i] * world.x + pose[3 * i + 1] * world.y + pose[3 * i + 2] * world.z for i in range(3)]
        x, y, z = (row + part for row, part in zip(rows, shift, strict=True))
        return t.Array3f(x, y, dr.select(hit, z, dr.inf))

    return kernel


@functools.cache
def _exposure(size: tuple[int, int], shape: tuple[int, int], directions: int, steps: int, falloff: str) -> Any:
    """Kernel: exposure by a z-buffer of a shape, the pinhole's own or another camera's."""
    import drjit as dr

    from mpcam_kernels import horizon
    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(surface: dict[str, Any], buffer: Any, samples: Any, other: Any, data: dict[str, Any]) -> Any:
        t = types()
        pixel, point, hit = _element(t, size, surface, buffer)
        radius, bias, _ = data["numbers"]
        view = -point * dr.rsqrt(dr.squared_norm(point))

        def own(way: Any) -> tuple[Any, Any, Any, Any]:
            x, y, scale = point.x / point.z, point.y / point.z, radius / point.z
            du, dv = buffer.fx * scale * (way.x - x * way.z), buffer.fy * scale * (way.y - y * way.z)
            return x * buffer.fx + buffer.cx, y * buffer.fy + buffer.cy, du, dv

        def seen(place: Any) -> tuple[Any, Any, Any]:
            pose = data["other"]
            rows = [sum(pose[3 * i + j] * place[j] for j in range(3)) * pose[12] + pose[9 + i] for i in range(3)]
            (u, v), _, valid = other.local_project(t.Array3f(*rows))[0]
            return u, v, valid

        def elsewhere(way: Any) -> tuple[Any, Any, Any, Any]:
            u, v, there = seen(point)
            ahead, down, near = seen(point + way * (radius * _STRIDE))
            there &= near
            stretch = dr.select(there, 1.0 / _STRIDE, 0.0)
            return u, v, dr.select(there, ahead - u, 0.0) * stretch, dr.select(there, down - v, 0.0) * stretch

        share = horizon.covered(
            t,
            samples,
            shape,
            point,
            surface["normal"],
            view,
            own if other is None else elsewhere,
            radius,
            bias,
            horizon.noise(t, pixel),
            directions,
            steps,
            falloff,
            hit,
        )
        return dr.select(hit, 1.0 - share, 1.0)

    return kernel


@functools.cache
def _blur(size: tuple[int, int], step: tuple[int, int], reach: int) -> Any:
    """Kernel: one pass of the blur."""
    from mpcam_kernels import horizon
    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(values: Any, surface: dict[str, Any], buffer: Any, data: dict[str, Any]) -> Any:
        t = types()
        pixel, point, hit = _element(t, size, surface, buffer)
        thickness = data["numbers"][2]
        return horizon.blurred(t, values, buffer, size, pixel, point, surface["normal"], step, reach, thickness, hit)

    return kernel
