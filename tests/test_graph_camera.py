"""Graph cameras: their definition, exactly; rays and images inverse; merges; hits."""

import fractions
from typing import Any

import drjit.llvm as device
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalog import POSE
from graph_cameras import clipped_image, on_pieces, random_graph

import mpcam as mp
from mpcam.backend import aligned
from mpcam.cameras.graph_images import ROWS

CAMERAS: dict[str, Any] = mp.GraphCamera.examples(64, 48, POSE)  # pyright: ignore[reportAssignmentType]
ROOT = mp.Pinhole(64, 48)


@pytest.fixture(params=CAMERAS)
def camera(request):
    return CAMERAS[request.param]


# The definition


def test_the_unbending_map_is_the_shear_of_the_definition():
    """Exactly, in fractions: H = 1 + (P - C) pi / (pi . C) leaves the face as it is, takes C to P, and det H > 0."""
    exact = fractions.Fraction
    face, center, before = (
        [exact(3, 5), exact(0), exact(4, 5), exact(-2)],
        [exact(-1), exact(1, 4), exact(1)],
        [0, 0, 0],
    )

    def value(point):
        return sum(n * x for n, x in zip(face, point, strict=False)) + face[3]

    matrix = [
        [exact(int(i == j)) + (before[i] - center[i] if i < 3 else 0) * face[j] / value(center) for j in range(4)]
        for i in range(4)
    ]

    def moved(point):
        return [sum(m * x for m, x in zip(row, [*point, 1], strict=True)) for row in matrix]

    assert moved(center) == [*before, 1]
    along = [exact(4, 5), exact(0), exact(-3, 5)]
    for s, t in ((0, 0), (1, 2), (-3, 5)):
        point = [2 * face[i] + s * along[i] + t * int(i == 1) for i in range(3)]
        assert value(point) == 0 and moved(point) == [*point, 1]
    # The camera's own table, of a face in that plane.
    corners = [[float(2 * face[i] + s * along[i] + t * int(i == 1)) for i in range(3)] for s, t in _SQUARE]
    made = mp.GraphCamera(ROOT, [mp.Portal(corners, [float(x) for x in center])])
    assert np.abs(made.frusta.nodes[ROWS + 2 : ROWS + 5] - np.array(matrix[:3], float)).max() < 1e-15
    assert np.linalg.det(np.array(matrix, float)) > 0


_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def test_rays_and_images_are_inverse(camera):
    for pixel, points, depth, _ in on_pieces(camera, 600):
        image = camera.project(points)
        assert len(points) < 20 or image.valid.all()
        condition = _magnification(camera, points)
        assert (np.abs(image.pixel[:, 0] - pixel).max(-1) <= 1e-12 * np.maximum(1.0, condition)).all()
        assert np.abs(image.depth[:, 0] - depth).max(initial=0.0) < 1e-12


def _magnification(camera, points):
    """How much rounding of a point moves its pixel: pixels for its own size, through the frustum's matrix."""
    matrix = camera.frustum_matrices[camera.location(points)] if len(points) else np.zeros((0, 4, 4))
    size = np.concatenate([np.abs(points), np.ones((len(points), 1))], 1)[:, :, None]
    rows = (np.abs(matrix) @ size)[..., 0]
    w = (matrix @ np.concatenate([points, np.ones((len(points), 1))], 1)[:, :, None])[:, 3, 0]
    return (rows[:, :2].max(-1, initial=0.0) + 64 * rows[:, 3]) / np.abs(w)


def test_pieces_join_and_lengths_add_up(camera):
    pixel = np.random.default_rng(3).uniform(0, 1, (500, 2)) * [64, 48]
    pieces = camera.ray_pieces(pixel)
    assert camera.pieces_per_ray == pieces.valid.shape[1] and pieces.valid[:, 0].all()
    assert np.abs(np.linalg.norm(pieces.direction[pieces.valid], axis=-1) - 1).max() < 1e-14
    assert np.abs(pieces.origin[:, 0] - camera.eye).max() < 1e-14
    first = camera.ray(pixel)
    assert np.array_equal(first.direction, pieces.direction[:, 0])
    for level in range(1, camera.pieces_per_ray):
        there = pieces.valid[:, level]
        assert (pieces.valid[there, level - 1]).all()
        assert np.array_equal(pieces.start[there, level], pieces.end[there, level - 1])
        length = (pieces.end - pieces.start)[there, level - 1, None]
        end = pieces.origin[there, level - 1] + length * pieces.direction[there, level - 1]
        assert np.abs(end - pieces.origin[there, level]).max(initial=0.0) < 1e-13
    assert (pieces.end >= pieces.start)[pieces.valid].all()
    assert all(np.isfinite(part).all() for part in (pieces.origin, pieces.direction, pieces.start))


def test_depth_grows_and_the_measure_falls_along_every_ray(camera):
    pixel = np.random.default_rng(4).uniform(0, 1, (200, 2)) * [64, 48]
    pieces = camera.ray_pieces(pixel)
    last = np.full(200, -1.0), np.full(200, np.inf)
    for level in range(camera.pieces_per_ray):
        length = np.minimum(pieces.end - pieces.start, 30.0)[:, level]
        for part in (0.1, 0.5, 0.9):
            points = pieces.origin[:, level] + (part * length)[:, None] * pieces.direction[:, level]
            there = pieces.valid[:, level] & (length > 1e-6)
            depth = camera.project(points).depth[:, 0]
            measure = camera.local_measure(camera.local(points.T)).depth
            assert (depth > last[0])[there].all() and (measure < last[1])[there].all()
            last = np.where(there, depth, last[0]), np.where(there, measure, last[1])


def test_image_and_depth_are_continuous_across_faces(camera):
    """Both sides of every face see the same pixel, depth and measure there."""
    rng, steps = np.random.default_rng(5), (-1e-11, 1e-11)
    for corners, center in zip(camera.numbers.corners[1:], camera.numbers.centers[1:], strict=True):
        places = rng.dirichlet(np.ones(len(corners)), 50) @ corners
        away = places - center
        found = [camera.frusta.local_project((places + step * away).T)[0] for step in steps]
        seen = found[0].valid & found[1].valid
        assert seen.all() or camera is CAMERAS["merge"]  # parts of whose last face no ray reaches
        scale = np.abs(camera.frustum_matrices).max()
        assert np.abs(found[0].pixel - found[1].pixel)[:, seen].max(initial=0.0) < 1e-9 * max(1.0, scale / 1e3)
        assert np.abs(found[0].depth - found[1].depth)[seen].max(initial=0.0) < 1e-9
        there = [camera.frusta.local_frustum((places + step * away).T)[seen] for step in steps]
        assert (camera.frustum_parents[there[1]] == there[0]).all()


def test_matrices_and_planes_are_those_of_the_frusta(camera):
    """Public arrays alone: every point on a ray lies within the planes of one frustum, whose matrix gives its image."""
    planes, matrices = camera.frustum_planes, camera.frustum_matrices
    assert planes.shape[0] == matrices.shape[0] == len(camera.frustum_centers) == len(camera.frustum_parents)
    for pixel, points, _, level in on_pieces(camera, 300):
        given = np.concatenate([points, np.ones((len(points), 1))], 1)
        inside = (given @ planes.transpose(0, 2, 1) < 1e-12).all(-1).T
        if level == 0:
            pixel, given, inside, points = (part[:200] for part in (pixel, given, inside, points))
        assert (inside.sum(1) == 1).all()
        number = inside.argmax(1)
        assert np.array_equal(number, camera.location(points))
        rows = (matrices[number] @ given[:, :, None])[..., 0]
        assert np.abs(rows[:, :2] / rows[:, 3:] - pixel).max(initial=0.0) < 1e-9
        measure = camera.local_measure(camera.local(points.T)).depth
        assert np.allclose(rows[:, 2] / rows[:, 3], measure, rtol=1e-10)
    assert (camera.location(camera.eye - 5.0 * np.asarray(camera.camera_from_world)[2, :3]) == -1).all()


def test_planes_and_lines_of_a_frustum_stay_straight():
    """The measure is linear in the image over a plane within a frustum, and edges are straight."""
    camera = CAMERAS["bend"]
    ends = camera.ray_pieces([[10.0, 10.0], [50.0, 12.0], [30.0, 40.0]])
    corners = ends.origin[:, 2] + np.array([[0.3], [2.0], [1.0]]) * ends.direction[:, 2]
    weights = np.random.default_rng(6).dirichlet(np.ones(3), 100)
    points = weights @ corners
    assert (camera.location(points) == 2).all()
    image = camera.local_measure(camera.local(points.T))
    rows = np.stack([*image.pixel, np.ones(100)], 1)
    linear, *_ = np.linalg.lstsq(rows, image.depth, rcond=None)
    assert np.abs(rows @ linear - image.depth).max() < 1e-14


def test_a_portal_that_does_not_bend_is_a_pinhole():
    root = mp.Pinhole(64, 48, 40.0, camera_from_world=POSE)
    wide = (
        np.array([(-5.0, -5.0, 2.0), (5.0, -5.0, 2.0), (5.0, 5.0, 2.0), (-5.0, 5.0, 2.0)])
        - root.camera_from_world[:3, 3]
    )
    graph = mp.GraphCamera(root, [mp.Portal(wide @ root.camera_from_world[:3, :3], root.eye)])
    ray = root.ray(np.random.default_rng(1).uniform(0, 1, (300, 2)) * [64, 48])
    points = ray.origin + np.random.default_rng(2).uniform(0.1, 9, (300, 1)) * ray.direction
    ours, theirs = graph.project(points), root.project(points)
    assert ours.valid.all() and set(graph.location(points)) == {0, 1}
    assert np.abs(ours.pixel - theirs.pixel).max() < 1e-12
    assert np.abs(ours.depth - theirs.depth).max() < 1e-13
    none = mp.GraphCamera(root)
    assert none.pieces_per_ray == 1 and np.array_equal(none.project(points).pixel, theirs.pixel)


@pytest.mark.parametrize("seed", range(12))
def test_random_graphs(seed):
    camera = random_graph(seed)
    assert camera.pieces_per_ray > 1
    seen = 0
    for pixel, points, depth, level in on_pieces(camera, 300):
        image = camera.project(points)
        assert image.valid.all()
        condition = _magnification(camera, points)
        assert (np.abs(image.pixel[:, 0] - pixel).max(-1) <= 1e-12 * np.maximum(1.0, condition)).all()
        assert np.abs(image.depth[:, 0] - depth).max(initial=0.0) < 1e-11
        seen += len(points) if level else 0
    assert seen > 100


def test_merged_frusta_are_seen_by_the_face_that_is_crossed():
    camera: Any = mp.GraphCamera.examples(64, 48)["merge"]
    assert camera.frustum_portals.tolist() == [-1, 0, 1, 2, 2]
    assert camera.frustum_parents.tolist() == [-1, 0, 0, 1, 2]
    points = np.array([[-0.9, 0, 2.5], [0.9, 0, 2.5], [-1.6, 0.1, 5.5], [1.7, 0.1, 5.5]])
    assert camera.location(points).tolist() == [1, 2, 3, 4]
    image = camera.project(points)
    assert image.valid.all() and (image.pixel[:, 0, 0] < 32).tolist() == [True, False, True, False]
    assert camera.location([0.0, 0.0, 2.5]) == -1  # behind the block between the two faces
    # Both ways into the frustum have one center, and each its own matrix.
    centers = camera.frustum_centers
    assert np.array_equal(centers[1], centers[2]) and np.array_equal(centers[3], centers[4])


def test_faces_of_one_frustum_leave_no_gap():
    """Rays exactly along the edge that two faces have in common, in both precisions."""
    camera = mp.GraphCamera.around((0.0, 0.0, 2.0), mp.Pinhole(65, 49), 0.7)
    pixel = np.stack([np.full(49, 32.5), np.arange(49) + 0.5], 1)
    for rays in (camera.ray_pieces(pixel), camera.ray_pieces(device.Array2f(*map(aligned, pixel.T)))):
        valid = rays.valid[1].numpy() if isinstance(rays.valid, tuple) else rays.valid[:, 1]
        assert valid.all()


# Arrays of other libraries


def test_kernels_and_jax_agree(camera):
    parts = [part for part in on_pieces(camera, 200, margin=0.05) if len(part[0])]
    pixel, points, depth = (np.concatenate([part[k] for part in parts]) for k in range(3))
    magnified = np.maximum(64.0, _magnification(camera, points))
    found = []
    if camera in (CAMERAS["merge"], CAMERAS["maze"]):  # seconds each, to compile
        with jax.enable_x64(True):
            traced = jax.jit(lambda camera, points: camera.project(points))(camera, jnp.asarray(points))
            found = [(*(np.asarray(part)[:, 0] for part in traced), np.float64)]
    for kind, precision in ((device.Array3f, np.float32), (device.Array3f64, np.float64)):
        image = camera.project(kind(*points.T.astype(precision)))
        found.append((image.pixel[0].numpy().T, image.depth[0].numpy(), image.valid[0].numpy(), precision))
    for place, length, valid, precision in found:
        eps = np.finfo(precision).eps
        assert valid.all()
        assert (np.abs(place - pixel).max(-1) < 64 * eps * magnified).all()
        assert np.abs(length - depth).max() < 64 * eps * max(1.0, depth.max())
    few = pixel[::7]
    pieces, exact = camera.ray_pieces(device.Array2f(*map(aligned, few.T))), camera.ray_pieces(few)
    for level in range(camera.pieces_per_ray):
        same = pieces.valid[level].numpy() & exact.valid[:, level]
        assert (pieces.valid[level].numpy() == exact.valid[:, level]).mean() > 0.99
        assert np.abs(pieces.start[level].numpy() - exact.start[:, level])[same].max(initial=0.0) < 1e-3


def test_single_points_and_none():
    camera = CAMERAS["maze"]
    image = camera.project(camera.eye + camera.camera_from_world[2, :3])
    assert image.pixel.shape == (1, 2) and image.valid[0]
    assert camera.ray_pieces([32.0, 24.0]).origin.shape == (camera.pieces_per_ray, 3)
    assert camera.ray_pieces(np.zeros((0, 2))).origin.shape == (0, camera.pieces_per_ray, 3)
    assert camera.project(np.zeros((0, 3))).pixel.shape == (0, 1, 2)
    assert camera.project(np.zeros((2, 5, 3))).pixel.shape == (2, 5, 1, 2)
    assert (camera.location([[np.nan, 0, 1], [0, np.inf, 1], [1, 1, -np.inf]]) == -1).all()


# Rasterized


@pytest.mark.parametrize("name", CAMERAS)
def test_hits_are_those_of_clipped_triangles(name):
    """By `invert` and by rays that are traced piece by piece: what half-spaces and matrices alone give."""
    camera: Any = mp.GraphCamera.examples(64, 48)[name]
    pose, rng, size = np.asarray(camera.camera_from_world), np.random.default_rng(3), 3.0 if name == "maze" else 1.0
    center = rng.uniform([-2, -1.5, 0.5], [2, 1.5, 8], (60, 1, 3))
    corners = size * (center + 10 ** rng.uniform(-1, 0.2, (60, 1, 1)) * rng.normal(size=(60, 3, 3)))
    mesh = mp.Mesh(((corners - pose[:3, 3]) @ pose[:3, :3]).reshape(-1, 3), np.arange(180).reshape(-1, 3))
    triangle, measure, margin = clipped_image(camera, mesh)
    sure = margin > 0.02
    assert sure.mean() > 0.95 and len(np.unique(triangle)) > 8
    for method in ("invert", "raytrace"):
        hits = mp.rasterize(camera, mesh, method=method)
        assert np.array_equal(hits.triangle[sure], triangle[sure])
        both = hits.mask & sure
        found = camera.local_measure(camera.local(hits.points[both].T)).depth
        assert np.abs(found / measure[both] - 1).max() < 1e-5
    vertex = mp.rasterize(camera, mesh, method="vertex", level=4)
    assert (vertex.triangle == triangle)[sure].mean() > 0.7
