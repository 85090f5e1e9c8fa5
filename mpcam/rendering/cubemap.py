"""The usual detour: render linear views of a cube's or half a cube's faces, then look every pixel's ray up in them."""

import functools
from typing import Any

import numpy as np

from mpcam.backend import exclusive, types
from mpcam.cameras.base import Camera
from mpcam.cameras.pinhole import Pinhole
from mpcam.checks import whole_number
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.math import PI
from mpcam.rendering.clock import Clock
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.explanation import Step, timed_steps
from mpcam.rendering.hits import Hits, Stats
from mpcam.rendering.invert import Inverted
from mpcam.rendering.moving import Moving

# Right, down and forward axes of each face in the camera frame: front, +x, -x, +y, -y, back.
_AXES = np.array(
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
    ],
    np.float64,
)


def face_cameras(camera: Camera, resolution: int, half: bool) -> list[Pinhole]:
    """Pinholes with 90 degrees across for the faces around a camera; half: only what lies in front of its plane."""
    cameras = []
    for number in range(5 if half else 6):
        pose = np.eye(4)
        pose[:3, :3] = _AXES[number]
        size, center = [resolution, resolution], [0.5 * resolution, 0.5 * resolution]
        if half and number:
            side = 0 if number < 3 else 1
            size[side] = (resolution + 1) // 2
            center[side] = 0.5 * resolution if number in (1, 3) else size[side] - 0.5 * resolution
        focal = 0.5 * resolution
        pose = pose @ np.asarray(camera.camera_from_world)
        cameras.append(Pinhole(size[0], size[1], focal, focal, center[0], center[1], pose))
    return cameras


class Cubemapped(Moving):
    """Frames resampled from the faces of a cube around the camera: nearest texel, so hits stay real hits."""

    method = "cubemap"
    half = False

    @exclusive
    def __init__(self, camera: Camera, mesh: Mesh, resolution: int = 256):
        resolution = whole_number("resolution", resolution, 1, 16384, unit="pixels")
        self._check(camera)
        self.resolution = resolution
        self._prepare_mesh(mesh)
        self.views = [Inverted(face, mesh) for face in face_cameras(camera, self.resolution, self.half)]
        self.camera, self.device_camera = camera, device_camera(camera)

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another camera, or another pose of it: the scene stays as it is. Raises InputError as at the beginning."""
        self._check(camera)
        for face, view in zip(self.views, face_cameras(camera, self.resolution, self.half), strict=True):
            face.aim(view)
        self.camera, self.device_camera = camera, device_camera(camera)

    def _check(self, camera: Camera) -> None:
        angle = camera.domain.max_angle
        if camera.ray_geometry != "central" or angle is None:
            raise InputError(f"method={self.method!r} needs a camera with one center, not {type(camera).__name__}")
        if self.half and angle > 0.5 * PI + 1e-9:
            raise InputError(
                f"method='hemicube' sees 180 degrees, the camera {np.degrees(2 * angle):.0f}: use method='cubemap'"
            )

    def _reframed(self) -> None:
        pass  # faces do it for themselves

    @exclusive
    def move(self, mesh: Mesh) -> None:
        """See `Moving.move`."""
        super().move(mesh)
        for face in self.views:
            face.move(mesh)

    @exclusive
    def frame(self) -> Hits:
        """One frame, evaluated."""
        return self._hits([face.buffer() for face in self.views])

    @exclusive
    def stages(self) -> dict[str, float]:
        """Seconds of one frame by stage."""
        clock = Clock()
        frames = [face.buffer() for face in self.views]
        clock.done("faces", frames)
        self._hits(frames)
        clock.done("resample")
        return clock.seconds

    def explain(self) -> tuple[Step, ...]:
        """The stages of a frame; takes one frame to find out."""
        return tuple(timed_steps(self.stages(), self.method))

    def _hits(self, frames: list[tuple[Any, Any]]) -> Hits:
        buffers = [buffer for _, buffer in frames]
        look_up = _frozen_look_up(self.resolution, self.half)
        ray = self.device_camera.ray
        triangle, depth, texel = look_up(ray.direction, ray.valid, buffers, self.unit)

        def weights() -> tuple[Any, Any]:
            import drjit as dr

            from mpcam_kernels import decode, ray_triangle

            if self.mesh.triangle_count == 0:
                return depth * 0.0, depth * 0.0
            directions = _texel_directions(texel, self.resolution, self.half)
            front = self.views[0]  # its frame is the camera's own
            found = decode.weights(
                types(), ray_triangle, frames[0][0][0], front.faces, triangle, directions, types().Array4f
            )
            dr.eval(found)
            return found

        def stats() -> Stats:
            if self.mesh.triangle_count == 0:
                return Stats(0, 0)
            counts = np.sum([face.count(placed) for face, (placed, _) in zip(self.views, frames, strict=True)], 0)
            return Stats(int(counts[0]), int(counts[1]))

        return Hits(self.camera, self.mesh, self.method, triangle, depth, weights, stats)


class Hemicubed(Cubemapped):
    """Frames resampled from the front face and the front halves of the four side faces of a cube."""

    method = "hemicube"
    half = True


def _layout(resolution: int, half: bool) -> list[tuple[int, int, int]]:
    """Width, height and first texel of each face."""
    faces, start = [], 0
    for number in range(5 if half else 6):
        width = (resolution + 1) // 2 if half and number in (1, 2) else resolution
        height = (resolution + 1) // 2 if half and number in (3, 4) else resolution
        faces.append((width, height, start))
        start += width * height
    return faces


def _texel(direction: Any, resolution: int, half: bool) -> Any:
    """Number of the texel that a direction of the camera frame falls into."""
    import drjit as dr

    t = types()
    x, y, z = direction
    far = dr.maximum(dr.maximum(dr.maximum(abs(x), abs(y)), abs(z)), 1e-30)
    number = dr.select(abs(x) == far, dr.select(x > 0, 1, 2), dr.select(y > 0, 3, 4))
    number = dr.select(abs(z) == far, dr.select(z > 0, 0, 5), number)
    result = t.UInt(0)
    for face, (width, height, start) in enumerate(_layout(resolution, half)):
        right, down, _ = _AXES[face]
        u, v = (sum(float(axis[i]) * direction[i] for i in range(3) if axis[i]) / far for axis in (right, down))
        shift_u = 0 if face != 2 else resolution - width
        shift_v = 0 if face != 4 else resolution - height
        column = dr.clip(t.Int(dr.floor(0.5 * resolution * (1 + u))) - shift_u, 0, width - 1)
        row = dr.clip(t.Int(dr.floor(0.5 * resolution * (1 + v))) - shift_v, 0, height - 1)
        result = dr.select(number == face, t.UInt(row * width + column + start), result)
    return result


def _texel_directions(texel: Any, resolution: int, half: bool) -> Any:
    """Camera-frame directions (not of unit length) through texel centers."""
    import drjit as dr

    t = types()
    result = t.Array3f(0, 0, 1)
    for face, (width, height, start) in enumerate(_layout(resolution, half)):
        inside = (texel >= start) & (texel < start + width * height)
        local = dr.select(inside, texel - start, 0)
        shift_u = 0 if face != 2 else resolution - width
        shift_v = 0 if face != 4 else resolution - height
        u = (t.Float(local % width + shift_u) + 0.5) * (2 / resolution) - 1
        v = (t.Float(local // width + shift_v) + 0.5) * (2 / resolution) - 1
        right, down, forward = _AXES[face]
        axes = [u * float(right[i]) + v * float(down[i]) + float(forward[i]) for i in range(3)]
        result = dr.select(inside, t.Array3f(*axes), result)
    return result


@functools.cache
def _frozen_look_up(resolution: int, half: bool) -> Any:
    import drjit as dr

    from mpcam_kernels import decode, samples
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.outputs import HitKeys

    @frozen
    def look_up(directions: Any, valid: Any, buffers: list[Any], unit: Any) -> tuple[Any, Any, Any]:
        t = types()
        texel = _texel(directions, resolution, half)
        found = t.UInt64(0)
        for buffer, (width, height, start) in zip(buffers, _layout(resolution, half), strict=True):
            inside = valid & (texel >= start) & (texel < start + width * height)
            local = texel - start
            at = samples.slot_of(local % width, local // width, width)
            found = dr.select(inside, dr.gather(t.UInt64, buffer, at, inside), found)
        return decode.triangles(t, HitKeys, found), decode.depths(t, HitKeys, found, unit), texel

    return look_up
