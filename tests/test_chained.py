"""Rays that bend twice: against closed forms for slabs, two spheres and a ball lens, and paths traced by Mitsuba."""

import numpy as np
import pytest

import mpcam as mp
from mpcam.backend import types
from mpcam.decomposition.chained import Chained
from mpcam.decomposition.chaining import chained
from mpcam.decomposition.decompose import decompose
from mpcam.decomposition.ray_error import bent
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.shooting import Locator, shoot
from mpcam.decomposition.views import seen_samples
from mpcam.geometry.surfaces import Surface

EYE = np.array((0.0, -5.0, 0.5))
MIDDLE = np.array((2.5, -0.6, 0.3))
BALL, OTHER = Surface.sphere(1.0), Surface.sphere(1.0, MIDDLE)
GLASS = 1.5


def pane(z: float, size: float = 4.0) -> mp.Mesh:
    return mp.Mesh([(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)], [(0, 1, 2), (0, 2, 3)])


def through_sphere(origin, way, center, far: bool):
    """Where rays meet a unit sphere, at the nearer or the farther point, and whether they do."""
    half = ((origin - center) * way).sum(axis=1)
    under = half**2 - ((origin - center) ** 2).sum(axis=1) + 1.0
    distance = -half + np.sqrt(np.maximum(under, 0)) * (1 if far else -1)
    return origin + distance[:, None] * way, (under > 0) & (distance > 1e-9)


def true_rays(points, normals, index):
    """The rays after both bends of what the eye sees of the first sphere: from the other one, or out of the glass."""
    way, _ = bent(points - EYE, normals, index)
    center = MIDDLE if index is None else np.zeros(3)
    place, meets = through_sphere(points, way, center, index is not None)
    way, passes = bent(way, place - center, None if index is None else 1 / index)
    return place, way, meets & passes


@pytest.fixture(scope="module")
def spheres():
    cams = decompose(BALL, EYE, 104, resolution=17)
    return cams, chained(cams, OTHER, reflector=BALL)


@pytest.fixture(scope="module")
def lens():
    cams = decompose(BALL, EYE, 104, resolution=17, index=GLASS)
    return cams, chained(cams, BALL, 1 / GLASS, reflector=BALL)


def errors(found: Chained, index=None, samples: int = 8_000):
    """Angles in mrad and distances two radii away, between chained and true rays; true rays that are missing."""
    view = seen_samples(reflector_of(BALL), EYE, samples)
    place, way, there = true_rays(view.points, view.normals, index)
    first = found.first
    at = Locator(first.vertices, first.normals, first.faces).locate(view.points, view.normals)
    number, second, third = found.place(at.face, at.second, at.third)
    both = there & (number >= 0)
    origin, along, _ = (np.asarray(v) for v in found.camera.ray_at(np.maximum(number, 0), second, third))
    along = along / np.linalg.norm(along, axis=0)
    angle = 1e3 * np.linalg.norm(along.T - way, axis=1)
    goal = place + 2 * way
    reach = ((goal - origin.T) * way).sum(axis=1) / (along.T * way).sum(axis=1)
    miss = np.linalg.norm(origin.T + reach[:, None] * along.T - goal, axis=1)
    return angle[both], miss[both], (there & (number < 0)).sum() / there.sum(), ((number >= 0) & ~there).sum()


def test_slab_lets_rays_out_parallel():
    eye = np.array((0.3, 0.2, 3.0))
    found = chained(decompose(pane(0.0, 1.0), eye, 2, index=GLASS), pane(-0.5), 1 / GLASS)
    assert found.hit.all() and np.allclose(found.share, 1)
    before = found.first.ray_at(found.parent, found.corner[:, 0], found.corner[:, 1])[0].T - eye
    after = found.camera.directions[found.camera.faces[:, 0]]
    assert np.abs(after - before / np.linalg.norm(before, axis=1, keepdims=True)).max() < 1e-14
    assert np.allclose(found.camera.vertices[:, 2], -0.5, atol=1e-14)


def test_two_slabs_are_a_chain_of_four():
    eye = np.array((0.1, 0.2, 3.0))
    one = chained(decompose(pane(0.0, 0.5), eye, 2, index=GLASS), pane(-0.5), 1 / GLASS, most=2)
    found = one
    for z, index in ((-1.0, GLASS), (-1.2, 1 / GLASS)):
        found = chained(found.camera, pane(z), index, most=0)
    assert found.hit.all() and np.allclose(found.camera.vertices[:, 2], -1.2)
    after, before = (part.camera.directions[part.camera.faces] for part in (found, one))
    assert np.abs(after - before).max() < 1e-14


@pytest.mark.parametrize("index", [None, GLASS], ids=["spheres", "lens"])
def test_rays_at_vertices_are_true(index, spheres, lens):
    cams, found = spheres if index is None else lens
    weights = np.stack([1 - found.corner.sum(axis=1), *found.corner.T], axis=1)[..., None]
    corners = cams.faces[found.parent]
    shot = shoot(
        reflector_of(BALL), (weights * cams.vertices[corners]).sum(1), (weights * cams.normals[corners]).sum(1)
    )
    place, way, there = true_rays(shot.points, shot.normals, index)
    mine = found.camera.faces[:, 0]
    sure = there & (((shot.points - EYE) * shot.normals).sum(axis=1) < 0)  # not behind the outline
    assert sure.mean() > 0.9
    assert np.abs(found.camera.vertices[mine] - place)[sure].max() < 1e-6
    assert np.abs(found.camera.directions[mine] - way)[sure].max() < 1e-6


def test_lens_is_as_good_as_its_tolerance(lens):
    angle, miss, missing, extra = errors(lens[1], GLASS)
    assert np.median(angle) < 1.0 and np.percentile(angle, 99) < 3.0
    assert np.median(miss) < 2.5e-3
    assert missing < 0.05 and extra < 8


def test_two_spheres(spheres):
    angle, miss, missing, extra = errors(spheres[1])
    assert np.median(angle) < 5 and np.median(miss) < 0.012
    assert missing < 0.12 and extra < 8


def test_smaller_tolerance_and_more_levels_come_nearer(spheres):
    cams, found = spheres
    coarse = chained(cams, OTHER, reflector=BALL, most=2, tolerance=2e-2)
    fine = chained(cams, OTHER, reflector=BALL, most=5, tolerance=1e-3)
    rough, good, best = (errors(one) for one in (coarse, found, fine))
    assert np.median(best[0]) < np.median(good[0]) < np.median(rough[0])
    assert best[2] < good[2] < rough[2]
    assert coarse.camera.count < found.camera.count < fine.camera.count


def test_rays_may_start_on_the_camera_triangles_themselves(spheres):
    cams, found = spheres
    own = chained(cams, OTHER)
    assert np.median(errors(own)[0]) > 2 * np.median(errors(found)[0])


def test_mesh_with_normals_stands_for_the_surface(spheres):
    cams, found = spheres
    mesh = chained(cams, OTHER.mesh(40_000), reflector=BALL)
    assert abs(mesh.camera.count - found.camera.count) < 0.02 * found.camera.count
    assert abs(np.median(errors(mesh)[0]) - np.median(errors(found)[0])) < 0.8


def test_every_place_belongs_to_one_triangle(lens):
    _, found = lens
    random = np.random.default_rng(0)
    face = random.integers(0, found.first.count, 20_000)
    second, third = random.random((2, 20_000))
    over = second + third > 1
    second, third = np.where(over, 1 - second, second), np.where(over, 1 - third, third)
    number, w2, w3 = found.place(face, second, third)
    there = number >= 0
    assert (found.parent[number[there]] == face[there]).all()
    least = np.minimum(np.minimum(w2, w3), 1 - w2 - w3)[there]
    assert least.min() > -1e-9
    back = found.corner[number] + found.scale[number, None] * np.stack([w2, w3], axis=1)
    assert np.allclose(back[there], np.stack([second, third], axis=1)[there])
    assert abs(there.mean() - found.share.mean()) < 0.01
    full = np.isin(face, np.flatnonzero(found.hit))
    assert there[full].all() and found.hit.mean() > 0.5
    for ends in ((0, 0), (1, 0), (0, 1), (0.5, 0.5)):
        assert (found.place(np.flatnonzero(found.hit), *ends)[0] >= 0).all()


def test_images_come_back_into_the_first_layout(lens):
    cams, found = lens
    v, u = np.indices((found.camera.height, found.camera.width)) + 0.5
    ray = found.camera.ray(np.stack([u, v], axis=-1))
    image = found.resampled(ray.origin)
    assert image.shape == (cams.height, cams.width, 3)
    face, column, row = (part.reshape(found.mask.shape)[found.mask] for part in cams.atlas.places)
    number, second, third = found.place(face, column / 16, row / 16)
    exact = np.asarray(found.camera.ray_at(number, second, third)[0]).T
    # Sides of 17 pixels are halved without remainder: each pixel is one of the chained atlas.
    assert np.abs(image[found.mask] - exact).max() < 1e-6
    assert (image[~found.mask] == 0).all()
    device = found.on_device(types().Float(np.ascontiguousarray(ray.origin[..., 0], np.float32).ravel()))
    assert np.allclose(device.numpy().reshape(found.mask.shape), image[..., 0], atol=1e-6)


def test_rasterizes_as_mitsuba_traces(spheres):
    scene = mp.builtin_mesh("quad_room").transformed(np.diag([6.0, 6.0, 6.0, 1.0]))
    camera = spheres[1].camera
    hits, truth = mp.rasterize(camera, scene), mp.rasterize(camera, scene, method="raytrace")
    both = hits.mask & truth.mask
    assert both.sum() > 1000 and (hits.mask == truth.mask).all()
    assert np.abs(hits.depth[both] - truth.depth[both]).max() < 1e-4 * truth.depth[both].max()


def test_what_is_nearer_stays_in_front(spheres):
    cams, found = spheres
    first = np.zeros((cams.height, cams.width, 3))
    second = np.ones((found.camera.height, found.camera.width, 3))
    whole = found.combined(first, second)
    assert np.allclose(whole[found.mask], 1) and (whole[~found.mask] == 0).all()
    between = np.where(found.mask, found.distance, 1.0)
    assert (found.combined(first, second, 0.9 * between) == 0).all()
    assert np.allclose(found.combined(first, second, 1.1 * between), whole)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"cams": BALL}, "CameraTriangles"),
        ({"surface": "ball"}, "reflector"),
        ({"index": -1.0}, "index"),
        ({"least": 3, "most": 2}, "least"),
        ({"most": 8}, "most"),
        ({"tolerance": 0}, "tolerance"),
        ({"surface": Surface.sphere(1.0, (0, -50, 0))}, "none of"),
        ({"cams": "direct", "reflector": BALL}, "normals"),
    ],
)
def test_mistakes_are_told(arguments, word, spheres):
    cams, found = spheres
    given = {"cams": cams, "surface": OTHER, **arguments}
    given["cams"] = found.camera if given["cams"] == "direct" else given["cams"]
    with pytest.raises(mp.InputError, match=word):
        chained(**given)


def test_images_of_another_size_are_refused(spheres):
    with pytest.raises(mp.InputError, match="shape"):
        spheres[1].resampled(np.zeros((3, 3)))
