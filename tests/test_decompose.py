"""Decompositions: vertices on the true surface, rays that converge to the true ones, and shapes of every kind."""

import numpy as np
import pytest

import mpcam as mp
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.decompose import decompose, directions_at_vertices, subdivided
from mpcam.decomposition.ray_error import ray_error
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.shooting import Locator, neighbors, shoot
from mpcam.decomposition.simplify import simplify
from mpcam.decomposition.views import seen_samples, surface_samples
from mpcam.errors import InputError
from mpcam.geometry.surfaces import Surface

EYE = np.array([3.0, 1.0, 2.5])
SHAPES = {
    "sphere": Surface.sphere(),
    "torus": Surface.torus(),
    "wave": Surface.wave(waves=1.0),
    "bowl": Surface.paraboloid(1.0, 0.5),
    "cylinder": Surface.cylinder(),
    "saddle": Surface.saddle(),
}


@pytest.fixture(scope="module")
def made() -> dict[str, CameraTriangles]:
    return {name: decompose(shape, EYE, 104) for name, shape in SHAPES.items()}


def test_vertices_and_normals_are_those_of_the_surface(made):
    for name, cams in made.items():
        shape = SHAPES[name]
        assert 80 <= cams.count <= 104, name
        assert np.abs(shape.snap(cams.vertices, cams.normals) - cams.vertices).max() < 1e-9, name
        assert np.abs(shape.normal_at(cams.vertices) - cams.normals).max() < 1e-9, name
        edges = np.sort(cams.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert np.unique(edges, axis=0, return_counts=True)[1].max() == 2, name
        corners = cams.vertices[cams.faces]
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert ((flat[:, None] * cams.normals[cams.faces]).sum(-1) > 0).all(), name


def test_every_point_that_the_eye_sees_has_a_camera_triangle(made):
    for name in ("sphere", "torus"):
        whole, cams = reflector_of(SHAPES[name]), made[name]
        view = seen_samples(whole, EYE, 20_000)
        place = Locator(cams.vertices, cams.normals, cams.faces).locate(view.points, view.normals)
        assert place.inside.mean() > (0.999 if name == "torus" else 0.999999), name  # a thin fold at the outline


def test_hidden_triangles_are_left_out(made):
    """The far cap of a sphere, and what lies outside of a camera's picture."""
    toward = EYE / np.linalg.norm(EYE)
    centers = made["sphere"].vertices[made["sphere"].faces].mean(axis=1)
    assert (centers @ toward).min() > -0.3
    camera = mp.Pinhole(128, 128, 450, 450, 64, 64, camera_from_world=mp.look_at(EYE, (0, 0, 0.7)))
    cams = decompose(SHAPES["sphere"], camera, 104)
    u, v, z = (cams.vertices[cams.faces].mean(axis=1) @ camera.camera_from_world[:3, :3].T).T + np.reshape(
        camera.camera_from_world[:3, 3], (3, 1)
    )
    assert np.abs(np.stack([u, v]) / z).max() < 1.6 * 64 / 450
    assert ray_error(cams, SHAPES["sphere"], camera).rms < 0.3 * ray_error(made["sphere"], SHAPES["sphere"], EYE).rms


@pytest.mark.parametrize(("name", "triangles"), [("sphere", 26), ("torus", 104), ("wave", 104)])
def test_ray_errors_fall_with_the_square_of_the_edges(name, triangles):
    base = decompose(SHAPES[name], EYE, triangles, resolution=128)  # with 26 a bump has one or two
    errors = []
    for level in range(4):
        cams = subdivided(base, SHAPES[name], level)
        assert cams.count == base.count * 4**level
        assert cams.resolution == 128 // 2**level
        found = ray_error(cams, SHAPES[name], EYE, samples=10_000)
        assert found.missed <= 0.02 * found.count
        errors.append(found.median)
    slope = -np.polyfit(np.log(2.0) * np.arange(4), np.log(errors), 1)[0]
    assert 1.8 < slope < 2.2, errors


def test_decompositions_of_more_triangles_have_less_error(made):
    for name in ("sphere", "bowl", "saddle"):
        few, many = made[name], decompose(SHAPES[name], EYE, 416)
        errors = [ray_error(cams, SHAPES[name], EYE, samples=5_000) for cams in (few, many)]
        assert errors[1].rms < 0.4 * errors[0].rms, name
        assert 0 < errors[1].median <= errors[1].p95 <= errors[1].max
        assert errors[1].angle_rms < 0.5 * errors[0].angle_rms


def test_collapses_that_see_normals_bend_rays_better_than_those_by_position():
    whole = reflector_of(Surface.wave(waves=1.0).mesh(4000))
    spread = []
    for bend in (1e-6, 0.5):
        vertices, normals, faces = simplify(whole.vertices, whole.normals, whole.faces, 200, bend=bend)
        assert len(faces) <= 200
        shot = shoot(whole, vertices, normals)
        cams = CameraTriangles(shot.points, faces, normals=shot.normals, eye=(0.2, 0.3, 3.0))
        spread.append(ray_error(cams, Surface.wave(waves=1.0), (0.2, 0.3, 3.0), samples=5_000).rms)
    assert spread[1] < 0.9 * spread[0]


def test_true_rays_of_a_sphere_are_those_of_the_formula():
    """Camera triangles of one tiny patch: error zero at their vertices, and of the order of the sagitta between."""
    angle = 1e-3
    corners = np.array([[0, 0, 1], [np.sin(angle), 0, np.cos(angle)], [0, np.sin(angle), np.cos(angle)]])
    cams = CameraTriangles(corners, [[0, 1, 2]], normals=corners, eye=(0.5, 0.2, 4.0))
    patch = mp.Mesh(corners, [[0, 1, 2]], normals=corners)
    found = ray_error(cams, patch, (0.5, 0.2, 4.0), samples=500)
    assert found.max < 1e-15 + 1e-12 * found.distance
    assert found.count == 500
    assert np.isclose(found.distance, 2 * reflector_of(patch).radius)


def test_direct_cameras_have_more_error_and_need_no_eye(made):
    for name in ("sphere", "saddle"):
        direct = directions_at_vertices(made[name])
        assert direct.kind == "direct"
        assert direct == decompose(SHAPES[name], EYE, 104, mode="directions")
        bent, linear = (ray_error(cams, SHAPES[name], EYE, samples=4_000) for cams in (made[name], direct))
        assert bent.rms < linear.rms < 0.5


def test_refraction():
    glass, errors = Surface.ellipsoid((1.0, 0.8, 0.6)), []
    for count in (104, 416):
        cams = decompose(glass, EYE, count, index=1.5)
        assert cams.kind == "refraction"
        errors.append(ray_error(cams, glass, EYE, samples=4_000))
    assert errors[1].rms < 0.4 * errors[0].rms
    assert errors[1].missed < 0.01 * errors[1].count  # at the outline the interpolated normal may look away
    # From dense to thin: no ray where light is totally reflected, and vertices without one.
    out = decompose(glass, EYE, 104, index=1 / 1.5)
    assert ray_error(out, glass, EYE, samples=4_000).count < 3_000
    with pytest.raises(InputError, match="totally reflected"):
        directions_at_vertices(out)


def test_flat_mirrors_and_small_meshes_are_exact():
    flat, cube, ball = (mp.builtin_mesh(n, triangles=t) for n, t in (("plane", 200), ("cube", 1200), ("sphere", 80)))
    for mesh, few, most in ((flat, 1, 2), (flat, 30, 30), (cube, 24, 24), (ball, 104, 80)):
        cams = decompose(mesh, EYE, few)
        found = ray_error(cams, mesh, EYE, samples=4_000)
        assert cams.count <= most
        assert found.rms < 1e-4 and found.median < 1e-12 and found.missed == 0
    bare = mp.Mesh(ball.vertices, ball.faces)  # no normals: a smooth surface
    assert ray_error(decompose(bare, EYE, 104), bare, EYE, samples=2_000).rms < 1e-12


@pytest.mark.parametrize("triangles", [1, 2, 3, 5, 400])
def test_any_number_of_triangles(triangles):
    for shape in (SHAPES["sphere"], SHAPES["bowl"]):
        cams = decompose(shape, EYE, triangles)
        assert 1 <= cams.count <= max(triangles, 8)
        assert cams.count >= 0.9 * triangles - 1
        assert np.isfinite(ray_error(cams, shape, EYE, samples=2_000).rms)


def test_hollow_mirrors_are_seen_from_inside():
    inside = np.array([0.3, 0.2, 0.1])
    cams = decompose(SHAPES["sphere"], inside, 104)
    found = ray_error(cams, SHAPES["sphere"], inside, samples=4_000)
    assert found.missed == 0 and found.rms < 0.05


def test_size_and_place_do_not_matter():
    plain = decompose(Surface.torus().mesh(3000), EYE, 104)
    mesh = Surface.torus().mesh(3000)
    for scale in (1e-5, 1e5):
        matrix = np.diag([scale, scale, scale, 1.0])
        matrix[:3, 3] = 7.0 * scale
        eye = scale * EYE + 7.0 * scale
        there = mesh.transformed(matrix)
        found = ray_error(decompose(there, eye, 104), there, eye, samples=4_000)
        assert 0.5 < found.median / scale / ray_error(plain, mesh, EYE, samples=4_000).median < 2.0


def test_the_same_call_gives_the_same_camera_triangles(made):
    again = decompose(Surface.sphere(), EYE, 104)
    assert np.array_equal(again.faces, made["sphere"].faces)
    assert np.array_equal(again.vertices, made["sphere"].vertices)


def test_meshes_with_broken_faces():
    mesh = Surface.sphere().mesh(2000)
    vertices = np.concatenate([mesh.vertices, [[np.nan] * 3, [np.inf, 0, 0]]])
    count = len(mesh.vertices)
    faces = np.concatenate([mesh.faces, [[0, 1, count], [count + 1, 2, 3], [5, 5, 6]]])
    assert mesh.normals is not None
    broken = mp.Mesh(vertices, faces, normals=np.vstack([mesh.normals, np.diag((0, np.nan, 0))[:2]]))
    found = ray_error(decompose(broken, EYE, 104), broken, EYE, samples=2_000)
    assert found.rms < 0.05 and found.missed == 0


def test_very_large_meshes_are_cut_down_first():
    shape = Surface.ellipsoid((1.0, 0.8, 0.9))
    mesh = shape.mesh(40_000)
    cams = decompose(mesh, EYE, 104)
    assert np.abs(shape.snap(cams.vertices, cams.normals) - cams.vertices).max() < 1e-3
    assert ray_error(cams, mesh, EYE, samples=4_000).rms < 0.1


def test_poses_of_camera_triangles(made):
    """Camera triangles given in a turned frame have the same errors."""
    pose = mp.look_at((1, 2, 3), (0, 0, 0))
    for cams in (made["torus"], directions_at_vertices(made["torus"])):
        fields = {n: getattr(cams, n) for n in ("normals", "directions") if getattr(cams, n) is not None}
        turned = CameraTriangles(
            cams.vertices @ pose[:3, :3].T + pose[:3, 3],
            cams.faces,
            **{name: value @ pose[:3, :3].T for name, value in fields.items()},
            eye=None if cams.eye is None or cams.normals is None else pose[:3, :3] @ cams.eye + pose[:3, 3],
            camera_from_world=pose,
        )
        a, b = (ray_error(one, SHAPES["torus"], EYE, samples=2_000).rms for one in (cams, turned))
        assert np.isclose(a, b, rtol=1e-6)
        if cams.normals is not None:
            finer = subdivided(turned, SHAPES["torus"])
            assert ray_error(finer, SHAPES["torus"], EYE, samples=2_000).rms < 0.6 * a


# Normal shooting


def test_shooting_and_its_inverse_are_inverse(made):
    for name, cams in made.items():
        whole = reflector_of(SHAPES[name])
        rng = np.random.default_rng(3)
        face = rng.integers(0, cams.count, 3000)
        weights = rng.dirichlet((1, 1, 1), 3000)
        points = (weights[..., None] * cams.vertices[cams.faces[face]]).sum(axis=1)
        ways = (weights[..., None] * cams.normals[cams.faces[face]]).sum(axis=1)
        shot = shoot(whole, points, ways)
        away = shot.points - points
        side = np.linalg.norm(np.cross(away, ways / np.linalg.norm(ways, axis=1, keepdims=True)), axis=1)
        straight = side < 1e-5  # others are beyond the border, where the closest point took over
        assert straight.mean() > 0.97, name
        place = Locator(cams.vertices, cams.normals, cams.faces).locate(shot.points, shot.normals)
        back = np.stack([1 - place.second - place.third, place.second, place.third], axis=1)
        found = (back[..., None] * cams.vertices[cams.faces[place.face]]).sum(axis=1)
        gap = np.linalg.norm(found - points, axis=1)[straight & place.inside]
        assert np.percentile(gap, 99) < 2e-5, name


def test_thin_sheets_are_shot_on_their_own_side():
    mesh = mp.builtin_mesh("cube", triangles=12).transformed(np.diag([1, 1, 1e-3, 1]))
    whole = reflector_of(mesh)
    x, y = np.random.default_rng(4).uniform(-0.9, 0.9, (2, 50))
    for side in (1.0, -1.0):
        shot = shoot(whole, np.stack([x, y, 0 * x], axis=1), np.tile([0, 0, side], (50, 1)))
        assert np.allclose(shot.normals, [0, 0, side])
        assert np.allclose(shot.points[:, 2], 1e-3 * side)
        face, _, _ = whole.closest(shot.points * [1, 1, -1], shot.normals)
        assert np.allclose(whole.face_normals[face], [0, 0, side])


def test_closest_points_are_those_of_all_triangles():
    whole = reflector_of(Surface.torus().mesh(600))
    points = np.random.default_rng(5).normal(size=(50, 3))
    ways = np.random.default_rng(6).normal(size=(50, 3))
    from mpcam.decomposition.reflector import _nearest_in

    face, second, third = whole.closest(points, ways)
    found = np.linalg.norm(
        (np.stack([1 - second - third, second, third], 1)[..., None] * whole.vertices[whole.faces[face]]).sum(1)
        - points,
        axis=1,
    )
    _, _, gaps = _nearest_in(whole.vertices[whole.faces][None], points[:, None])
    gaps = np.where((whole.face_normals[None] * ways[:, None]).sum(-1) > 0, gaps, np.inf)
    assert np.allclose(found, gaps.min(axis=1), atol=1e-12)


def test_neighbors_across_edges():
    faces = np.array([[0, 1, 2], [2, 1, 3], [3, 1, 4]])
    assert neighbors(faces).tolist() == [[1, -1, -1], [2, -1, 0], [-1, -1, 1]]
    assert neighbors(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])).max() == -1  # three at one edge


def test_samples_lie_evenly_over_the_area():
    whole = reflector_of(Surface.sphere())
    points, _ = whole.at(*surface_samples(whole, 20_000))
    assert np.abs(points.mean(axis=0)).max() < 2e-3
    assert np.allclose((points**2).mean(axis=0), 1 / 3, atol=3e-3)


# What is refused

BALL = Surface.sphere()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: decompose("teapot", EYE), "Mesh or a Surface"),
        (lambda: decompose(BALL, (1, 2)), "three finite numbers"),
        (lambda: decompose(BALL, (1, 2, np.nan)), "three finite numbers"),
        (lambda: decompose(BALL, "eye"), "three finite numbers"),
        (lambda: decompose(BALL, (0, 0, 1)), "on the reflector"),
        (lambda: decompose(BALL, mp.Orthographic(8, 8, 4.0)), "no common center"),
        (lambda: decompose(BALL, mp.Pinhole(8, 8, 8, 8, 4, 4, mp.look_at((0, 0, 5), (0, 0, 9)))), "no pixel"),
        (lambda: decompose(BALL, EYE, 0), "from 1 to"),
        (lambda: decompose(BALL, EYE, 2.5), "whole number"),
        (lambda: decompose(BALL, EYE, True), "whole number"),
        (lambda: decompose(BALL, EYE, mode="rays"), "normals, directions"),
        (lambda: decompose(BALL, EYE, resolution=1), "resolution"),
        (lambda: decompose(BALL, EYE, index=-1.5), "index"),
        (lambda: decompose(mp.Mesh([], []), EYE), "0 triangles"),
        (lambda: decompose(mp.Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]), EYE), "area"),
        (lambda: decompose(mp.Mesh([[0, 0, np.nan], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]), EYE), "finite"),
        (lambda: ray_error("cams", BALL, EYE), "CameraTriangles"),
    ],
)
def test_what_cannot_be_decomposed_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"eye": (3, 1, 2)}, "decompose anew"),
        ({"eye": (0, 0, 0, 0)}, "three finite numbers"),
        ({"samples": 0}, "samples"),
        ({"distance": -1.0}, "distance"),
        ({"distance": np.nan}, "distance"),
        ({"distance": "far"}, "distance"),
    ],
)
def test_what_cannot_be_compared_is_refused(made, settings, words):
    with pytest.raises(InputError, match=words):
        ray_error(made["sphere"], BALL, **{"eye": EYE, **settings})


def test_what_cannot_be_subdivided_is_refused(made):
    direct = directions_at_vertices(made["sphere"])
    with pytest.raises(InputError, match="with normals"):
        subdivided(direct, BALL)
    with pytest.raises(InputError, match="already"):
        directions_at_vertices(direct)
    with pytest.raises(InputError, match="levels"):
        subdivided(made["sphere"], BALL, 7)
