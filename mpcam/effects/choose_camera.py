"""A single-pole occlusion camera that leaves as few of a mirror's rays as possible without their sample, by search.

Rosen et al. (2011, section 6.1) set the pole, the shifts and the place by hand; here they are found for a mirror and an
eye: a few starts, and from the best of them the simplex of Nelder and Mead (1965). The field is what is needed.
"""

import time
from dataclasses import dataclass

import numpy as np

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.cameras.single_pole import SinglePoleOcclusion
from mpcam.checks import is_number, shown, whole_number
from mpcam.depth_images.depth_image import DepthImage
from mpcam.effects.depth_image_views import aimed_from, ball_of, how_to_render, used_vertices
from mpcam.effects.mirror_rays import mirror_rays
from mpcam.effects.missing_samples import held, on_device, true_hits
from mpcam.errors import InputError
from mpcam.math.pose import look_at
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import Scene

SEARCH = 256
"""Pixels along a side of the images that are looked at in the search, or fewer where fewer are asked for."""
POINTS = 40_000
"""True hits that are looked for, at most: evenly out of all."""
TOLERANCE = 0.01
"""Of the radius of the thing: how far an image's depth may be off a true hit that it holds."""
ASIDES = (0.6, 1.0, 1.5, 2.0)
FIRST = np.array([0.15, 0.15, 0.15, 0.2, 0.2, 0.3, 0.1, 0.1])
"""The first simplex: how far each of the numbers that are searched for is changed. See `_Search.camera`."""


@dataclass(frozen=True)
class ChosenCamera:
    """camera: the one found. missing: share of the rays that hit the thing and lack their sample, at the size asked
    for; before: the same for the camera that is chosen without a search. evaluations: depth images that were looked
    at. seconds: that it took.
    """

    camera: SinglePoleOcclusion
    missing: float
    before: float
    evaluations: int
    seconds: float


@exclusive
def choose_occlusion_camera(
    scene: Scene,
    camera: Camera | None = None,
    mirror: Mirror | None = None,
    *,
    mesh: int = 0,
    size: int = 512,
    evaluations: int = 150,
    room: float = 1.08,
) -> ChosenCamera:
    """A SinglePoleOcclusion whose depth image of one of a scene's meshes holds most of what a mirror shows of it.

    camera, mirror: default the scene's. mesh: its number in the scene. size: pixels along a side. evaluations: cameras
    that are tried, 10 to 10000. room: the field is so many times what the rays need, 1 or more; things that move need
    more. The place, the direction, the pole, the shift and the depths between which it grows are searched for. Give it
    to `Reflection` as `images=[(found.camera, mesh)]`. Raises InputError for scenes without a mirror or camera, meshes
    that it does not show, eyes within the mesh, and other values.
    """
    started = time.perf_counter()
    given, found = camera or scene.camera, mirror or scene.mirror
    if found is None or given is None:
        raise InputError(f"scene {scene.name!r} has no {'camera' if found else 'mirror'}: give it one, or pass one")
    mesh = whole_number("mesh", mesh, 0, len(scene.meshes) - 1)
    size = whole_number("size", size, 8, 8192, unit="pixels")
    evaluations = whole_number("evaluations", evaluations, 10, 10_000)
    if not is_number(room) or room < 1:
        raise InputError(f"room={shown(room)}: give a finite number from 1")
    search = _Search(scene, given, found, mesh, min(size, SEARCH), room)
    best = search.run(evaluations)
    final = _Looked(search, size)
    before = final.missing(SinglePoleOcclusion.around(size, size, search.center, search.radius, search.place))
    after = final.missing(search.camera(best, size))
    return ChosenCamera(search.camera(best, size), after, before, search.count, time.perf_counter() - started)


class _Search:
    """One thing, and the true hits on it of a mirror's rays."""

    def __init__(self, scene: Scene, eye: Camera, mirror: Mirror, mesh: int, size: int, room: float):
        self.part = Scene((scene.meshes[mesh],))
        ray = mirror_rays(eye, mirror).ray
        points = true_hits(scene, eye, ray, (mesh,)).points
        if len(points) == 0:
            raise InputError(f"mesh {mesh} is not seen in the mirror: there is nothing to choose a camera for")
        self.points = points[:: max(len(points) // POINTS, 1)]
        self.few = self.points[:: max(len(self.points) // 4000, 1)]
        vertices = used_vertices(scene.meshes[mesh])
        self.center, self.radius = ball_of(vertices)
        self.vertices = vertices[:: max(len(vertices) // 4000, 1)]
        valid = np.asarray(ray.valid)
        origins, ways = np.asarray(ray.origin)[valid], np.asarray(ray.direction)[valid]
        place = aimed_from(origins, ways, self.center, self.radius, origins.mean(axis=0))
        if place is None:
            raise InputError(f"mesh {mesh} is around the mirror: a single-pole camera sees things from outside")
        self.place, self.room, self.count = place, room, 0
        self.looked = _Looked(self, size)

    def run(self, evaluations: int) -> np.ndarray:
        """The best numbers."""
        from scipy.optimize import minimize

        def cost(numbers: np.ndarray) -> float:
            self.count += 1
            try:
                camera = self.camera(numbers, self.looked.size)
            except InputError:
                return 2.0
            return self.looked.missing(camera)

        starts = [np.array([0, 0, 0, 0, 0, np.log(aside), 0, 0.0]) for aside in ASIDES]
        costs = [cost(start) for start in starts]
        start, left = starts[int(np.argmin(costs))], evaluations - len(starts)
        simplex = np.concatenate([start[None], start + np.diag(FIRST)])
        options = {"maxfev": max(left, 1), "initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-5, "adaptive": True}
        found = minimize(cost, start, method="Nelder-Mead", options=options)
        return found.x if found.fun <= min(costs) else start

    def camera(self, numbers: np.ndarray, size: int) -> SinglePoleOcclusion:
        """The camera for eight numbers: the place (to the right, down, and the logarithm of the distance, in distances
        from the thing), the pole (in radii of the thing), the logarithm of `aside`, and the depths between which the
        shift grows (in radii, from those of the thing). Raises InputError for numbers that make none."""
        axis = self.place - self.center
        distance = float(np.linalg.norm(axis))
        up = np.eye(3)[2 if abs(axis[2]) < 0.95 * distance else 0]
        frame = look_at(self.place, self.center, up)[:3, :3]
        right, down, farther, pole_u, pole_v, log_aside, first, last = (float(x) for x in numbers)
        eye = self.center + (axis + distance * (right * frame[0] + down * frame[1])) * np.exp(farther)
        pose = look_at(eye, self.center, up)
        depths = self.vertices @ pose[2, :3] + pose[2, 3]
        near = float(depths.min()) + max(first, 0.0) * self.radius
        far = max(float(depths.max()) + last * self.radius, near * 1.01)
        if not depths.min() > 0.02 * self.radius:
            raise InputError("the thing reaches behind the camera")
        middle = float(np.linalg.norm(eye - self.center))
        focal = 1000.0
        pole = (focal * pole_u * self.radius / middle, focal * pole_v * self.radius / middle)
        shift = focal * np.exp(log_aside) * self.radius * (1 / near - 1 / far)
        wide = SinglePoleOcclusion(
            1, 1, focal, focal, 0.0, 0.0, pole=pole, near=near, far=far, shift_far=shift, camera_from_world=pose
        )
        pixel = np.asarray(wide.project(self.few).pixel)[..., 0, :]
        low, high = pixel.min(axis=0), pixel.max(axis=0)
        scale = size / (self.room * max(float((high - low).max()), 1e-6))
        center = 0.5 * size - scale * 0.5 * (low + high)
        return SinglePoleOcclusion(
            size,
            size,
            scale * focal,
            scale * focal,
            *(float(x) for x in center),
            pole=tuple(float(c + scale * p) for c, p in zip(center, pole, strict=True)),
            near=near,
            far=far,
            shift_far=scale * shift,
            camera_from_world=pose,
        )


class _Looked:
    """A depth image of the thing, which looks from one place after the other."""

    def __init__(self, search: _Search, size: int):
        self.search, self.size = search, size
        self._points, self._middle = on_device(search.points)
        self._image: DepthImage | None = None

    def missing(self, camera: SinglePoleOcclusion) -> float:
        """Share of the true hits that the camera's depth image does not hold."""
        search = self.search
        if self._image is None:
            method, settings = how_to_render(camera, search.part.mesh)
            self._image = DepthImage.render(camera, search.part, method, color=False, **settings)
        else:
            self._image.aim(camera)
        kept = held(self._image, self._points, self._middle, TOLERANCE * search.radius)
        return 1.0 - float(np.asarray(kept.numpy()).mean())
