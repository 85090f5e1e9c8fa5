"""Images of a scene's vertices in a mirror, joined by straight edges: the baseline of `Reflection`."""

import dataclasses

import numpy as np
import pytest
from test_reflection import WAVE, at, different, flat, scene, things

import mpcam as mp
from mpcam.comparison import metrics
from mpcam.effects.mirror_parts import ByVertices
from mpcam.effects.reflection import Reflection
from mpcam.effects.virtual_vertices import _cones, with_directions

BOWL = mp.Surface.paraboloid(1.2, 0.3)


def images(shown: mp.Scene, level: int = 0, **settings) -> tuple[np.ndarray, Reflection]:
    """Pixel and depth (N, 3) of all vertices, a depth of NaN where there is no image; and the picture itself."""
    picture = Reflection(shown, method="vertex", level=level, **settings)
    assert isinstance(picture.part, ByVertices)
    prepared = picture.part.prepared
    return prepared.place(prepared.vertices)[0].numpy().reshape(-1, 4)[:, :3], picture


@pytest.mark.parametrize("surface", [WAVE, BOWL, mp.Surface.sphere(0.7, (0, 0, -0.1))], ids=["mixed", "bowl", "sphere"])
@pytest.mark.parametrize("level", [0, 2])
def test_vertices_appear_where_the_camera_triangles_show_them(surface, level):
    shown = scene(surface, triangles=60)
    found, picture = images(shown, level)
    mesh, points = shown.mesh, shown.mesh.vertices
    if level:  # the same grid by its definition: rows from the first corner to the other two
        grid = np.array([((r - c) / 4, c / 4) for r in range(5) for c in range(r + 1)])
        a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
        points = (a[:, None] + grid[:, :1] * (b - a)[:, None] + grid[:, 1:] * (c - a)[:, None]).reshape(-1, 3)
    cams = with_directions(picture.cams)
    seen = cams.project(points)
    depth = np.where(seen.valid, seen.depth, np.inf)
    nearest = depth.argmin(axis=-1)
    valid = np.isfinite(depth.min(axis=-1))
    pixel = np.take_along_axis(seen.pixel, nearest[:, None, None], axis=1)[:, 0]
    places = shown.camera.project(cams.ray(pixel).origin)
    expected = places.pixel[:, 0]
    valid &= places.valid[:, 0]
    assert 0.05 < valid.mean()
    # A vertex on the edge of the mirror, or of two images as near, may go either way.
    agree = np.isfinite(found[:, 2]) == valid
    assert (~agree).mean() < 0.004
    both = agree & valid
    off = np.abs(found[both, :2] - expected[both]).max(axis=1)
    assert np.quantile(off, 0.99) < 0.01 and (off > 0.1).mean() < 0.005
    assert np.quantile(np.abs(found[both, 2] / depth.min(axis=-1)[both] - 1), 0.99) < 1e-4


def test_a_flat_mirror_keeps_edges_straight():
    shown = scene(flat(12.0), triangles=2)
    exact = mp.render(shown.camera, shown, method="raytrace")
    picture = mp.render(shown.camera, shown, method="vertex", level=0)
    inside = Reflection(shown).mask
    assert different(mp.render(shown.camera, dataclasses.replace(shown, mirror=None)), exact) > 0.03
    assert different(picture, exact) < 0.01 and np.median(np.abs(picture - exact)[inside]) < 1e-3


@pytest.mark.parametrize(
    ("surface", "gain"), [(mp.Surface.paraboloid(1.2, -0.3), 2.0), (WAVE, 1.6)], ids=["convex", "mixed"]
)
def test_finer_edges_come_nearer_to_the_truth(surface, gain):
    shown = scene(surface)
    truth = Reflection(shown, method="raytrace").image()
    errors = [
        metrics.image_rmse(Reflection(shown, method="vertex", triangles=1000, level=level).image(), truth)
        for level in (0, 2, 4)
    ]
    assert errors[2] < errors[1] < errors[0] and errors[2] < errors[0] / gain


def test_many_images_are_one_too_few():
    """In a bowl points have several images, of which vertices keep one; camera triangles show all."""
    shown = scene(BOWL)
    truth = Reflection(shown, method="raytrace").image()
    vertex, ours = (Reflection(shown, **s).image() for s in ({"method": "vertex", "level": 3, "triangles": 416}, {}))
    assert metrics.image_rmse(vertex, truth) > 2 * metrics.image_rmse(ours, truth)


def test_total_reflection_takes_camera_triangles_away():
    cams = mp.decompose(WAVE, (0.2, -3.4, 2.4), 100, index=0.8)
    ways, valid = cams.bend(cams.vertices.T, cams.normals.T)
    assert ways is not None and 0 < valid.sum() < len(valid)
    left = with_directions(cams)
    assert 0 < left.count < cams.count and left.kind == "direct"
    assert left.count == valid[cams.faces].all(axis=1).sum()
    with pytest.raises(mp.InputError, match="reflects all light"):
        with_directions(mp.decompose(flat(), (0.0, -3.4, 0.3), 20, index=0.5))


def test_vertices_without_numbers_leave_holes():
    shown = scene(WAVE)
    picture = Reflection(shown, method="vertex", level=1)
    moved = shown.mesh.vertices.copy()
    moved[: len(things()[0].vertices)] = np.nan
    picture.update(moved)
    rest = dataclasses.replace(shown, meshes=things()[1:])
    assert different(picture.image(), Reflection(rest, method="vertex", level=1).image()) < 0.003


def test_scenes_without_triangles_are_empty():
    empty = dataclasses.replace(scene(WAVE), meshes=(mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)),))
    image = Reflection(empty, method="vertex", level=2).image()
    assert np.allclose(image, empty.background, atol=1e-6)


def test_a_large_scene_is_seen_whole():
    """Clusters of vertices over several levels lose none."""
    ball = at(mp.builtin_mesh("sphere", triangles=20_000), (0.1, 0.2, 0.8), 0.35, (0.3, 0.8, 0.3))
    shown = dataclasses.replace(scene(mp.Surface.paraboloid(1.2, -0.3)), meshes=(ball,))
    truth = Reflection(shown, method="raytrace").image()
    image = Reflection(shown, method="vertex", triangles=1000).image()
    assert different(image, truth) < 0.004


def test_cones_hold_the_rays_at_the_corners_and_little_more():
    """What is too wide costs time and shows in no picture."""
    table = np.random.default_rng(4).normal(size=(6, 3, 50)) * 0.3 + np.array([5, -3, 2.0])[:, None]
    first, second = _cones(table).rows.flat.numpy().reshape(50, 2, 4).transpose(1, 2, 0)
    ways = table[1::2] / np.linalg.norm(table[1::2], axis=1, keepdims=True)
    for corners, middle, within in (
        (table[0::2], first[:3], first[3]),
        (ways, second[:3], second[3]),  # rounded up to 16 bits
    ):
        away = np.linalg.norm(corners - middle, axis=1).max(axis=0)
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max(axis=0)
        assert (away <= within).all() and (within < 0.7 * sides).all()
