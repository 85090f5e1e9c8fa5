"""What is seen in a mirror where light is reflected more than once: rays traced by Mitsuba, the truth."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_zero, types
from mpcam.cameras.ray_map import RayMap
from mpcam.cameras.types import Ray
from mpcam.decomposition.ray_error import bent
from mpcam.decomposition.reflector import reflector_of
from mpcam.effects.depth_image_choice import DepthImageChoice
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.hits import Hits
from mpcam.rendering.raytrace import RayTraced
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import Scene

OFF = 1e-5
"""How far rays start from the surface that they leave, as a share of the scene's extent."""


class ByTracedOrders:
    """The scene along the rays of the true surface, which what they meet reflects again; not made to be fast.

    shaded: colors of hits by a shading, on the device; None: that of the picture. choice: its bounces, reflectance and
    own count.
    """

    def __init__(
        self,
        scene: Scene,
        mirror: Mirror,
        ray: Ray,
        shaded: Callable[[Hits, str | None], Any],
        choice: DepthImageChoice,
    ):
        self.mesh, self.mirror, self.shaded, self.choice = scene.mesh, mirror, shaded, choice
        self.valid = np.asarray(ray.valid)
        self.start, self.along = np.asarray(ray.origin)[self.valid], np.asarray(ray.direction)[self.valid]
        low, high = self.mesh.bounds
        self.off = OFF * float(np.linalg.norm(high - low))
        ends = np.cumsum([len(one.faces) for one in scene.meshes])
        self.part = np.repeat(choice.reflectance, np.diff(ends, prepend=0)) if len(ends) else np.zeros(0)

    @property
    def stages(self) -> dict[str, str]:
        return {"rays of the true surface": f"traced anew in each frame, up to {self.choice.bounces} times"}

    def move(self, mesh: Mesh) -> None:
        self.mesh = mesh

    def colors(self) -> list[Any]:
        light = np.zeros((len(self.valid), 3))
        if self.valid.any():
            light[self.valid] = self._light()
        return [types().Float(aligned(part)) + opaque_zero() for part in light.T]

    def _light(self) -> np.ndarray:
        start, along = self.start, self.along
        light, through, going = np.zeros_like(start), np.ones_like(start), np.ones(len(start), bool)
        tint = np.asarray(self.mirror.color)
        for order in range(self.choice.bounces):
            last = order + 1 == self.choice.bounces
            hits, color, normal = self._met(start, along, going)
            depth = hits.depth[0].astype(np.float64)
            own, place, mirror_normal = self._met_mirror(start, along, depth)
            own &= going
            hit = hits.mask[0] & ~own
            part = np.where(hit, self.part[np.maximum(hits.triangle[0], 0)] if len(self.part) else 0.0, 0.0)
            normal = np.where(own[:, None], mirror_normal, normal)
            away, _ = bent(along, np.where((hit | own)[:, None], normal, (0.0, 0.0, 1.0)), None)
            if last:
                beyond = self._met(start, np.where(own[:, None], away, along), going & own, nothing=True)[1]
                seen, part = np.where(own[:, None], beyond * tint, color), np.zeros_like(part)
            else:
                seen = np.where(own[:, None], 0.0, color * (1 - part)[:, None])
            light += np.where(going[:, None], through * seen, 0.0)
            through = through * np.where(own[:, None], tint, part[:, None])
            going = going & (own | (part > 0))
            point = np.where(own[:, None], place, start + np.where(hit, depth, 0.0)[:, None] * along)
            start = np.where(going[:, None], point + self.off * away, start)
            along = np.where(going[:, None], away, along)
        return light

    def _met(
        self, start: np.ndarray, along: np.ndarray, valid: np.ndarray, nothing: bool = False
    ) -> tuple[Hits, np.ndarray, np.ndarray]:
        """First hits on the scene, their colors and normals; nothing: as if no triangle were there."""
        camera = RayMap(start[None], along[None])
        mesh = replace(self.mesh, faces=np.zeros((0, 3), np.int32), face_material=None) if nothing else self.mesh
        rays = Ray(start, along, valid)
        hits = RayTraced(camera, mesh, rays).frame()
        both = (self.shaded(hits, shading) for shading in (None, "normal"))
        color, normal = (np.stack([np.asarray(part.numpy()) for part in one], -1) for one in both)
        return hits, color.astype(np.float64), 2.0 * normal.astype(np.float64) - 1.0

    def _met_mirror(
        self, start: np.ndarray, along: np.ndarray, depth: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Whether rays meet the mirror before a depth, where, and its normals there."""
        if not self.choice.own:
            return np.zeros(len(start), bool), start, np.zeros_like(start)
        found = reflector_of(self.mirror.surface).first_hits(start + self.off * along, along)
        return found.hit & (found.distance + self.off < depth), found.points, found.normals
