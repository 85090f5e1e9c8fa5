"""Which depth images stand for a scene where a mirror's rays are asked what they hit (Rosen et al. 2011, section 6.1).

One for each mesh, the simplest that holds what the mirror shows of it: parallel rays onto what is flat, as onto a
billboard; for a single thing a single-pole occlusion camera, aimed at it from the mirror; for what surrounds the mirror
two views back to back from its middle.
"""

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Images, Projects
from mpcam.cameras.orthographic import Orthographic
from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.single_pole import SinglePoleOcclusion
from mpcam.effects.lookup import back_to_back
from mpcam.geometry.mesh import Mesh
from mpcam.scene.scene import Scene

MARGIN = 1.02
"""A view has room for so many times the extent of its mesh: small motions need no other camera."""
APART, WITHIN = 1.25, 0.7
"""A thing is looked at from so many of its radii at least; what is nearer to the mirror than so many is around it."""
FLAT, STILL_FLAT = 1e-4, 0.02
"""Thickness, as a share of the extent, up to which a mesh is flat, and up to which it may bend and keep its view."""
MOST_THINGS = 6
"""Single things that get a view of their own: those that are largest as the mirror sees them. Others share one."""
EDGE_ERROR, WORST_EDGE = 0.25, 2.0
"""Pixels that straight edges between projected corners shall be off at most; with more than the second, where splitting
them further would make too many, pixels' rays are inverted exactly."""
MOST_SPLIT = 400_000
"""Triangles that edges are split into at most."""


class View(NamedTuple):
    """cameras: of the depth images. meshes: which of the scene they show, by number. kind: "thing", "flat", "around" or
    "given". center, radius: of the ball around a thing."""

    cameras: tuple[Camera, ...]
    meshes: tuple[int, ...]
    kind: str
    center: np.ndarray | None = None
    radius: float = 0.0


def views_of(
    scene: Scene, origins: np.ndarray, directions: np.ndarray, size: int, aside: float, left_out: Collection[int] = ()
) -> list[View]:
    """The views of a scene for rays (N, 3) that a mirror sends on. size: pixels along a side. aside: see `thing_view`.
    left_out: numbers of meshes that need none."""
    eye = origins.mean(axis=0)
    views, things, around = [], [], []
    for number, mesh in enumerate(scene.meshes):
        points = used_vertices(mesh)
        if len(points) == 0 or number in left_out:
            continue
        frame = plane_of(points)
        if frame is not None:
            views.append(View((_billboard(points, frame, eye, size),), (number,), "flat"))
            continue
        center, radius = ball_of(points)
        place = aimed_from(origins, directions, center, radius, eye)
        if place is None:
            around.append(number)
        else:
            things.append((radius / float(np.linalg.norm(center - place)), number, center, radius, place))
    things.sort(key=lambda one: -one[0])
    around += [number for _, number, *_ in things[MOST_THINGS:]]
    for _, number, center, radius, place in things[:MOST_THINGS]:
        views.append(thing_view(number, center, radius, place, size, aside))
    if around:
        views.append(View(back_to_back(eye, size), tuple(sorted(around)), "around"))
    return views


def thing_view(number: int, center: np.ndarray, radius: float, eye: np.ndarray, size: int, aside: float) -> View:
    """A single thing from a place; aside: how far around it the rays reach, see `SinglePoleOcclusion.around`; 0: a
    pinhole."""
    up = np.eye(3)[2 if abs((center - eye)[2]) < 0.95 * np.linalg.norm(center - eye) else 0]
    camera: Camera = SinglePoleOcclusion.around(size, size, center, radius, eye, aside, up=up)
    if aside == 0:
        numbers = (camera.fx, camera.fy, camera.cx, camera.cy)
        camera = Pinhole(size, size, *numbers, camera_from_world=camera.camera_from_world)
    return View((camera,), (number,), "thing", center, radius)


def used_vertices(mesh: Mesh) -> np.ndarray:
    """(N, 3) finite vertices that faces use."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces.ravel()] = True
    points = mesh.vertices[used]
    return points[np.isfinite(points).all(axis=1)]


def ball_of(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Center and radius of a ball around points (N, 3), with its margin."""
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return center, MARGIN * float(np.linalg.norm(points - center, axis=1).max())


def aimed_from(
    origins: np.ndarray, directions: np.ndarray, center: np.ndarray, radius: float, eye: np.ndarray
) -> np.ndarray | None:
    """From where on the mirror a thing is best looked at: the middle of what sends rays to it; None from within."""
    toward = center - origins
    along = (toward * directions).sum(axis=1)
    near = (toward * toward).sum(axis=1) - np.where(along > 0, along, 0.0) ** 2 < radius * radius
    place = origins[near].mean(axis=0) if near.any() else eye
    distance = float(np.linalg.norm(center - place))
    if distance < WITHIN * radius:
        return None
    return center + (place - center) * (max(distance, APART * radius) / distance)


def plane_of(points: np.ndarray) -> np.ndarray | None:
    """Rows: two directions in the plane of points (N, 3) and its normal; None for points that are not in one plane."""
    middle = points - points.mean(axis=0)
    _, extent, rows = np.linalg.svd(
        middle if len(middle) <= 4096 else middle[:: len(middle) // 2048], full_matrices=True
    )
    extent = np.append(extent, [0.0] * (3 - len(extent)))
    if extent[1] <= 1e-9 * extent[0] or np.ptp(middle @ rows[2]) > FLAT * np.ptp(middle @ rows[0]):
        return None
    return rows


def _billboard(points: np.ndarray, frame: np.ndarray, eye: np.ndarray, size: int) -> Orthographic:
    """Parallel rays onto a plane, from the eye's side, in the smallest rectangle around the points."""
    from scipy.spatial import ConvexHull

    flat = points @ frame[:2].T
    hull = flat[ConvexHull(flat).vertices]
    edges = np.roll(hull, -1, axis=0) - hull
    angles = np.arctan2(edges[:, 1], edges[:, 0])
    turned = [np.ptp(hull @ np.array([(np.cos(a), -np.sin(a)), (np.sin(a), np.cos(a))]), axis=0) for a in angles]
    a = angles[int(np.argmin([wide * high for wide, high in turned]))]
    right = np.cos(a) * frame[0] + np.sin(a) * frame[1]
    down = np.cos(a) * frame[1] - np.sin(a) * frame[0]
    toward = np.cross(right, down)
    middle = np.array([0.5 * (float((points @ axis).min()) + float((points @ axis).max())) for axis in (right, down)])
    offset = float((points @ toward).mean())
    if eye @ toward > offset:
        down, toward, middle[1], offset = -down, -toward, -middle[1], -offset
    wide, high = (MARGIN * float(np.ptp(points @ axis)) for axis in (right, down))
    scale = size / max(wide, high)
    width, height = (max(round(scale * side), 1) for side in (wide, high))
    pose = np.eye(4)
    pose[:3, :3] = right, down, toward
    pose[:3, 3] = -middle[0], -middle[1], max(wide, high) - offset
    return Orthographic(width, height, scale, camera_from_world=pose)


def still_holds(view: View, points: np.ndarray) -> bool:
    """Whether a view has room for its mesh with its vertices (N, 3) elsewhere."""
    if view.kind == "thing":
        return bool((np.linalg.norm(points - view.center, axis=1) <= view.radius).all())
    if view.kind != "flat":
        return True
    camera: Any = view.cameras[0]
    x, y, z = camera.camera_from_world[:3, :3] @ points.T + camera.camera_from_world[:3, 3:]
    wide, high = camera.width / camera.scale, camera.height / camera.scale
    inside = (np.abs(x) <= 0.5 * wide).all() and (np.abs(y) <= 0.5 * high).all()
    return bool(inside and (np.abs(z - max(wide, high)) <= STILL_FLAT * max(wide, high)).all())


def how_to_render(camera: Camera, mesh: Mesh) -> tuple[str, dict[str, Any]]:
    """Method and settings for a depth image: exact where a camera draws triangles fast; elsewhere projected corners,
    with edges split until straight ones are right to EDGE_ERROR, or there would be too many."""
    if camera.ray_geometry != "general" or not isinstance(camera, (Images, Projects)):
        return "invert", {}
    off, level = _edge_error(camera, mesh), 0
    while off > EDGE_ERROR and level < 7 and mesh.triangle_count * 4 ** (level + 1) <= MOST_SPLIT:
        off, level = off / 4, level + 1
    return ("invert", {}) if off > WORST_EDGE else ("vertex", {"level": level})


def _edge_error(camera: Camera, mesh: Mesh) -> float:
    """Pixels that straight edges are off, beside the images of edges' middles or a quarter of that along them: all but
    the hundredth part of a sample, since a pole tears some edges."""
    faces = mesh.faces[:: max(len(mesh.faces) // 5000, 1)]
    ends: Sequence[np.ndarray] = [mesh.vertices[faces[:, i]] for i in (0, 1, 2)]
    errors = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        images = [camera.project(x) for x in (ends[a], ends[b], 0.5 * (ends[a] + ends[b]))]
        seen = np.logical_and.reduce([np.asarray(one.valid)[..., 0] for one in images])
        p, q, middle = (np.asarray(one.pixel)[..., 0, :] for one in images)
        way, off = q - p, middle - 0.5 * (p + q)
        length = np.maximum(np.linalg.norm(way, axis=-1), 1e-9)
        beside, along = np.abs(way[:, 0] * off[:, 1] - way[:, 1] * off[:, 0]), np.abs((way * off).sum(axis=-1))
        errors.append(np.where(seen, np.maximum(beside, 0.25 * along) / length, 0.0))
    return float(np.quantile(np.concatenate(errors), 0.99)) if len(faces) else 0.0
