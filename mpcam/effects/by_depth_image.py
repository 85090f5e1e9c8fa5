"""What is seen in a mirror by depth images: its rays are met with them, one by one (Rosen et al. 2011, section 6.1)."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_numbers, opaque_zero, types
from mpcam.cameras.types import Ray
from mpcam.decomposition.reflector import reflector_of
from mpcam.depth_images.depth_image import DepthImage
from mpcam.depth_images.several import intersect
from mpcam.effects.depth_image_choice import DepthImageChoice
from mpcam.effects.depth_image_orders import MIRROR, Surroundings, after_meeting
from mpcam.effects.depth_image_views import APART, View, ball_of, how_to_render, thing_view, used_vertices
from mpcam.effects.lookup import back_to_back
from mpcam.effects.shown_images import ShownImages
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import part_of
from mpcam.rendering.device_camera import world_rays
from mpcam.scene.mirror import Mirror
from mpcam.scene.refractor import Refractor
from mpcam.scene.scene import Scene


class ByDepthImages:
    """The scene's depth images, met by the rays that the true surface sends on.

    eye (3,): of the camera. ray: one for each of its pixels, row by row, `width` in each. Rays that meet nothing see
    the scene's environment, or its background.
    """

    def __init__(
        self,
        scene: Scene,
        mirror: Mirror | Refractor,
        eye: np.ndarray,
        ray: Ray,
        width: int,
        shading: str,
        shadows: Callable[[], Sequence[Any]],
        choice: DepthImageChoice,
    ):
        self.scene, self.shading, self.shadows, self.choice = scene, shading, shadows, choice
        valid = _in_squares(np.flatnonzero(ray.valid), width)
        kept = valid if len(valid) else np.zeros(1, np.int64)
        self.ray = Ray(*(np.asarray(part)[kept] for part in ray))
        self.posed = world_rays(self.ray)
        place = np.full(len(ray.valid), -1, np.int32)
        place[valid] = np.arange(len(valid))
        self._place = types().Int(aligned(place, np.int32)) + types().Int(opaque_zero())
        self.shown = self._all_shown(scene)
        self.own = own_images(mirror, eye, choice.size, choice.aside) if choice.own else []
        self._tint, self._background = opaque_numbers(list(mirror.color)), opaque_numbers(list(scene.background))

    def _all_shown(self, scene: Scene) -> list[ShownImages]:
        more = self.choice.bounces > 1
        found = self._views(scene)
        return [ShownImages(self.scene, view, part, self.shading, more, self.shadows()) for view, part in found]

    def _views(self, scene: Scene) -> list[tuple[View, float]]:
        return self.choice.views(scene, np.asarray(self.ray.origin), np.asarray(self.ray.direction))

    @property
    def images(self) -> list[DepthImage]:
        """Those that rays are met with, in order; the mirror's own last."""
        return [*self.choice.given, *(image for shown in self.shown for image in shown.images), *self.own]

    @property
    def stages(self) -> dict[str, str]:
        kinds = ", ".join(f"{type(i.camera).__name__} {i.camera.width}x{i.camera.height}" for i in self.images)
        orders = "" if self.choice.bounces == 1 else f", up to {self.choice.bounces} times by stored normals"
        return {
            "depth images": kinds or "none, since there is nothing to see",
            "rays of the true surface": f"followed over the depth images{orders}",
        }

    def move(self, mesh: Mesh) -> None:
        """Renders the depth images anew, from other places where the meshes have left the views."""
        left = [not shown.holds(mesh) for shown in self.shown]
        fresh: list[View | None] = [None] * len(self.shown)
        if any(left):
            ends = np.cumsum([0] + [len(one.vertices) for one in self.scene.meshes])
            rows = [slice(int(a), int(b)) for a, b in zip(ends, ends[1:], strict=False)]
            now = [part_of(mesh, one, (span,)) for one, span in zip(self.scene.meshes, rows, strict=True)]
            views = [view for view, _ in self._views(replace(self.scene, meshes=tuple(now)))]
            if [(v.kind, v.meshes) for v in views] != [(s.view.kind, s.view.meshes) for s in self.shown]:
                self.shown = self._all_shown(replace(self.scene, meshes=tuple(now)))
                fresh = [None] * len(self.shown)
            else:
                fresh = [view if gone else None for view, gone in zip(views, left, strict=True)]
        for shown, view in zip(self.shown, fresh, strict=True):
            shown.move(mesh, view, self.shadows())

    def colors(self) -> list[Any]:
        return list(_placed()(self._place, self.seen()))

    def seen(self) -> Any:
        """What the rays see: an Array3f, one entry for each."""
        import drjit as dr

        t, images, environment = types(), self.images, self.scene.environment
        on_device = None if environment is None else environment.on_device
        mirrors = [MIRROR] * len(self.own)
        parts = [0.0] * len(self.choice.given) + [s.reflectance for s in self.shown for _ in s.images] + mirrors
        around = Surroundings(t.Float(aligned(parts or [0.0])) + opaque_zero(), self._tint, self._background, on_device)
        count = dr.width(self.posed.ray.valid)
        light, through = dr.zeros(t.Array3f, count), dr.full(t.Array3f, 1.0, count)
        if not images:
            return _missed()(self.posed.ray.direction, around)
        rays, many = self.posed, self.choice.bounces
        for order in range(many):
            leaving = order > 0 or bool(self.own)
            found = intersect(images, rays, coarse=self.choice.coarse, fine=self.choice.fine, leaving=leaving)
            light, through, rays = after_meeting(found, rays, light, through, around, many > 1, order + 1 == many)
        return light


def own_images(mirror: Mirror | Refractor, eye: np.ndarray, size: int, aside: float) -> list[DepthImage]:
    """Depth images, with normals, of the mirror itself, as the eye sees it, or all around where the eye is within."""
    mesh = reflector_of(mirror.surface).mesh
    center, radius = ball_of(used_vertices(mesh))
    if np.linalg.norm(eye - center) > APART * radius:
        cameras = thing_view(0, center, radius, eye, size, aside).cameras
    else:
        cameras = back_to_back(eye, size)
    images = []
    for camera in cameras:
        method, settings = how_to_render(camera, mesh)
        images.append(DepthImage.render(camera, mesh, method, normals=True, shading="color", **settings))
    return images


def _in_squares(pixel: np.ndarray, width: int) -> np.ndarray:
    """Numbers of pixels in the order of squares of 4 x 4: neighbors in a packet of lanes take similar steps."""
    row, column = pixel // width, pixel % width
    return pixel[np.lexsort((column % 4, row % 4, column // 4, row // 4))]


@functools.cache
def _placed() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(place: Any, light: Any) -> Any:
        t = types()
        return dr.gather(t.Array3f, light, t.UInt(dr.maximum(place, 0)), place >= 0)

    return kernel


@functools.cache
def _missed() -> Any:
    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(direction: Any, around: Surroundings) -> Any:
        t = types()
        if around.environment is not None:
            return around.environment.lookup(direction)
        return t.Array3f(*around.background) + 0 * direction

    return kernel
