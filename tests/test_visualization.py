"""Camera triangles around a walker: their rays, their layout as a panorama, and Mitsuba with the same rays."""

from typing import Any

import numpy as np
import pytest

import mpcam as mp
from mpcam.effects.visualization import Unrolled, grid_of, moved, surround, unrolled, walker_scene
from mpcam.rendering.shade import shade_device

ANY = (0.07, -0.03, 1.02)  # off the walker's plane of symmetry, where rays would meet edges to the bit


@pytest.fixture(scope="module")
def scene():
    return walker_scene()


def panorama_rays(cams: mp.CameraTriangles):
    v, u = np.indices((cams.height, cams.width)) + 0.5
    ray = cams.ray(np.stack([u, v], axis=-1))
    return unrolled(cams, ray.origin), unrolled(cams, ray.direction), unrolled(cams, ray.valid)


def test_default_has_400_triangles_and_the_scene_as_many_as_the_paper(scene):
    assert surround((0, 0, 1)).count == 400
    assert abs(scene.mesh.triangle_count - 6841) < 0.03 * 6841


@pytest.mark.parametrize("inward", [True, False])
def test_rays_lie_on_the_strip_and_look_the_right_way(inward):
    cams = surround((1, 2, 3), radius=0.8, height=2.0, columns=8, rows=4, inward=inward, start=0.3, resolution=9)
    origin, direction, valid = panorama_rays(cams)
    assert origin.shape == (33, 64, 3) and valid.all()
    place = origin - (1, 2, 3)
    far = np.hypot(place[..., 0], place[..., 1])
    assert far.max() < 0.8 + 1e-12 and far.min() > 0.8 * np.cos(np.pi / 8) - 1e-12
    assert np.allclose(place[:, 0, 2], np.linspace(1, -1, 33))
    assert np.allclose((place * direction).sum(-1), -far if inward else far, atol=1e-12)
    assert np.allclose(direction[..., 2], 0)
    # To the right of the picture as the ray looks: forward x up.
    right = np.cross(direction[:, :-1], (0.0, 0.0, 1.0))
    assert ((np.diff(place, axis=1) * right).sum(-1) > 0).all()
    assert np.allclose(np.arctan2(place[0, 0, 1], place[0, 0, 0]), 0.3)


def test_slant_and_twist_turn_rays_at_the_vertices():
    cams = surround((0, 0, 0), columns=6, rows=2, slant=(0.2, -0.4), twist=0.3, inward=False)
    along = cams.directions.reshape(3, 6, 3)
    assert np.allclose(np.arcsin(along[..., 2]), np.array([-0.4, -0.1, 0.2])[:, None])
    bearing = np.arctan2(along[..., 1], along[..., 0]) - np.arctan2(*cams.vertices.reshape(3, 6, 3).T[1::-1]).T
    assert np.allclose(np.exp(1j * bearing), np.exp(0.3j))


def test_panorama_has_no_seams_and_each_pixel_once():
    cams = surround((0, 0, 0), columns=5, rows=3, angle=2.0, resolution=7)
    panorama = Unrolled(cams)
    assert (panorama.width, panorama.height) == (31, 19)
    origin, direction, _ = panorama_rays(cams)
    steps = np.linalg.norm(np.diff(origin, axis=1), axis=-1)
    assert np.allclose(steps, steps[0, 0])
    assert np.linalg.norm(np.diff(direction, axis=1), axis=-1).max() < 2.0 / 30 * 1.05
    number = np.arange(cams.width * cams.height).reshape(cams.height, cams.width)
    assert len(np.unique(panorama(number))) == 31 * 19


def test_full_turn_closes():
    cams = surround((0, 0, 0), columns=7, rows=2, resolution=5)
    origin, direction, _ = panorama_rays(cams)
    gap = np.linalg.norm(origin[:, 0] - origin[:, -1], axis=-1)
    assert np.allclose(gap, np.linalg.norm(origin[:, 1] - origin[:, 0], axis=-1))
    assert grid_of(cams).wraps


@pytest.mark.parametrize(
    "settings",
    [
        {"radius": 0.9, "height": 2.1, "columns": 10, "rows": 20, "slant": (0.15, -0.15), "start": 0.11},
        {"radius": 0.4, "height": 0.3, "columns": 40, "rows": 5, "inward": False, "slant": (-0.5, 0.5), "twist": 0.1},
    ],
    ids=["inward", "outward"],
)
def test_same_pixels_as_mitsuba_with_the_same_rays(scene, settings):
    cams = surround(ANY, resolution=33, **settings)
    found, truth = mp.rasterize(cams, scene), mp.rasterize(cams, scene, method="raytrace")
    both = found.mask & truth.mask
    assert cams.count == 400 and both.sum() > 50_000
    assert np.array_equal(found.mask, truth.mask)
    near = np.abs(found.depth[both] - truth.depth[both])
    assert (near > 1e-4).sum() == 0
    # Where the ray meets an edge, the two may name either side of it; the point is the same.
    assert (found.triangle != truth.triangle).mean() < 1e-4


def test_walks_with_one_prepared_frame_and_frozen_panorama(scene):
    cams = surround((0, 0, 0), radius=0.4, height=0.3, columns=12, rows=3, inward=False, resolution=17)
    prepared: Any = mp.prepare(cams, scene)
    panorama = Unrolled(cams)
    for step in range(3):
        pose = np.eye(4)
        pose[:2, :2] = [[np.cos(step), -np.sin(step)], [np.sin(step), np.cos(step)]]
        pose[:3, 3] = (0.2 * step + 1.5, 0.11, 1.4)
        here = moved(cams, pose)
        prepared.aim(here)
        hits = prepared.frame()
        fresh = mp.rasterize(here, scene)
        assert np.array_equal(hits.triangle, fresh.triangle)
        color = panorama.on_device(shade_device(hits, scene))
        wanted = panorama(mp.shade(hits, scene))
        assert np.array_equal(np.stack([part.numpy() for part in color], -1).reshape(wanted.shape), wanted)
        assert np.array_equal(panorama.on_device(hits.device_triangle).numpy(), panorama(hits.triangle).ravel())


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"center": (0, 0)}, "center"),
        ({"radius": 0}, "radius"),
        ({"height": np.nan}, "height"),
        ({"columns": 2}, "columns"),
        ({"rows": 1.5}, "rows"),
        ({"slant": 2.0}, "slant"),
        ({"twist": (1, 2, 3)}, "twist"),
        ({"angle": 7}, "angle"),
        ({"start": "left"}, "start"),
        ({"resolution": 1}, "resolution"),
    ],
)
def test_mistakes_are_told(settings, word):
    with pytest.raises(mp.InputError, match=word):
        surround(**{"center": (0, 0, 0), **settings})


def test_other_cameras_and_images_are_refused():
    other = mp.CameraTriangles([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], directions=[(0, 0, 1)] * 3)
    with pytest.raises(mp.InputError, match="surround"):
        unrolled(other, np.zeros((other.height, other.width)))
    cams = surround((0, 0, 0))
    with pytest.raises(mp.InputError, match="shape"):
        unrolled(cams, np.zeros((3, 3)))
    with pytest.raises(mp.InputError, match="walker_scene"):
        walker_scene(10)
