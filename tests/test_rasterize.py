"""First hits: against Embree, against brute force in float64, and against what each method promises."""

import gc
import threading
import weakref

import numpy as np
import pytest
from catalog import soup

import mpcam as mp
from mpcam.rendering.registry import METHODS


def assert_agree(hits, truth, mismatch=2e-4, depth=1e-4, common=0.999):
    """The tolerances of the project: hit or no hit, and depth on the common hits."""
    assert (hits.mask != truth.mask).mean() <= mismatch
    both = hits.mask & truth.mask
    if both.any():
        relative = np.abs(hits.depth[both] - truth.depth[both]) / truth.depth[both]
        assert (relative <= depth).mean() >= common


@pytest.fixture(scope="module")
def meshes():
    return {
        "room": mp.builtin_mesh("quad_room"),
        "temple": mp.builtin_mesh("temple"),
        "soup": soup(3000, seed=11),
        "sphere": mp.builtin_mesh("sphere", triangles=20480),
    }


def test_every_pixel_of_a_closed_room_is_hit():
    """Neighboring triangles leave no gap: inside a closed box, nothing is missed."""
    rng = np.random.default_rng(5)
    mesh = mp.builtin_mesh("sphere", triangles=1280)
    for target in rng.normal(size=(6, 3)):
        for camera in (
            mp.Radial.equisolid(256, 256, mp.look_at((0.1, 0.2, -0.3), target), fov=2 * np.pi),
            mp.Pinhole(256, 256, camera_from_world=mp.look_at((0.1, 0.2, -0.3), target)),
        ):
            hits = mp.rasterize(camera, mesh)
            u, v = np.meshgrid(np.arange(256) + 0.5, np.arange(256) + 0.5)
            assert np.array_equal(hits.mask, camera.ray(np.stack([u, v], -1)).valid)


def test_edges_through_pixel_centers_leave_no_gap():
    """Edges and corners exactly on pixel centers, also between meshes that repeat their vertices."""
    k = np.arange(-4, 5) / 8.0
    corners = np.array([[x, y, 1.0] for y in k for x in k])
    number = np.arange(81).reshape(9, 9)
    a, b, c, d = (number[i : 8 + i, j : 8 + j].ravel() for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    camera = mp.Pinhole(64, 64, 64, 64, 32.5, 32.5)
    for mesh in (mp.Mesh(corners, faces), mp.Mesh(corners[faces.ravel()], np.arange(faces.size).reshape(-1, 3))):
        hits = mp.rasterize(camera, mesh)
        assert hits.mask[1:64, 1:64].all()
        assert np.allclose(hits.points[1:64, 1:64, 2], 1)


def test_same_frame_twice_is_the_same_to_the_bit(meshes):
    camera = mp.Radial.paraboloid(256, 256, mp.look_at((0.1, 0, 0.2), (1, 1, 1)))
    frames = [mp.rasterize(camera, meshes["soup"]) for _ in range(3)]
    for other in frames[1:]:
        assert np.array_equal(frames[0].triangle, other.triangle)
        assert np.array_equal(frames[0].depth, other.depth)
        assert np.array_equal(frames[0].barycentric, other.barycentric)


def test_ties_go_to_the_lower_triangle():
    corners = np.array([[-1, -1, 2], [1, -1, 2], [0, 1, 2.0]])
    mesh = mp.Mesh(np.tile(corners, (5, 1)), np.arange(15).reshape(5, 3))
    hits = mp.rasterize(mp.Radial.equidistant(64, 64), mesh)
    assert set(np.unique(hits.triangle)) == {-1, 0}


@pytest.mark.parametrize("scale", [1e-8, 1e-3, 1e5, 1e8])
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_scale_and_distance_from_the_origin_do_not_matter(scale, offset):
    mesh = mp.builtin_mesh("temple")
    shift = np.full(3, offset) * scale
    eye, target = np.array([0.2, -0.1, 1.6]), np.array([1.0, 2.0, 1.9])
    camera = mp.Radial.paraboloid(128, 128, mp.look_at(eye, target))
    far = camera.with_pose(mp.look_at(eye * scale + shift, target * scale + shift))
    moved = mp.Mesh(mesh.vertices * scale + shift, mesh.faces)
    near_hits, far_hits = mp.rasterize(camera, mesh), mp.rasterize(far, moved)
    assert (near_hits.mask != far_hits.mask).mean() <= 2e-4
    both = near_hits.mask & far_hits.mask
    assert (
        np.percentile(np.abs(far_hits.depth[both] / scale - near_hits.depth[both]) / near_hits.depth[both], 99.9) < 1e-3
    )


def test_fields_are_worked_out_only_when_asked_for():
    hits = mp.rasterize(mp.Radial.paraboloid(32, 32), mp.builtin_mesh("sphere"))
    assert "device_weights" not in vars(hits)
    _ = hits.depth
    assert "device_weights" not in vars(hits)
    assert hits.depth.dtype == np.float32
    assert hits.triangle.dtype == np.int32
    assert hits.barycentric.shape == (32, 32, 2)
    assert hits.barycentric.dtype == np.float32


def test_stats_count_tests_and_fragments():
    mesh = mp.builtin_mesh("sphere", triangles=1280)
    hits = mp.rasterize(mp.Radial.paraboloid(256, 256), mesh)
    assert hits.stats.rendered >= hits.mask.sum()
    assert hits.stats.tests >= hits.stats.rendered
    assert 1 <= hits.stats.overdraw < 5
    assert hits.stats.overdraw == hits.stats.tests / hits.stats.rendered


def test_bounds_change_the_work_and_not_the_frame():
    scene = mp.builtin_scene("facade", 200, 200)
    for name in ("paraboloid", "cosine_sphere", "equisolid", "equidistant"):
        camera = mp.Radial(200, 200, name, scene.camera.camera_from_world)
        tight, quad = (mp.rasterize(camera, scene, bound=bound) for bound in ("tight", "quad"))
        assert np.array_equal(tight.triangle, quad.triangle)
        assert np.array_equal(tight.depth, quad.depth)
        assert quad.stats.rendered == tight.stats.rendered
        assert quad.stats.tests > 1.5 * tight.stats.tests
    with pytest.raises(mp.InputError, match="bound='quad' is for radial projections, not for a Pinhole"):
        mp.rasterize(mp.Pinhole(8, 8), scene, bound="quad")


def test_large_and_small_triangles_meet():
    """Triangles that one lane walks, and those that are cut into blocks, in one scene, image not a multiple of 8."""
    mesh = mp.Mesh.concatenate(
        [
            mp.builtin_mesh("quad_room"),
            mp.builtin_mesh("sphere", triangles=20480).transformed(np.diag([0.2, 0.2, 0.2, 1.0])),
        ]
    )
    camera = mp.Radial.equidistant(203, 157, mp.look_at((0.9, 0.1, 0.3), (0, 0, 0)), fov=1.2 * np.pi)
    assert_agree(mp.rasterize(camera, mesh), mp.rasterize(camera, mesh, method="raytrace"))


def test_scenes_beyond_the_pair_budget_are_done_in_chunks(monkeypatch):
    import mpcam_kernels.pipeline as kernels
    from mpcam.rendering import z_buffer

    camera = mp.Radial.paraboloid(136, 136, mp.look_at((0.1, 0, 0.2), (1, 1, 1)))
    mesh = soup(400, seed=14)
    whole = mp.rasterize(camera, mesh)
    z_buffer._pipeline.cache_clear()
    monkeypatch.setattr(kernels, "PAIRS", 700)
    chunked = mp.rasterize(camera, mesh)
    z_buffer._pipeline.cache_clear()
    assert np.array_equal(whole.triangle, chunked.triangle)
    assert np.array_equal(whole.depth, chunked.depth)


def test_moving_scene_equals_a_new_mesh():
    mesh = mp.builtin_mesh("sphere", triangles=1280)
    camera = mp.Radial.equisolid(96, 96, mp.look_at((0, 0, 3), (0, 0, 0)))
    moved = mesh.transformed(np.array([[1, 0, 0, 0.3], [0, 0.5, 0, 0], [0, 0, 1, -0.2], [0, 0, 0, 1.0]]))
    for method in METHODS:
        prepared = mp.prepare(camera, mesh, method)
        before = prepared.frame()
        prepared.update(moved.vertices)
        after = prepared.frame()
        expected = mp.rasterize(camera, moved, method=method)
        assert (after.mask != expected.mask).mean() <= 2e-4, method
        assert not np.array_equal(before.mask, after.mask)


def test_prepared_stages_are_named():
    camera, mesh = mp.Radial.paraboloid(64, 64), mp.builtin_mesh("quad_room")
    stages = {method: set(mp.prepare(camera, mesh, method).stages()) for method in METHODS}
    assert {"vertices", "triangles", "decode"} <= stages["invert"]
    assert stages["raytrace"] == {"build", "trace"}
    assert stages["cubemap"] == {"faces", "resample"}


def test_a_mesh_leaves_the_device_with_its_last_user():
    from mpcam.rendering.device import device_mesh

    mesh = mp.builtin_mesh("cube")
    held = weakref.ref(device_mesh(mesh))
    mp.rasterize(mp.Pinhole(8, 8), mesh)
    del mesh
    gc.collect()
    assert held() is None


@pytest.mark.parametrize("method", METHODS)
def test_nothing_to_see(method):
    """No faces, no faces in view, zero area, NaN, infinity: no hits, no complaint."""
    camera = mp.Radial.paraboloid(24, 24)
    behind = [[-1, -1, -2], [1, -1, -2], [0, 1, -2]]
    line = [[0, 0, 1], [0, 1, 2], [0, 2, 3]]
    bad = [[np.nan, 0, 1], [1, 0, 1], [0, 1, 1]]
    infinite = [[np.inf, 0, 1], [1, 0, 1], [0, 1, 1]]
    for corners in ([], behind, line, bad, infinite, [*behind, *line, *bad, *infinite]):
        mesh = mp.Mesh(np.array(corners).reshape(-1, 3), np.arange(len(corners)).reshape(-1, 3))
        hits = mp.rasterize(camera, mesh, method=method)
        assert not hits.mask.any()
        assert np.isinf(hits.depth).all()
        assert (hits.barycentric == 0).all()
        if method != "cubemap":  # it looks behind itself too
            assert hits.stats.rendered == 0
        assert mp.render(camera, mesh, method=method).shape == (24, 24, 3)


@pytest.mark.parametrize("method", METHODS)
def test_bad_triangles_do_not_hide_good_ones(method):
    good = [[-1, -1, 1], [1, -1, 1], [0, 1, 1]]
    bad = [[np.nan, 0, 0.5], [1, 0, 0.5], [0, 1, 0.5]]
    mesh = mp.Mesh(np.array([*bad, *good]), [[0, 1, 2], [3, 4, 5], [3, 3, 4]])
    hits = mp.rasterize(mp.Radial.paraboloid(24, 24), mesh, method=method)
    assert hits.mask.any()
    assert set(np.unique(hits.triangle)) == {-1, 1}


@pytest.mark.parametrize("method", METHODS)
def test_one_pixel(method):
    mesh = mp.Mesh([[-1, -1, 1], [1, -1, 1], [0, 1, 1]], [[0, 1, 2]])
    hits = mp.rasterize(mp.Radial.equidistant(1, 1), mesh, method=method)
    assert hits.triangle.tolist() == [[0]]
    if method != "vertex":  # its depth is linear in an image of one pixel
        assert abs(hits.depth[0, 0] - 1) < 0.02


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c, m: mp.rasterize(c, m, method="magic"), "allowed are invert, vertex"),
        (lambda c, m: mp.rasterize(c, m, bound="loose"), "allowed are tight, triangle, quad"),
        (lambda c, m: mp.rasterize(c, m, level=2), "no setting 'level': allowed are bound"),
        (lambda c, m: mp.rasterize(c, m, method="raytrace", level=2), "allowed are none"),
        (lambda c, m: mp.rasterize(c, m, method="vertex", level=1.5), "whole number from 0 to 7"),
        (lambda c, m: mp.rasterize(c, m, method="cubemap", resolution=0), "pixels from 1 to 16384"),
        (lambda c, m: mp.rasterize(mp.Orthographic(8, 8), m, method="cubemap"), "one center, not Orthographic"),
        (lambda c, m: mp.rasterize(mp.Radial.equidistant(8, 8, fov=4.0), m, method="hemicube"), "use method='cubemap'"),
        (lambda c, m: mp.rasterize("camera", m), "camera is a str"),
        (lambda c, m: mp.rasterize(c, "mesh"), "a str is not a scene: give a Scene, a Mesh"),
        (lambda c, m: mp.shade(mp.rasterize(c, m), m, "toon"), "allowed are color, normal, texture, light"),
        (lambda c, m: mp.shade(mp.rasterize(c, m), mp.builtin_mesh("sphere")), "give the scene that was rasterized"),
        (lambda c, m: mp.interpolate(mp.rasterize(c, m), np.zeros((2, 2))), "per vertex or"),
        (lambda c, m: mp.interpolate(mp.rasterize(c, m), np.array(["a"])), "numbers are needed"),
    ],
)
def test_mistakes_are_named(call, words):
    with pytest.raises(mp.InputError, match=words) as caught:
        call(mp.Radial.paraboloid(8, 8), mp.builtin_mesh("cube"))
    assert "\n" not in str(caught.value)


def test_an_image_of_more_blocks_than_the_pair_budget():
    """One triangle over all of an image whose blocks exceed the budget of pairs."""
    mesh = mp.Mesh([[-9, -9, 1], [9, -9, 1], [0, 19, 1]], [[0, 1, 2]])
    hits = mp.rasterize(mp.Pinhole(4200, 4130), mesh)
    assert hits.mask.all()


@pytest.mark.parametrize("far", [1e3, 1e6, 1e12])
def test_vertices_that_no_face_uses_do_not_matter(far):
    mesh = mp.builtin_mesh("sphere", triangles=80)
    camera = mp.Radial.paraboloid(64, 64, mp.look_at((0, -1.25, 0), (0, 0, 0)))
    with_far = mp.Mesh(np.vstack([mesh.vertices, [[far, far, far]]]), mesh.faces)
    assert np.array_equal(mp.rasterize(camera, with_far).depth, mp.rasterize(camera, mesh).depth)


def test_threads_take_turns():
    mesh, camera = mp.builtin_mesh("sphere", triangles=1280), mp.Radial.paraboloid(48, 48)
    expected = mp.rasterize(camera, mesh).depth
    found, failed = [], []

    def work(fov):
        try:
            for _ in range(4):
                found.append(np.array_equal(mp.rasterize(camera, mesh).depth, expected))
                _ = mp.rasterize(mp.Radial.equidistant(48, 48, fov=fov), mesh).barycentric
        except Exception as error:  # noqa: BLE001
            failed.append(error)

    threads = [threading.Thread(target=work, args=(1 + 0.1 * k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not failed
    assert found == [True] * 24


@pytest.mark.parametrize("method", METHODS)
def test_updates_are_checked(method):
    prepared = mp.prepare(mp.Radial.paraboloid(16, 16), mp.builtin_mesh("cube"), method)
    for wrong in (np.zeros((1, 3)), np.zeros((3, 8)), "x", None):
        with pytest.raises(mp.InputError, match="vertices has shape|vertices is|give either vertices="):
            prepared.update(wrong)


@pytest.mark.parametrize("method", ["invert", "raytrace"])
def test_vertices_may_become_and_stop_being_nan(method):
    corners = np.array([[-1, -1, 1], [1, -1, 1], [0, 1, 1], [-1, -1, 2], [1, -1, 2], [0, 1, 2.0]])
    mesh = mp.Mesh(corners, [[0, 1, 2], [3, 4, 5]])
    camera = mp.Radial.paraboloid(32, 32)
    prepared = mp.prepare(camera, mesh, method)
    whole = prepared.frame().triangle
    broken = corners.copy()
    broken[1] = np.nan
    prepared.update(broken)
    assert set(np.unique(prepared.frame().triangle)) == {-1, 1}
    prepared.update(corners)
    assert np.array_equal(prepared.frame().triangle, whole)


def test_several_meshes_and_the_default_bound_everywhere():
    camera, meshes = mp.Radial.paraboloid(16, 16), [mp.builtin_mesh("cube"), mp.builtin_mesh("sphere")]
    for method in METHODS:
        assert mp.rasterize(camera, meshes, method=method, bound="tight").mask.any()


def test_a_camera_with_jax_numbers_is_rasterized():
    import jax.numpy as jnp

    camera = mp.Radial.paraboloid(32, 32, fov=jnp.float32(3.0))
    plain = mp.Radial.paraboloid(32, 32, fov=float(np.float32(3.0)))
    mesh = mp.builtin_mesh("sphere")
    assert np.array_equal(mp.rasterize(camera, mesh).depth, mp.rasterize(plain, mesh).depth)
