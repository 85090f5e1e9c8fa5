"""Graph cameras for tests, points on their rays, and their images by clipping and one matrix for each frustum."""

from collections.abc import Iterator
from typing import Any

import numpy as np

import mpcam as mp

MAZE = """
###########
#a        #
##### ### #
#c  # #   #
### # # ###
#   # #  d#
# ### #####
#        e#
##### #####
"""


def on_pieces(camera: mp.Camera, count: int, seed: int = 0, margin: float = 0.01) -> Iterator[tuple[Any, ...]]:
    """For each level random pixels, points on that piece of their rays, lengths up to there, and the level."""
    rng = np.random.default_rng(seed)
    pixel = rng.uniform(0, 1, (count, 2)) * [camera.width, camera.height]
    pieces = camera.ray_pieces(pixel)
    for level in range(pieces.start.shape[1]):
        start, end = pieces.start[:, level], np.minimum(pieces.end[:, level], pieces.start[:, level] + 20)
        there = pieces.valid[:, level] & (end - start > 1e-6)
        depth = start + rng.uniform(max(margin, 0.05 if level == 0 else 0.0), 1 - margin, count) * (end - start)
        points = pieces.origin[:, level] + (depth - start)[:, None] * pieces.direction[:, level]
        yield pixel[there], points[there], depth[there], level


def random_graph(seed: int) -> mp.GraphCamera:
    """A few bends after each other, some of which split in two, with centers and turns at random."""
    rng = np.random.default_rng(seed)
    root = mp.Pinhole(80, 60, 60.0, camera_from_world=mp.look_at(rng.normal(size=3), 5 * rng.normal(size=3)))
    portals: list[mp.Portal] = []

    def grow(parent: int, center: np.ndarray, face: np.ndarray, ways: int, ends: list[np.ndarray]) -> None:
        """Portals behind a face (4, 3) whose frustum has this center, as long as there is room; root's frame."""
        if ways == 0:
            return
        far = center + rng.uniform(1.4, 2.0) * (face - center)  # the same shape, farther on
        tilt = 1 + rng.uniform(-0.1, 0.1) * np.array([[-1.0], [1.0], [1.0], [-1.0]])
        far = center + tilt * (far - center)
        far[2] = _in_plane(far[0], far[1], far[3], center, far[2])
        for _ in range(4):  # narrower, where it would reach through a wall
            if all((far @ wall[:3] + wall[3] < 0).all() for wall in ends):
                break
            far = far.mean(0) + 0.6 * (far - far.mean(0))
        else:
            return
        parts = [far]
        if rng.uniform() < 0.5:
            middle = [0.5 * (far[0] + far[1]), 0.5 * (far[3] + far[2])]
            parts = [
                np.array([far[0], middle[0], middle[1], far[3]]),
                np.array([middle[0], far[1], far[2], middle[1]]),
            ]
        for part in parts:
            inner = part.mean(0) + 0.95 * (part - part.mean(0))
            normal = np.cross(inner[1] - inner[0], inner[3] - inner[0])
            normal /= np.linalg.norm(normal)
            before = abs((center - inner[0]) @ normal)
            size = np.linalg.norm(inner[1] - inner[0])
            own = inner.mean(0) - before * rng.uniform(0.6, 1.0) * normal * np.sign((inner[0] - center) @ normal)
            own = own + rng.uniform(-0.4, 0.4) * size * (inner[1] - inner[0]) / np.linalg.norm(inner[1] - inner[0])
            limits = list(ends)
            if len(parts) == 2:  # a plane between the two
                edge = far[0] + far[1] - 2 * center, far[3] + far[2] - 2 * center
                wall = np.cross(*edge)
                wall = wall / np.linalg.norm(wall) * (1 if (inner.mean(0) - center) @ np.cross(*edge) < 0 else -1)
                limits.append(np.append(wall, -wall @ center))
            portals.append(mp.Portal(_world(root, inner), _world(root, own), parent, ends=_planes(root, limits)))
            grow(len(portals) - 1, own, inner, ways - 1, limits)

    corners = np.array([(-1.0, -0.7, 1.5), (1.0, -0.7, 1.5), (1.0, 0.7, 1.5), (-1.0, 0.7, 1.5)]) * 0.6
    grow(-1, np.zeros(3), corners, int(rng.integers(1, 4)), [])
    return mp.GraphCamera(root, portals)


def _in_plane(a: np.ndarray, b: np.ndarray, c: np.ndarray, center: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Where the line from the center through a corner meets the plane of three others."""
    normal = np.cross(b - a, c - a)
    return center + (corner - center) * ((a - center) @ normal) / ((corner - center) @ normal)


def _world(root: mp.Pinhole, points: np.ndarray) -> np.ndarray:
    pose = np.asarray(root.camera_from_world)
    return (points - pose[:3, 3]) @ pose[:3, :3]


def _planes(root: mp.Pinhole, planes: list[np.ndarray]) -> Any:
    return np.array(planes) @ np.asarray(root.camera_from_world) if planes else None


def clipped_image(camera: mp.GraphCamera, mesh: mp.Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangle, measure and margin of every pixel by clipping and matrices: no ray, and no search for a frustum.

    Each triangle is clipped to the half-spaces of each frustum, and what is left is projected by the frustum's matrix:
    straight edges, and a measure that is linear in the image, of which the largest is in front. margin: how far, in
    pixels, the pixel is from all edges that could decide it.
    """
    shape = camera.height, camera.width
    u, v = np.meshgrid(np.arange(shape[1]) + 0.5, np.arange(shape[0]) + 0.5)
    best, found, margin = np.zeros(shape), np.full(shape, -1), np.full(shape, np.inf)
    for planes, matrix in zip(camera.frustum_planes, camera.frustum_matrices, strict=True):
        for number, triangle in enumerate(mesh.corners):
            polygon = np.concatenate([triangle, np.ones((3, 1))], 1)
            for plane in planes:
                polygon = _clip(polygon, plane)
            if len(polygon) < 3:
                continue
            rows = polygon @ matrix.T
            if (rows[:, 3] <= 1e-9).any():
                continue
            image = rows[:, :2] / rows[:, 3:]
            first, second = (image[1:-1] - image[0]).T, (image[2:] - image[0]).T
            area = (first[0] * second[1] - first[1] * second[0]).sum()
            if abs(area) < 1e-12:
                continue
            after = np.roll(image, -1, axis=0)
            edge = (after - image) * np.sign(area)
            length = np.linalg.norm(edge, axis=1)
            keep = length > 1e-12
            inside = np.min(
                [
                    (e[0] * (v - p[1]) - e[1] * (u - p[0])) / long
                    for e, p, long in zip(edge[keep], image[keep], length[keep], strict=True)
                ],
                axis=0,
            )
            linear, *_ = np.linalg.lstsq(
                np.column_stack([image, np.ones(len(image))]), rows[:, 2] / rows[:, 3], rcond=None
            )
            measure = linear[0] * u + linear[1] * v + linear[2]
            near = inside > -0.1
            margin = np.where(near, np.minimum(margin, np.abs(inside)), margin)
            front = (inside >= 0) & (measure > best)
            best, found = np.where(front, measure, best), np.where(front, number, found)
    return found, best, margin


def _clip(polygon: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """The part of a polygon (n, 4) on the inner side of a plane (Sutherland and Hodgman)."""
    kept = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        p, q = a @ plane, b @ plane
        if p <= 0:
            kept.append(a)
        if (p <= 0) != (q <= 0):
            kept.append(a + p / (p - q) * (b - a))
    return np.array(kept).reshape(-1, 4)
