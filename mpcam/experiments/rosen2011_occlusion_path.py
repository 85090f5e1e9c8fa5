"""Views along a path around a statue, and occlusion at its points by several z-buffers (Rosen et al. 2011, Fig. 3)."""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.graph import GraphCamera
from mpcam.cameras.pinhole import Pinhole
from mpcam.effects.horizon_occlusion import screen_occlusion
from mpcam.effects.traced_occlusion import traced_occlusion
from mpcam.experiments.rosen2011_scenes import statue_camera
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import look_at
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare

RADIUS = 0.8
"""Scene units within which surfaces cover each other: the statue is 2.6 high."""
THICKNESS = 0.15
"""Scene units that a sample reaches back, where it does not reach back without end."""
MIDDLE = np.array((-0.3, 0.0, 0.95))
BEFORE, SHIFT = 1.5, 3.0
"""Of the second graph camera: how far its splitting point lies before the statue's middle, and its centers aside."""
TURN = 60.0
"""Degrees by which the two views from aside are turned around the statue."""
NEAR = 0.99
"""Pixels of less true exposure than this count: elsewhere nothing is to be found out."""
SAME_POINT = 0.04
"""Scene units by which a point may be off what its pixel sees, for it to be seen there."""
EVERY = 7
"""Of the pixels of a stretch's first frame, one in so many is followed."""


class Way(NamedTuple):
    """How occlusion is found. buffers: names of the z-buffers that are walked; thick: whether samples have an end."""

    buffers: tuple[str, ...]
    thick: bool


OUTPUT, GRAPH, SPLIT, SIDES = "output", "graph", "graph, split before", ("left", "right")
WAYS = {
    "output": Way((OUTPUT,), False),
    "graph": Way((GRAPH,), False),
    "output, thickness": Way((OUTPUT,), True),
    "graph, thickness": Way((GRAPH,), True),
    "output + graph, thickness": Way((OUTPUT, SPLIT), True),
    "output + two views, thickness": Way((OUTPUT, *SIDES), True),
}
SETTINGS = {"regular": (6, 6), "fine": (32, 20)}
"""The paper's directions and steps."""


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
        self.prepared: dict[str, Any] = {name: prepare(camera, mesh) for name, camera in self.cameras.items()}

    def aim(self, time: float) -> None:
        self.cameras = cameras(time, self.size)
        for name, camera in self.cameras.items():
            self.prepared[name].aim(camera)

    def hits(self) -> dict[str, Hits]:
        return {name: one.frame() for name, one in self.prepared.items()}


def settings_of(way: Way, hits: dict[str, Hits], setting: str, blur: int) -> dict[str, Any]:
    """What `screen_occlusion` takes beside the output's hits and the radius."""
    directions, steps = SETTINGS[setting]
    given = [hits[name] for name in way.buffers]
    return {
        "directions": directions,
        "steps": steps,
        "blur": blur,
        "zbuffer": None if way.buffers == (OUTPUT,) else given,
        "thickness": THICKNESS if way.thick else None,
    }


def exposures(hits: dict[str, Hits], blur: int, rays: int) -> dict[tuple[str, str], np.ndarray]:
    """(H, W) exposure by setting and way, and the truth as ("", "truth")."""
    seen = hits[OUTPUT]
    found = {
        (setting, label): screen_occlusion(seen, RADIUS, **settings_of(way, hits, setting, blur))
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
        pixel = camera.project(self.points).pixel[..., 0, :]
        place = np.clip(np.floor(pixel).astype(int), 0, (camera.width - 1, camera.height - 1))
        inside = (pixel >= 0).all(-1) & (pixel < (camera.width, camera.height)).all(-1)
        row, column = place[:, 1], place[:, 0]
        seen = hits.points[row, column]
        seen = inside & hits.mask[row, column] & (np.linalg.norm(seen - self.points, axis=-1) < SAME_POINT)
        for key, exposure in found.items():
            values = np.where(seen, exposure[row, column], np.nan)
            if key in self.last:
                self.changes.setdefault(key, []).append(float(np.nanmean(np.abs(values - self.last[key]))))
            self.last[key] = values
