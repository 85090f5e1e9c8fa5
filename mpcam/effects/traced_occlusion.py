"""Exposure within a radius by traced rays: the truth for `screen_occlusion`, with the same weights (Mitsuba)."""

import math
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.checks import whole_number
from mpcam.effects.occlusion import OFFSET
from mpcam.errors import InputError
from mpcam.rendering.device import device_mesh
from mpcam.rendering.hits import Hits
from mpcam.scene.occlusion import checked_lengths

_GOLDEN = math.pi * (3.0 - 5.0**0.5)  # turn from one point of the spiral to the next
MOST_RAYS = 1 << 20


@exclusive
def traced_occlusion(hits: Hits, radius: float, *, falloff: str = "quadratic", rays: int = 256) -> np.ndarray:
    """Exposure of what pixels see, by rays evenly over each hemisphere: (H, W) float32, 1 where nothing is hit.

    hits: of any camera; the whole of their mesh covers, whether it is seen or not. radius, falloff: as for
    `screen_occlusion`. rays: from each pixel, up to 1,048,576, turned by a random angle that is the same every time.
    The error falls at least with the root of their number. Raises InputError.
    """
    import drjit as dr

    from mpcam.tracing.meshes import mitsuba_mesh
    from mpcam.tracing.variant import mitsuba
    from mpcam_kernels.horizon import noise

    if not isinstance(hits, Hits):
        raise InputError(f"hits is a {type(hits).__name__}: give hits, mpcam.rasterize(camera, scene)")
    radius, count = checked_lengths(radius, falloff), whole_number("rays", rays, 1, MOST_RAYS)
    t, mesh, shape = types(), hits.mesh, (hits.camera.height, hits.camera.width)
    if mesh.triangle_count == 0:
        return np.ones(shape, np.float32)
    device = device_mesh(mesh)
    origin, frame = _elements(hits, device)
    limit, scale = opaque_numbers([min(radius / device.scale, 1e6), 1.0])
    pixel = dr.arange(t.UInt, shape[0] * shape[1])
    turn = noise(t, pixel)[0] * (2 * math.pi)
    hit = hits.device_triangle >= 0
    total = dr.zeros(t.Float, shape[0] * shape[1])
    kept = np.isfinite(mesh.corners).all(axis=(1, 2))
    vertices = dr.select(dr.isfinite(device.vertices), device.vertices, 0.0)
    with mitsuba() as mi:
        scene = mi.load_dict({"type": "scene", "mesh": mitsuba_mesh(mi, "mesh", vertices, mesh.faces[kept])})
        for number in range(count):
            up, place = opaque_numbers([(number + 0.5) / count, number * _GOLDEN % (2 * math.pi)])
            sine, cosine = dr.sincos(turn + place)
            flat = dr.sqrt(dr.maximum(1.0 - up * up, 0.0)) * scale
            way = frame[0] * (flat * cosine) + frame[1] * (flat * sine) + frame[2] * up
            ray = mi.Ray3f(mi.Point3f(*map(mi.Float, origin)), mi.Vector3f(*map(mi.Float, way)))
            found = scene.ray_intersect_preliminary(ray, active=mi.Bool(hit))
            distance = dr.select(t.Bool(found.is_valid()), t.Float(dr.detach(found.t)), dr.inf)
            total += dr.select(hit & (distance < limit), _weight(falloff, distance / limit), 0.0)
            dr.eval(total)
    return 1.0 - np.asarray(total.numpy()).reshape(shape) / count


def _weight(falloff: str, part: Any) -> Any:
    return {"quadratic": 1.0 - part * part, "linear": 1.0 - part, "none": 1.0}[falloff]


def _elements(hits: Hits, device: Any) -> tuple[Any, tuple[Any, Any, Any]]:
    """Points a little off the faces in the device's frame, and there two directions along them and their normal."""
    import drjit as dr

    t = types()
    hit = hits.device_triangle >= 0
    corners = dr.gather(t.Array3u, device.faces, t.UInt(dr.maximum(hits.device_triangle, 0)), hit)
    a, b, c = (dr.gather(t.Array3f, device.vertices, corner, hit) for corner in corners)
    second, third = hits.device_weights
    normal = dr.normalize(dr.select(hit, dr.cross(b - a, c - a), t.Array3f(0, 0, 1)))
    pose, ahead = np.asarray(hits.view.pose, np.float64)[:3, :3], hits.view.ray.direction
    numbers = opaque_numbers([*pose.ravel()])
    away = t.Array3f(*(sum(numbers[3 * j + i] * ahead[j] for j in range(3)) for i in range(3)))
    normal = dr.select(dr.dot(normal, away) > 0, -normal, normal)
    point = a + (b - a) * second + (c - a) * third + normal * OFFSET
    sign = dr.copysign(t.Float(1.0), normal.z)
    slope = -1.0 / (sign + normal.z)
    mixed = normal.x * normal.y * slope
    along = t.Array3f(1.0 + sign * normal.x * normal.x * slope, sign * mixed, -sign * normal.x)
    across = t.Array3f(mixed, sign + normal.y * normal.y * slope, -normal.y)
    dr.eval(point, along, across, normal)
    return point, (along, across, normal)
