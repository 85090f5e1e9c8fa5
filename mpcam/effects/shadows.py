"""Shadow maps: how far a light reaches in each direction, by depth-only views (Gascuel et al. 2008, section 5.3).

A point light looks around with two paraboloid views, parallel light with one orthographic view that holds the whole
scene. A surface element at distance r from the light is lit where the map is not nearer than the element. How much
nearer a texel may be without harm follows from the texel, not from a constant:

- With normals, the depth at which the element's own plane crosses the ray of the texel's center takes the place of r
  wherever it is less: a flat receiver never shades itself, however steep the light.
- One texel's width at the distance r is taken off on top of that, for the neighbor that meets the element in a corner,
  and for curved surfaces. An occluder nearer to its receiver than this is missed.
- Without normals, slopes are unknown and three widths are taken off.

The four texels around the element vote by their bilinear weights; half of the votes make it lit. So shadow edges are
off by less than a texel, and not towards either side in the mean.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.orthographic import Orthographic
from mpcam.effects.lookup import back_to_back, check_size, four_texels, pixels_per_radius, place, texel_direction
from mpcam.effects.relief_hits import relief_hits
from mpcam.effects.vectors import as_vectors
from mpcam.errors import InputError
from mpcam.math.pose import look_at
from mpcam.rendering.maps import DepthMap
from mpcam.rendering.methods import depth_map
from mpcam.rendering.shade import check_shadow_shading
from mpcam.scene.scene import DirectionalLight, Light, PointLight, Scene

SLACK, SLACK_WITHOUT_NORMALS = 1.0, 3.0  # widths of a texel
MARGIN = 2  # texels around what an orthographic map shows


@dataclass(frozen=True)
class PointShadow:
    """A point light's map in device memory, an argument for kernels.

    depth: Float, front view, then back view. light: the light's place (3 numbers), in world axes from the origin that
    the map was put on the device with. size: pixels along a side.
    """

    depth: Any
    light: list[Any]
    size: int

    def visible(self, point: Any, normal: Any | None) -> Any:
        """Whether light reaches points (Array3f, relative to that origin) with unit normals (Array3f, either side)."""
        import drjit as dr

        t, size = types(), self.size
        ray = t.Array3f(*(point[i] - self.light[i] for i in range(3)))
        distance = dr.norm(ray)
        u, v, start = place(ray, distance, size)
        width = (distance + abs(ray.x)) / pixels_per_radius(size)
        level = None if normal is None else dr.dot(ray, normal)

        def reach(column: Any, row: Any) -> Any:
            if normal is None:
                return distance
            return level / dr.dot(texel_direction(column, row, ray.x >= 0, size), normal)

        return _vote(self.depth, start, size, four_texels(u, v, size, size), reach, distance, width, normal is not None)


@dataclass(frozen=True)
class DirectionalShadow:
    """A directional light's map in device memory, an argument for kernels.

    depth: Float, one per texel. pose: rotation (9) and shift (3) to the map's frame from world axes at the origin that
    the map was put on the device with. scale: texels per scene unit. width, height: texels.
    """

    depth: Any
    pose: list[Any]
    scale: Any
    width: int
    height: int

    def visible(self, point: Any, normal: Any | None) -> Any:
        """Whether light reaches points (Array3f, relative to that origin) with unit normals (Array3f, either side)."""
        t, pose = types(), self.pose
        x, y, z = (_along(pose, i, point) + pose[9 + i] for i in range(3))
        u, v = x * self.scale + 0.5 * self.width, y * self.scale + 0.5 * self.height
        slopes = None
        if normal is not None:
            across = _along(pose, 2, normal) * self.scale
            slopes = _along(pose, 0, normal) / across, _along(pose, 1, normal) / across

        def reach(column: Any, row: Any) -> Any:
            if slopes is None:
                return z
            return z - (t.Float(column) + 0.5 - u) * slopes[0] - (t.Float(row) + 0.5 - v) * slopes[1]

        corners = four_texels(u, v, self.width, self.height)
        return _vote(self.depth, 0, self.width, corners, reach, z, 1.0 / self.scale, normal is not None)


def _along(pose: list[Any], row: int, vector: Any) -> Any:
    return pose[3 * row] * vector[0] + pose[3 * row + 1] * vector[1] + pose[3 * row + 2] * vector[2]


def _vote(
    depth: Any, start: Any, stride: int, corners: list[Any], reach: Any, distance: Any, width: Any, plane: bool
) -> Any:
    """Whether texels with half of the weight at least are not nearer than the receiver, less the slack."""
    import drjit as dr

    t = types()
    slack = width * (SLACK if plane else SLACK_WITHOUT_NORMALS)
    votes = t.Float(0.0)
    for column, row, weight in corners:
        found = dr.gather(t.Float, depth, t.UInt(start + row * stride + column))
        level = reach(column, row)
        # A plane seen edge-on, or from behind at this texel, gives no depth to compare with: the comparison is false.
        level = dr.select((level > 0) & (level < distance), level, distance)
        votes += dr.select(found >= level - slack, weight, 0.0)
    return votes >= 0.5


class ShadowMap:
    """Which places a light reaches.

    light: the light that it was made for. cameras: the views, two for a point light and one for a directional light.
    depths: their depths, (H, W) float32 each, infinite where the light meets nothing.
    """

    def __init__(self, light: Light, cameras: tuple[Any, ...], maps: tuple[Any, ...]):
        import drjit as dr

        self.light, self.cameras, self._maps = light, cameras, maps
        self._depth = maps[0].device_depth
        for more in maps[1:]:
            self._depth = dr.concat((self._depth, more.device_depth))
        dr.eval(self._depth)

    @property
    def depths(self) -> tuple[np.ndarray, ...]:
        """Distances from the light (from the camera's plane for parallel light), one (H, W) float32 per camera."""
        return tuple(one.depth for one in self._maps)

    @exclusive
    def on_device(self, origin: Any = (0.0, 0.0, 0.0)) -> PointShadow | DirectionalShadow:
        """The map in device memory with a method `visible` for kernels, for points relative to a world position.

        origin (3,): near the points, so that float32 holds them.
        """
        camera, origin = self.cameras[0], np.asarray(origin, np.float64)
        if isinstance(self.light, PointLight):
            return PointShadow(self._depth, opaque_numbers(list(self.light.position - origin)), camera.width)
        pose = np.asarray(camera.camera_from_world)
        numbers = opaque_numbers([*pose[:3, :3].ravel(), *(pose[:3, :3] @ origin + pose[:3, 3]), camera.scale])
        return DirectionalShadow(self._depth, numbers[:12], numbers[12], camera.width, camera.height)

    @exclusive
    def visible(self, points: Any, normals: Any = None) -> np.ndarray:
        """Whether the light reaches points: (...) bool.

        points (..., 3): world. normals (..., 3): of the surface that the points lie on, either side, any length above
        0; without them the test is coarser. Which side of the surface is lit is not asked. Raises InputError for other
        shapes, for what is not finite, and for zero normals.
        """
        world = as_vectors(points, "points")
        across = None if normals is None else as_vectors(normals, "normals", unit=True)
        if across is not None and across.shape != world.shape:
            raise InputError(
                f"normals have shape {across.shape} and points {world.shape}: give a normal for each point"
            )
        if world.size == 0:
            return np.zeros(world.shape[:-1], bool)
        origin = world.reshape(-1, 3)[0]
        normal = None if across is None else _upload(across)
        lit = self.on_device(origin).visible(_upload(world - origin), normal)
        return np.asarray(lit.numpy()).reshape(world.shape[:-1])

    def __repr__(self) -> str:
        sizes = " + ".join(f"{camera.width}x{camera.height}" for camera in self.cameras)
        return f"ShadowMap({sizes}, {self.light})"


def _upload(vectors: np.ndarray) -> Any:
    return types().Array3f(np.ascontiguousarray(vectors.reshape(-1, 3).T, np.float32))


def shadow_map(scene: Any, light: Light, size: int = 1024) -> ShadowMap:
    """The shadow map of a light: two paraboloid depth maps for a PointLight, one orthographic for a DirectionalLight.

    scene: a Scene, its reliefs too, a Mesh or several meshes. light: need not be one of the scene's. size: pixels along
    a side, of the longer one for parallel light; 8 to 16384. Raises InputError.
    """
    if not isinstance(light, Light):
        raise InputError(f"light is a {type(light).__name__}: give a PointLight or a DirectionalLight")
    size, whole = check_size(size), Scene.of(scene)
    if isinstance(light, PointLight):
        cameras: tuple[Any, ...] = back_to_back(light.position, size)
    else:
        cameras = (_enclosing(whole, light, size),)
    return ShadowMap(light, cameras, tuple(_depth(camera, whole) for camera in cameras))


def _depth(camera: Any, scene: Scene) -> DepthMap:
    """How far the first surface is, of a mesh or a relief."""
    import drjit as dr

    found = depth_map(camera, scene.mesh)
    if not scene.reliefs:
        return found
    seen = relief_hits(camera, scene.reliefs, found.device_depth)
    nearest = dr.minimum(found.device_depth, seen.device_depth)
    dr.eval(nearest)
    return DepthMap(camera, nearest)


def shadow_maps(scene: Scene, size: int = 1024, shading: str = "light") -> tuple[ShadowMap, ...]:
    """A shadow map for each light of a scene, in their order; raises InputError where nothing can cast shadows."""
    check_shadow_shading(shading)
    if not scene.lights:
        raise InputError("shadows: the scene has no lights; give it a DirectionalLight or a PointLight, or no shadows")
    return tuple(shadow_map(scene, light, check_size(size, "shadow_size")) for light in scene.lights)


def _enclosing(scene: Scene, light: DirectionalLight, size: int) -> Orthographic:
    """An orthographic camera that looks along the light and holds the whole scene, with a margin of a few texels."""
    pose = look_at((0.0, 0.0, 0.0), light.direction)
    used = np.concatenate([scene.mesh.corners.reshape(-1, 3), *(one.boxes.vertices for one in scene.reliefs)])
    with np.errstate(invalid="ignore", over="ignore"):
        seen = used @ pose[:3, :3].T
    seen = seen[np.isfinite(seen).all(axis=1)]
    low, high = (seen.min(0), seen.max(0)) if len(seen) else (np.zeros(3), np.zeros(3))
    extent = high - low
    longest = float(extent.max()) or 1.0
    scale = (size - 2 * MARGIN) / (float(extent[:2].max()) or longest)
    width, height = (min(size, int(np.ceil(scale * extent[i])) + 2 * MARGIN) for i in range(2))
    middle = 0.5 * low + 0.5 * high
    pose[:3, 3] = (-middle[0], -middle[1], 0.01 * longest - low[2])  # the plane stands off: depths are above 0
    return Orthographic(max(width, 1), max(height, 1), scale, camera_from_world=pose)
