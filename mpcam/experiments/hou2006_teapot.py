"""Stand-in for the scene of Hou et al. 2006, Fig. 7: many objects that move independently around a shiny teapot.

The number of triangles is set by that of the objects, of 20 triangles each; the first is the table, which stands still.
"""

import functools

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.errors import InputError
from mpcam.experiments.hou2006_scenes import AMBIENT, SUN, checker, sky
from mpcam.experiments.hou2006_solids import Solid, ball, prism
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import copies as copied
from mpcam.geometry.shapes import join, lathe, loft, placements, smooth_curve
from mpcam.geometry.teapot import BODY, HANDLE, LID, SPOUT
from mpcam.geometry.textures import painted, textured
from mpcam.math.pose import look_at
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import Scene

EACH = 20
"""Triangles of an object."""
COLOURS = ("#d2452f", "#e3b23c", "#3f9a63", "#2f7fb5", "#7a4fa3", "#e8e2d2")


class TeapotScene:
    """The scene at any time. triangles: a multiple of 20; raises InputError for others.

    scene: a Scene at time 0, whose mirror is the teapot. vertices(time): (V, 3) of its mesh, seconds.
    """

    def __init__(self, triangles: int = 800, width: int = 800, height: int = 600):
        count = triangles // EACH
        if triangles != EACH * count or count < 2:
            raise InputError(f"TeapotScene({triangles}): give a multiple of {EACH} from {2 * EACH} on")
        random = np.random.default_rng(2006)
        kinds = [_closed_prism(), ball(), _double_cone()]
        chosen = [kinds[0], *(kinds[k % 3] for k in range(1, count))]
        starts = np.cumsum([0] + [len(corners) for corners, _ in chosen])
        faces = np.concatenate([f + start for (_, f), start in zip(chosen, starts, strict=False)])
        self._corners = np.concatenate([corners for corners, _ in chosen])
        self._object = np.repeat(np.arange(count), np.diff(starts))
        self._bearing = np.radians(random.uniform(-90, 270, count))
        self._far = random.uniform(1.6, 2.7, count)
        # None of them comes between the eye, towards -y, and the teapot.
        before = np.sin(self._bearing) < -0.5
        self._height = np.where(before, 0.28, random.uniform(0.3, 2.2, count))
        size = random.uniform(0.7, 1.3, (count, 1)) * 0.42 * (40 / max(count, 40)) ** (1 / 3)
        self._size = np.broadcast_to(size, (count, 3)).copy()
        self._axis = random.standard_normal((count, 3))
        self._axis /= np.linalg.norm(self._axis, axis=1, keepdims=True)
        self._pace, self._phase = random.uniform(0.5, 2.0, count), random.uniform(0, 2 * np.pi, count)
        self._size[0] = (5.6, 5.6, 0.1)
        materials = (textured("table", checker("#cdbfa6", "#6d5a4b")), *(painted(code, code) for code in COLOURS))
        numbers = np.concatenate([[0], 1 + np.arange(1, count) % len(COLOURS)])
        places = self.vertices(0.0)
        mesh = Mesh(
            places, faces, uv=places[:, :2], materials=materials, face_material=np.repeat(numbers, EACH), name="teapot"
        )
        eye = look_at((0.0, -4.6, 2.1), (0.0, 0.0, 0.58))
        self.scene = Scene(
            (mesh,),
            Pinhole.from_fov(width, height, np.radians(36.0), camera_from_world=eye),
            (SUN,),
            ambient=AMBIENT,
            name=f"teapot, {triangles:,} triangles",
            mirror=Mirror(teapot(), color=(0.93, 0.93, 0.95)),
            environment=sky(),
        )

    def vertices(self, time: float) -> np.ndarray:
        """Positions (V, 3) at a time in seconds: each object swings on its way, turns and bobs at its own pace."""
        swing = self._pace * time + self._phase
        bearing = self._bearing + np.radians(12) * np.sin(swing)
        height = self._height + 0.08 * np.sin(1.7 * swing)
        place = np.stack([self._far * np.cos(bearing), self._far * np.sin(bearing), height], axis=1)
        angle = swing.copy()
        place[0], angle[0] = (0.0, 0.0, -0.05), 0.0
        own = self._corners * self._size[self._object]
        axis, c, s = self._axis[self._object], np.cos(angle)[self._object, None], np.sin(angle)[self._object, None]
        turned = c * own + s * np.cross(axis, own) + (1 - c) * (axis * own).sum(axis=1, keepdims=True) * axis
        return turned + place[self._object]


@functools.cache
def teapot(level: int = 96) -> Mesh:
    """A teapot about 1.1 high: body with lid and knob, spout towards +x and handle. level: segments around the body."""
    body, lid = smooth_curve(BODY, level // 2), smooth_curve(LID, level // 2)
    spout, handle = smooth_curve(SPOUT, level // 3), smooth_curve(HANDLE, level // 2)
    thick = np.interp(np.linspace(0, 1, len(spout)), [0, 0.5, 1], [0.2, 0.12, 0.075])
    parts = [
        lathe(body, level),
        lathe(lid, level),
        loft(spout, thick, level // 3, across=(0.0, 1.0, 0.0)),
        loft(handle, np.full(len(handle), 0.065), level // 4, across=(0.0, 1.0, 0.0)),
    ]
    whole = copied(join(parts), placements([(0.0, 0.0, 0.0)], -0.25))
    return Mesh(whole.vertices, whole.faces, normals=whole.normals, name="teapot")


def _closed_prism() -> Solid:
    """A prism of six sides with both ends."""
    corners, faces = prism(6)
    return corners, np.concatenate([faces, [(0, k + 1, k) for k in range(1, 5)]])


def _double_cone() -> Solid:
    """Two pyramids of ten sides, base to base."""
    around = 2 * np.pi * np.arange(10) / 10
    ring = 0.5 * np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    i = np.arange(10)
    j = (i + 1) % 10
    faces = np.concatenate([np.c_[i, j, np.full(10, 10)], np.c_[j, i, np.full(10, 11)]])
    return np.concatenate([ring, [(0, 0, 0.6), (0, 0, -0.6)]]), faces
