"""Views along a path around a statue, and occlusion at its points by several z-buffers (Rosen et al. 2011, Fig. 3)."""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.graph import GraphCamera
from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.types import Ray
from mpcam.depth_images.depth_image import DepthImage
from mpcam.effects.horizon_occlusion import screen_occlusion
from mpcam.effects.missing_samples import held, on_device
from mpcam.effects.traced_occlusion import traced_occlusion
from mpcam.experiments.rosen2011_scenes import statue_camera
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import look_at
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.raytrace import RayTraced

RADIUS = 0.8
"""Scene units within which surfaces cover each other: the statue is 2.6 high."""
THICKNESS, MOST_BACK = 0.15, 0.4
"""Scene units that a sample reaches back: all alike, or at most, where backs are known."""
MIDDLE = np.array((-0.3, 0.0, 0.95))
BEFORE, SHIFT = 1.5, 3.0
"""Of the second graph camera: how far its splitting point lies before the statue's middle, and its centers aside."""
TURN = 60.0
"""Degrees by which the two views from aside are turned around the statue."""
NEAR = 0.99
"""Pixels of less true exposure than this count: elsewhere nothing is to be found out."""
SAME_POINT = 5.0
"""Widths of a pixel by which a point may be off what the four pixels around it see, for it to be seen there."""
HELD = 0.06
"""Scene units off a z-buffer's depth within which it holds a point: backs of thin limbs count with their fronts."""
EVERY = 7
"""Of the pixels of a stretch's first frame, one in so many is followed."""


class Way(NamedTuple):
    """How occlusion is found. buffers: names of the z-buffers that are walked. thickness: how far samples reach back;
    None: without end. backs: whether the backs of what is seen are rendered too.
    """

    buffers: tuple[str, ...]
    thickness: float | None = None
    backs: bool = False


OUTPUT, GRAPH, SPLIT, SIDES = "output", "graph", "graph, split before", ("left", "right")
WAYS = {
    "output": Way((OUTPUT,)),
    "graph": Way((GRAPH,)),
    "output, thickness": Way((OUTPUT,), THICKNESS),
    "output + graph, thickness": Way((OUTPUT, SPLIT), THICKNESS),
    "output, backs": Way((OUTPUT,), MOST_BACK, True),
    "output + graph, backs": Way((OUTPUT, SPLIT), MOST_BACK, True),
    "output + two views, backs": Way((OUTPUT, *SIDES), MOST_BACK, True),
}
SETTINGS = {"regular": (6, 6, True), "fine": (32, 20, True), "dense": (32, 48, False)}
"""Directions, steps, and whether it is blurred; the first two are the paper's."""


def cameras(time: float, size: int) -> dict[str, Any]:
    """The output's pinhole at a time from 0 to 1 on the path, and the cameras beside it, by name."""
    output = statue_camera(time, size, size)
    pose = np.asarray(output.camera_from_world)
    eye, ahead = np.linalg.inv(pose)[:3, 3], pose[2, :3]
    found: dict[str, Camera] = {
        OUTPUT: output,
        GRAPH: GraphCamera.around(MIDDLE, output, shift=0.5 * SHIFT),
        SPLIT: GraphCamera.around(MIDDLE - BEFORE * ahead, output, shift=SHIFT),
    }
    for name, sign in zip(SIDES, (1.0, -1.0), strict=True):
        c, s = np.cos(np.radians(TURN)), sign * np.sin(np.radians(TURN))
        aside = np.array((c * eye[0] - s * eye[1], s * eye[0] + c * eye[1], eye[2]))
        found[name] = Pinhole.from_fov(size, size, np.radians(42.0), camera_from_world=look_at(aside, MIDDLE))
    return found


class Views:
    """The z-buffers of all cameras, aimed along the path without anything of the scene being made again."""

    def __init__(self, mesh: Mesh, size: int, time: float = 0.0):
        self.size = size
        self.cameras = cameras(time, size)
        self.fronts: dict[str, Any] = {name: prepare(camera, mesh) for name, camera in self.cameras.items()}
        self.backs: dict[str, Any] = {
            name: prepare(camera, mesh, cull="front") for name, camera in self.cameras.items() if name != GRAPH
        }

    def aim(self, time: float) -> None:
        self.cameras = cameras(time, self.size)
        for prepared in (self.fronts, self.backs):
            for name, one in prepared.items():
                one.aim(self.cameras[name])

    def seen(self) -> "Seen":
        return Seen(*({name: one.frame() for name, one in each.items()} for each in (self.fronts, self.backs)))


class Seen(NamedTuple):
    """First hits by camera, and those on what is turned away from it."""

    fronts: dict[str, Hits]
    backs: dict[str, Hits]


def settings_of(way: Way, seen: Seen, setting: str, blur: int) -> dict[str, Any]:
    """What `screen_occlusion` takes beside the output's hits and the radius."""
    directions, steps, blurred = SETTINGS[setting]
    return {
        "directions": directions,
        "steps": steps,
        "blur": blur if blurred else 1,
        "zbuffer": [seen.fronts[name] for name in way.buffers],
        "thickness": way.thickness,
        "backs": [seen.backs[name] for name in way.buffers] if way.backs else None,
    }


def held_shares(seen: Seen, truth: np.ndarray, points: int, rays: int) -> dict[str, float]:
    """Percent of the true occlusion, by weight, whose surface a set of z-buffers holds, by rays from some pixels."""
    hits = seen.fronts[OUTPUT]
    mesh, random = hits.mesh, np.random.default_rng(3)
    pixels = random.permutation(np.flatnonzero((hits.mask & (truth < NEAR)).ravel()))[:points]
    place, normal = hits.points.reshape(-1, 3)[pixels], mesh.face_normals[hits.triangle.ravel()[pixels]]
    eye = np.linalg.inv(np.asarray(hits.camera.camera_from_world))[:3, 3]
    normal = normal * np.where(((eye - place) * normal).sum(1) > 0, 1.0, -1.0)[:, None]
    ways = random.standard_normal((len(pixels), rays, 3))
    ways *= (
        np.where((ways * normal[:, None]).sum(-1) > 0, 1.0, -1.0)[..., None] / np.linalg.norm(ways, axis=-1)[..., None]
    )
    starts = np.broadcast_to((place + 1e-4 * normal)[:, None], ways.shape).reshape(-1, 3)
    ways = ways.reshape(-1, 3)
    found = RayTraced(Pinhole(rays, len(pixels)), mesh, Ray(starts, ways, np.ones(len(ways), bool))).frame()
    far = found.depth.ravel().astype(np.float64)
    near = far < RADIUS
    weight = 1.0 - (far[near] / RADIUS) ** 2
    on, middle = on_device(starts[near] + far[near, None] * ways[near])
    kept = {
        name: np.asarray(held(DepthImage(one.camera, one.depth), on, middle, HELD).numpy())
        for name, one in seen.fronts.items()
    }
    sets = {
        "output": (OUTPUT,),
        "graph": (GRAPH,),
        "output + graph": (OUTPUT, GRAPH),
        "output + graph, split before": (OUTPUT, SPLIT),
        "output + two views": (OUTPUT, *SIDES),
    }
    total = max(float(weight.sum()), 1e-30)
    return {
        label: float(100 * weight[np.logical_or.reduce([kept[name] for name in names])].sum() / total)
        for label, names in sets.items()
    }


def exposures(views: Seen, blur: int, rays: int) -> dict[tuple[str, str], np.ndarray]:
    """(H, W) exposure by setting and way, and the truth as ("", "truth")."""
    seen = views.fronts[OUTPUT]
    found = {
        (setting, label): screen_occlusion(seen, RADIUS, **settings_of(way, views, setting, blur))
        for setting in SETTINGS
        for label, way in WAYS.items()
    }
    return found | {("", "truth"): traced_occlusion(seen, RADIUS, rays=rays)}


class Flicker:
    """Values at fixed points of the surface, frame by frame: those seen first."""

    def __init__(self, hits: Hits, wanted: np.ndarray):
        self.points = hits.points[wanted][::EVERY]
        self.last: dict[tuple[str, str], np.ndarray] = {}
        self.changes: dict[tuple[str, str], list[float]] = {}

    def add(self, hits: Hits, found: dict[tuple[str, str], np.ndarray]) -> None:
        """Another frame; where a point is hidden or out of sight there is no value."""
        camera: Any = hits.camera
        size = np.array((camera.width, camera.height))
        place = camera.project(self.points).pixel[..., 0, :] - 0.5
        seen = (place >= 0).all(-1) & (place < size - 1).all(-1)
        first = np.clip(np.floor(place), 0, size - 2).astype(int)
        part = np.clip(place - first, 0, 1)
        eye = np.linalg.inv(np.asarray(camera.camera_from_world))[:3, 3]
        limit = SAME_POINT / camera.fx * np.linalg.norm(self.points - eye, axis=-1)
        corners = []
        for right, below in ((0, 0), (1, 0), (0, 1), (1, 1)):
            column, row = first[:, 0] + right, first[:, 1] + below
            weight = np.where(right, part[:, 0], 1 - part[:, 0]) * np.where(below, part[:, 1], 1 - part[:, 1])
            near = np.linalg.norm(hits.points[row, column] - self.points, axis=-1) < limit
            seen &= hits.mask[row, column] & near
            corners.append((row, column, weight))
        for key, exposure in found.items():
            mixed = sum(weight * exposure[row, column] for row, column, weight in corners)
            values = np.where(seen, mixed, np.nan)
            if key in self.last:
                self.changes.setdefault(key, []).append(float(np.nanmean(np.abs(values - self.last[key]))))
            self.last[key] = values
