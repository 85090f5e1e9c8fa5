"""Camera triangles: rays, images, the atlas, and rasterization against brute force, Mitsuba and each bound."""

import dataclasses

import numpy as np
import pytest
from catalog import first_hits, soup
from triangle_cameras import CAMERAS, FACES, QUAD, around, centers, mixed, patch

import mpcam as mp
from mpcam.math.optics import reflect, refract
from mpcam.rendering.general import GeneralRasterizer


def test_every_triangle_has_its_pixels_and_no_two_touch():
    camera = patch(resolution=np.arange(3, 21) * 3)
    ray = camera.ray(centers(camera))
    face, x, y = (values.reshape(camera.height, camera.width) for values in camera.atlas.places)
    sides = np.asarray(camera.resolution)
    assert np.array_equal(np.bincount(face[face >= 0]), sides * (sides + 1) // 2)
    assert np.array_equal(ray.valid, face >= 0)
    for step, axis in ((1, 0), (1, 1)):
        ahead, behind = np.roll(face, -step, axis), face
        both = (ahead >= 0) & (behind >= 0) & (ahead != behind)
        both[-1 if axis == 0 else slice(None), -1 if axis == 1 else slice(None)] = False
        assert not both.any()


def test_corners_of_the_image_are_vertices_and_their_rays():
    camera = CAMERAS["direct"]()
    for corner, place in enumerate(np.eye(3)):
        pixel = np.stack(camera.atlas.pixel(np.arange(2), *place[1:]), -1)
        ray = camera.ray(pixel)
        vertex = np.asarray(FACES)[:, corner]
        assert np.allclose(ray.origin, QUAD[vertex], atol=1e-15)
        directions = camera.directions[vertex]
        assert np.allclose(ray.direction, directions / np.linalg.norm(directions, axis=1, keepdims=True), atol=1e-15)


@pytest.mark.parametrize("name", ["direct", "lengths", "mirror", "lens"])
def test_neighbors_share_the_rays_of_their_edge(name):
    camera = CAMERAS[name]()
    rng = np.random.default_rng(1)
    edges: dict = {}
    for face, corners in enumerate(camera.faces):
        for i, j in ((0, 1), (1, 2), (2, 0)):
            edges.setdefault(tuple(sorted((corners[i], corners[j]))), []).append((face, i, j, corners[i]))
    shared = [pair for pair in edges.values() if len(pair) == 2]
    assert shared
    for (f, i, j, first), (g, k, m, other) in shared:
        t = rng.uniform()
        rays = []
        for face, a, b, share in ((f, i, j, t), (g, k, m, t if other == first else 1 - t)):
            w = np.zeros(3)
            w[a], w[b] = 1 - share, share
            origin, along, _ = camera.ray_at(np.array([face]), w[1:2], w[2:3])
            rays.append((origin, along / np.linalg.norm(along)))
        assert np.allclose(rays[0][0], rays[1][0], atol=1e-14) and np.allclose(rays[0][1], rays[1][1], atol=1e-14)


@pytest.mark.parametrize("name", CAMERAS)
def test_points_on_rays_project_back(name):
    camera = CAMERAS[name]()
    rng = np.random.default_rng(2)
    pixel = rng.uniform(0, 1, (300, 2)) * [camera.width, camera.height]
    ray = camera.ray(pixel)
    distance = rng.uniform(0.1, 4, 300)
    points = ray.origin + distance[:, None] * ray.direction
    found = camera.project(points)
    assert found.pixel.shape == (300, camera.images_per_point, 2)
    face, second, third, _ = camera.atlas.locate(*pixel.T)
    inside = ray.valid & (np.minimum(np.minimum(second, third), 1 - second - third) > 1e-6)
    off = np.where(found.valid, np.abs(found.pixel - pixel[:, None]).max(-1), np.inf)
    best = off.argmin(1)
    assert inside.sum() > (60 if name != "total reflection" else 10)
    # Near folds an image may be off by the root of the rounding.
    lost = inside & ~(off[np.arange(300), best] < 1e-3)
    # Where rays are bent, starts near folds and near the critical angle may be too far off; of direct rays none is
    # lost.
    share = {"direct": 0.0, "reflection": 0.01, "refraction": 0.1}[camera.kind]
    assert lost.sum() <= share * inside.sum()
    inside &= ~lost
    assert np.median(off[np.arange(300), best][inside]) < 1e-11
    assert np.allclose(found.depth[np.arange(300), best][inside], distance[inside], rtol=1e-4)
    assert (best[inside] // camera.images_per_triangle == face[inside]).all()
    # And every image that is claimed is one.
    which, number = np.nonzero(found.valid)
    back = camera.ray(found.pixel[which, number])
    reached = back.origin + found.depth[which, number, None] * back.direction
    assert (np.linalg.norm(reached - points[which], axis=1)[back.valid] < 1e-7).all()


def test_bent_rays_obey_the_laws_of_optics():
    rng = np.random.default_rng(0)
    incident, normal = rng.normal(size=(2, 3, 1000))
    incident, normal = incident / np.linalg.norm(incident, axis=0), normal / np.linalg.norm(normal, axis=0)
    mirrored = reflect(incident, 3.0 * normal) / 9.0
    assert np.allclose((mirrored * normal).sum(0), -(incident * normal).sum(0), atol=1e-15)
    assert np.allclose(np.cross(mirrored.T, normal.T), np.cross(incident.T, normal.T), atol=1e-15)
    for index in (1.5, 1.0, 1 / 1.5):
        through, passes = refract(2.0 * incident, 0.3 * normal, index)
        sine = np.linalg.norm(np.cross(incident.T, normal.T), axis=1)
        assert np.array_equal(passes, sine <= index) or np.abs(sine - index)[passes != (sine <= index)].max() < 1e-12
        out = through[:, passes]
        assert np.allclose(np.linalg.norm(np.cross(out.T, normal.T[passes]), axis=1) * index, sine[passes], atol=1e-14)
        assert ((out * normal[:, passes]).sum(0) * (incident * normal)[:, passes].sum(0) >= 0).all()


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("size", [0.2, 1.5])
def test_hits_are_those_of_brute_force(name, size):
    camera = CAMERAS[name]()
    mesh = around(camera, 90, size)
    hits = mp.rasterize(camera, mesh)
    triangle, depth = first_hits(camera, mesh)
    assert (triangle >= 0).sum() > 20
    same = hits.triangle == triangle
    assert (~same).sum() <= 2
    hit = same & (triangle >= 0)
    # The depth's error grows as rays graze their triangle.
    cosine = np.abs((mesh.face_normals[triangle] * camera.ray(centers(camera)).direction).sum(-1))
    assert (np.abs(hits.depth[hit] - depth[hit]) * cosine[hit]).max() < 2e-6 * np.ptp(mesh.bounds)
    assert np.isinf(hits.depth[same & ~hit]).all()
    # Also with each place and normal of the hit: the barycentric weights name the point on the ray.
    ray = camera.ray(centers(camera))
    reached = ray.origin + np.where(hits.mask, hits.depth, 0)[..., None] * ray.direction
    assert np.median(np.abs(hits.points - reached)[hit]) < 1e-5


@pytest.mark.parametrize("name", ["direct", "mirror", "sizes", "lens", "mixed signs"])
@pytest.mark.parametrize("bound", ["tight", "triangle", "nine_point"])
def test_no_bound_loses_a_pixel(name, bound):
    camera = CAMERAS[name]()
    mesh = around(camera, 120, 0.8, seed=5)
    reference = mp.rasterize(camera, mesh)
    for culling in ((), ("objects",), ("triangles",), ("objects", "triangles")):
        hits = mp.rasterize(camera, mesh, bound=bound, culling=culling)
        assert np.array_equal(hits.triangle, reference.triangle)
        assert np.array_equal(hits.depth, reference.depth)
        assert hits.stats.rendered == reference.stats.rendered <= hits.stats.tests


def test_culling_and_tight_bounds_save_tests():
    camera = patch(4, 48)
    mesh = around(camera, 300, 0.3)
    tests = {
        (bound, culling): mp.rasterize(camera, mesh, bound=bound, culling=culling).stats.tests
        for bound in ("tight", "nine_point")
        for culling in ((), ("objects", "triangles"))
    }
    assert tests["tight", ("objects", "triangles")] <= tests["tight", ()] < tests["nine_point", ()]
    assert tests["nine_point", ("objects", "triangles")] < tests["nine_point", ()]


def test_many_triangles_by_levels_of_clusters():
    camera = patch(2, 40)
    mesh = mp.builtin_mesh("sphere", triangles=20_000).transformed(
        [[1, 0, 0, 0], [0, 1, 0, -3], [0, 0, 1, 0], [0, 0, 0, 1]]
    )
    hits, truth = mp.rasterize(camera, mesh), mp.rasterize(camera, mesh, method="raytrace")
    assert (hits.mask.sum() > 300) and (hits.triangle != truth.triangle).sum() <= 2


def test_chunks_give_the_same_frame(monkeypatch):
    from mpcam.rendering import general
    from mpcam_kernels import block_pipeline, candidates, plane_pipeline

    camera = patch(3, 31)
    mesh = around(camera, 400, 0.7)
    whole = mp.rasterize(camera, mesh)
    general._pipeline.cache_clear()
    for name, value in (("ROOM", 2000), ("SPLIT", 300), ("PIXELS_PER_TRIANGLE", 1 << 20)):
        monkeypatch.setattr(block_pipeline, name, value)
    monkeypatch.setattr(plane_pipeline, "ROOM", 2000)
    for module in (plane_pipeline, candidates):
        monkeypatch.setattr(module, "THREADS", 5000)
    monkeypatch.setattr(candidates, "FEW", 100)
    for bound in ("tight", "nine_point"):
        assert np.array_equal(mp.rasterize(camera, mesh, bound=bound).triangle, whole.triangle)
    general._pipeline.cache_clear()


def test_more_pairs_than_can_be_numbered_are_refused(monkeypatch):
    from mpcam.rendering import general

    camera = patch()
    mesh = around(camera, 150)
    monkeypatch.setattr(general, "MOST_PAIRS", 150)
    mp.prepare(camera, mesh)
    with pytest.raises(mp.InputError, match="keep 'objects'"):
        mp.prepare(camera, mesh, culling=("triangles",))


def test_outputs_agree():
    camera = patch()
    mesh = around(camera, 150)
    hits = mp.rasterize(camera, mesh)
    assert np.array_equal(mp.depth_map(camera, mesh).depth, hits.depth)
    assert np.array_equal(mp.coverage_map(camera, mesh).mask, hits.mask)


def test_moving_scenes_and_eyes_need_no_preparation():
    camera = patch()
    mesh = around(camera, 150)
    prepared = mp.prepare(camera, mesh)
    assert isinstance(prepared, GeneralRasterizer)
    prepared.frame()
    moved = mesh.vertices + [0.3, -0.1, 0.2]
    prepared.update(moved)
    assert np.array_equal(
        prepared.frame().triangle, mp.rasterize(camera, dataclasses.replace(mesh, vertices=moved)).triangle
    )
    other = dataclasses.replace(camera, eye=(1.0, -3.0, 0.0))
    prepared.update(mesh.vertices)
    prepared.aim(other)
    assert np.array_equal(prepared.frame().triangle, mp.rasterize(other, mesh).triangle)


def test_cameras_of_all_sizes_in_one_process():
    mesh = around(patch(), 60)
    for resolution in (8, 64, 20, 90, 8):
        camera = patch(2, resolution)
        triangle, _ = first_hits(camera, mesh)
        assert (mp.rasterize(camera, mesh).triangle != triangle).sum() <= 1


def test_degenerate_meshes():
    camera = patch(2, 16)
    empty = mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert (mp.rasterize(camera, empty).triangle == -1).all()
    mesh = around(camera, 20)
    bad = np.concatenate([mesh.vertices, [[np.nan, 0, 0], [0, np.inf, 0], [1, 1, 1], [1e30, 0, 0]]])
    faces = np.concatenate([mesh.faces, [[60, 1, 2], [61, 4, 5], [62, 62, 62], [0, 0, 1]]])
    for bound in ("tight", "triangle", "nine_point"):
        hits = mp.rasterize(camera, mp.Mesh(bad, faces), bound=bound)
        assert np.array_equal(hits.triangle, mp.rasterize(camera, mesh).triangle)


def test_huge_and_tiny_scenes():
    for scale in (1e-6, 1e6):
        camera = patch(2, 24)
        mesh = around(camera, 80)
        large = dataclasses.replace(camera, vertices=camera.vertices * scale, eye=camera.eye * scale)
        hits = mp.rasterize(large, dataclasses.replace(mesh, vertices=mesh.vertices * scale))
        assert (hits.triangle != mp.rasterize(camera, mesh).triangle).sum() <= 2
        assert np.allclose(hits.depth[hits.mask].min() / scale, mp.rasterize(camera, mesh).depth.min(), rtol=1e-3)


def test_soups_of_all_sizes():
    camera = mixed(7, 32)
    mesh = soup(200, 4)
    triangle, _ = first_hits(camera, mesh)
    assert (mp.rasterize(camera, mesh).triangle != triangle).sum() <= 3


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, "not both or neither"),
        ({"directions": np.ones((4, 3)), "normals": np.ones((4, 3))}, "not both or neither"),
        ({"directions": np.ones((3, 3))}, "one row per vertex"),
        ({"directions": np.zeros((4, 3))}, "zero in row 0"),
        ({"directions": np.full((4, 3), np.nan)}, "NaN"),
        ({"directions": np.ones((4, 2))}, "(V, 3)"),
        ({"directions": np.ones((4, 3)), "eye": (0, 0, 1)}, "go with normals="),
        ({"normals": np.ones((4, 3))}, "needs eye="),
        ({"normals": np.ones((4, 3)), "eye": (0, 0)}, "three finite numbers"),
        ({"normals": np.ones((4, 3)), "eye": (0, 0, 1), "index": -1.0}, "above 0"),
        ({"directions": np.ones((4, 3)), "resolution": 1}, "from 2 to 8192"),
        ({"directions": np.ones((4, 3)), "resolution": [4, 4, 4]}, "or 2 of them"),
        ({"directions": np.ones((4, 3)), "ray_scale": "long"}, "unit, plane, near_far"),
        ({"directions": [[0, 0, 1], [0, 0, -1], [0, 0, 1], [0, 0, 1]], "ray_scale": "plane"}, "one side"),
    ],
)
def test_mistakes_are_told(settings, words):
    with pytest.raises(mp.InputError) as error:
        mp.CameraTriangles(QUAD, FACES, **settings)
    assert words in str(error.value) and "\n" not in str(error.value)


def test_mistakes_in_faces_and_settings():
    for faces in ([[0, 1, 4]], [[0, 1]], [], [[0.5, 1, 2]]):
        with pytest.raises(mp.InputError):
            mp.CameraTriangles(QUAD, faces, directions=np.ones((4, 3)))
    camera = CAMERAS["direct"]()
    mesh = around(camera, 3)
    for settings in ({"bound": "quad"}, {"cull": "left"}, {"culling": "objects"}, {"culling": ("all",)}):
        with pytest.raises(mp.InputError):
            mp.rasterize(camera, mesh, **settings)


@pytest.mark.parametrize("name", ["direct", "mirror", "sizes", "lens"])
def test_images_near_a_pixel_are_those_of_its_triangle(name):
    """The nearest of all images of a point on a pixel's ray is found in the pixel's own triangle."""
    from mpcam.comparison.metrics import projection_distances

    camera = CAMERAS[name]()
    mesh = around(camera, 120, 0.8)
    hits = mp.rasterize(camera, mesh)
    rows, columns = (index[::7] for index in np.nonzero(hits.mask))
    pixels = np.stack([columns + 0.5, rows + 0.5], -1)
    points = hits.points[rows, columns]
    near, every = camera.project_near(points, pixels), camera.project(points)
    away = np.where(near.valid, np.linalg.norm(near.pixel - pixels[:, None], axis=-1), np.inf).min(-1)
    least = np.where(every.valid, np.linalg.norm(every.pixel - pixels[:, None], axis=-1), np.inf).min(-1)
    assert near.pixel.shape[1] == camera.images_per_triangle
    found = np.isfinite(away)
    assert found.mean() > 0.8 and (away[found] < 0.1).all()
    assert np.allclose(away[found], least[found], atol=1e-3)
    ours = projection_distances(camera, mesh, hits)[rows, columns]
    assert np.allclose(ours, np.where(found, away, least), atol=1e-6)
