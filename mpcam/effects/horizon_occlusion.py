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
from collections.abc import Sequence
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.pinhole import Pinhole
from mpcam.effects.occlusion_buffers import buffer_share, checked_backs, checked_buffer, reaches_of
from mpcam.effects.screen_elements import element
from mpcam.errors import InputError
from mpcam.rendering.device import device_mesh
from mpcam.rendering.hits import Hits
from mpcam.scene.occlusion import Occlusion

_THICKNESS = 0.05  # of the radius: off the tangent plane, where the blur's weight has fallen to 1 / e
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
    zbuffer: Hits | Sequence[Hits] | None = None,
    thickness: float | None = None,
    backs: Hits | Sequence[Hits] | None = None,
) -> np.ndarray:
    """Exposure of what a pinhole camera's pixels see to light from everywhere: (H, W) float32, 1 where nothing is hit.

    hits: of a Pinhole camera. radius: scene units within which surfaces cover each other; infinite for no limit.
    directions, steps: lines from each pixel and steps along each, 1 to 1024 (paper: 6 and 6, or 32 and 20). falloff:
    weight of what covers at a distance r, "quadratic" 1 - (r / radius)^2, "linear" 1 - r / radius, or "none". bias:
    radians above the tangent plane below which nothing counts. blur: pixels along a side of the blur that evens out the
    noise within surfaces, odd, 1 for none. zbuffer: hits on the same mesh by another camera whose samples are walked in
    place of the frame's own, such as a wider Pinhole or a graph camera; any camera with one image of each point is
    taken. Or several, of which each adds what those before it do not hold; with thickness alone, hits themselves may be
    among them. thickness: scene units by which what is seen reaches back from the eye; the gaps behind are open. None:
    it reaches back without end. Lines are turned and steps shifted by the pixel's own numbers, the same every time.
    Raises InputError.

    What no z-buffer holds covers nothing. The exposure is by solid angle, as `ambient_occlusion(weight="uniform")`,
    which is exact, and slow.
    """
    occlusion = Occlusion(radius, thickness, directions, steps, falloff, bias, blur)
    exposure = screen_occlusion_device(hits, occlusion, zbuffer=zbuffer, backs=backs)
    return np.asarray(exposure.numpy()).reshape(hits.camera.height, hits.camera.width)


@exclusive
def screen_occlusion_device(
    hits: Hits,
    occlusion: Occlusion,
    *,
    zbuffer: Hits | Sequence[Hits] | None = None,
    backs: Hits | Sequence[Hits] | None = None,
) -> Any:
    """As `screen_occlusion`, but it stays on the device: an evaluated Float, one entry per pixel."""
    import drjit as dr

    t = types()
    if not isinstance(hits, Hits):
        raise InputError(f"hits is a {type(hits).__name__}: give hits, mpcam.rasterize(pinhole, scene)")
    camera = check_screen(hits.camera)
    lines, window, falloff = (occlusion.directions, occlusion.steps), occlusion.blur, occlusion.falloff
    back, buffers = occlusion.thickness, _checked_buffers(hits, zbuffer, occlusion.thickness)
    count = camera.width * camera.height
    if hits.mesh.triangle_count == 0:
        return dr.ones(t.Float, count)
    device = device_mesh(hits.mesh)
    length = min(float(occlusion.radius) / device.scale, _UNBOUND)
    pose = np.asarray(camera.camera_from_world, np.float64)[:3, :3]
    data = {
        "faces": device.faces,
        "vertices": device.vertices,
        "pose": opaque_numbers([*pose.ravel()]),
        "camera": opaque_numbers([camera.fx, camera.fy, camera.cx, camera.cy, 1.0 / device.scale]),
        "numbers": opaque_numbers(
            [length, math.sin(occlusion.bias), _THICKNESS * length, (back or 0.0) / device.scale]
        ),
    }
    size = (camera.width, camera.height)
    surface = _surfaces(size)(hits.device_triangle, hits.device_depth, data)
    buffer = _planar(surface["z"], data)
    reaches = reaches_of(buffers, checked_backs(backs, buffers, back), back)
    exposure = dr.ones(t.Float, count)
    for number, (other, reach) in enumerate(zip(buffers, reaches, strict=True)):
        if other is hits:
            share = _exposure(size, *lines, falloff)(surface, buffer, reach, data)
        else:
            share = buffer_share(other, buffers[:number], hits, (surface, buffer, data), (*lines, falloff), reach)
        exposure = exposure * (1.0 - share)
        dr.eval(exposure)
    if window > 1:
        for step in ((1, 0), (0, 1)):
            exposure = _blur(size, step, window // 2)(exposure, surface, buffer, data)
    return exposure


def check_screen(camera: Any) -> Pinhole:
    """The camera, known to be a pinhole: its lines are images of planes through the eye."""
    if not isinstance(camera, Pinhole):
        raise InputError(f"screen occlusion is for a Pinhole camera, and this is a {type(camera).__name__}: give one")
    return camera


def _checked_buffers(hits: Hits, zbuffer: Any, thickness: float | None) -> list[Hits]:
    """The z-buffers that are walked, in order."""
    if zbuffer is None:
        return [hits]
    if not isinstance(zbuffer, (list, tuple)):
        return [checked_buffer(zbuffer, hits)]
    if not zbuffer or (thickness is None and len(zbuffer) > 1):
        raise InputError(
            f"zbuffer has {len(zbuffer)} entries: several need thickness=, a length, since what reaches back without "
            "end from one eye hides what the others see"
            if zbuffer
            else "zbuffer is empty: give hits of a camera, or None for the frame's own"
        )
    return [checked_buffer(one, hits) for one in zbuffer]


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


@functools.cache
def _exposure(size: tuple[int, int], directions: int, steps: int, falloff: str) -> Any:
    """Kernel: share that is covered by what the pinhole sees itself."""
    import drjit as dr

    from mpcam_kernels import horizon
    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(surface: dict[str, Any], buffer: Any, reach: Any, data: dict[str, Any]) -> Any:
        t = types()
        pixel, point, hit = element(t, size, surface, buffer)
        radius, bias, _, _ = data["numbers"]
        view = -point * dr.rsqrt(dr.squared_norm(point))

        def lines(way: Any) -> tuple[Any, Any, Any, Any]:
            x, y, scale = point.x / point.z, point.y / point.z, radius / point.z
            du, dv = buffer.fx * scale * (way.x - x * way.z), buffer.fy * scale * (way.y - y * way.z)
            return x * buffer.fx + buffer.cx, y * buffer.fy + buffer.cy, du, dv

        settings = radius, bias, horizon.noise(t, pixel), directions, steps, falloff, hit, reach
        return horizon.covered(t, buffer, size, point, surface["normal"], view, lines, *settings)

    return kernel


@functools.cache
def _blur(size: tuple[int, int], step: tuple[int, int], reach: int) -> Any:
    """Kernel: one pass of the blur."""
    from mpcam_kernels import horizon
    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(values: Any, surface: dict[str, Any], buffer: Any, data: dict[str, Any]) -> Any:
        t = types()
        pixel, point, hit = element(t, size, surface, buffer)
        thickness = data["numbers"][2]
        return horizon.blurred(t, values, buffer, size, pixel, point, surface["normal"], step, reach, thickness, hit)

    return kernel
