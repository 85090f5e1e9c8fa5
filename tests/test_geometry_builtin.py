"""The built-in meshes and scenes: counts, soundness, winding, determinism, and views."""

from functools import cache

import numpy as np
import pytest

from mpcam import InputError, Mesh, Scene, builtin_mesh, builtin_scene

PAPER = {"facade": 2_800, "temple": 4_000, "characters": 177_000, "patio": 560_000}
THINGS = {"knot": 20_000, "teapot": 20_000, "barrel": 5_000, "car": 12_000, "statue": 60_000, "maze": 20_000}
"""Of Rosen et al. 2011, with their default numbers of triangles."""
RANGES = {
    "facade": (600, 4_900),
    "temple": (2_200, 100_000),
    "characters": (25_000, 2_000_000),
    "patio": (60_000, 3_000_000),
    "knot": (200, 2_000_000),
    "teapot": (1_000, 2_000_000),
    "barrel": (1_000, 1_000_000),
    "car": (4_000, 1_000_000),
    "statue": (8_000, 1_000_000),
    "maze": (3_000, 1_000_000),
}
# small enough to test each property quickly
LIGHT = {"facade": 4_900, "temple": 4_000, "characters": 25_000, "patio": 60_000}
LIGHT |= {"knot": 2_000, "teapot": 5_000, "barrel": 4_000, "car": 8_000, "statue": 8_000, "maze": 5_000}


@cache
def built(name: str) -> Mesh:
    return builtin_mesh(name, LIGHT.get(name))


@pytest.fixture(params=builtin_mesh.names)
def mesh(request) -> Mesh:
    return built(request.param)


def test_names():
    assert builtin_mesh.names == (*PAPER, "sphere", "plane", "cube", "quad_room", *THINGS)


@pytest.mark.parametrize("name", [*PAPER, *THINGS])
def test_default_counts(name):
    mesh = builtin_mesh(name)
    assert mesh.triangle_count == pytest.approx((PAPER | THINGS)[name], rel=0.005 if name in PAPER else 0.02)
    assert mesh.name == name


@pytest.mark.parametrize("name", RANGES)
def test_counts_come_near_what_is_asked_for(name):
    low, high = RANGES[name]
    high = min(high, 250_000)
    for count in np.geomspace(low, high, 6 if name in ("facade", "temple") else 3).round().astype(int):
        assert builtin_mesh(name, int(count)).triangle_count == pytest.approx(
            count, rel=0.04 if name in THINGS else 0.03
        )


@pytest.mark.parametrize(
    ("name", "asked", "made"),
    [
        ("sphere", 20, 20),
        ("sphere", 1_000, 1_280),
        ("sphere", 20_480, 20_480),
        ("plane", 2, 2),
        ("plane", 190, 200),
        ("cube", 12, 12),
        ("cube", 1_200, 1_200),
        ("quad_room", 40, 48),
    ],
)
def test_plain_shapes_come_in_steps(name, asked, made):
    assert builtin_mesh(name, triangles=asked).triangle_count == made


def test_no_triangle_is_degenerate_or_there_twice(mesh):
    corners = mesh.corners
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert doubled.min() > 1e-6
    # a triangle is told by its three corners, whatever their order; 0.1 mm apart is the same
    points = np.round(corners * 1e4).astype(np.int64)
    keys = points @ np.array([73_856_093, 19_349_663, 83_492_791])
    keys.sort(axis=1)
    assert len(np.unique(keys, axis=0)) == len(keys)
    assert np.isfinite(mesh.vertices).all()


def test_shading_normals_are_unit_and_on_the_outside(mesh):
    assert mesh.normals is not None
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-12)
    assert ((mesh.normals[mesh.faces] * mesh.face_normals[:, None]).sum(axis=2) > 0).all()


def test_materials_are_in_use(mesh):
    used = np.zeros(1, int) if mesh.face_material is None else np.unique(mesh.face_material)
    assert len(used) == len(mesh.materials)
    if mesh.name in PAPER:
        assert (
            len({material.color for material in mesh.materials}) + sum(m.texture is not None for m in mesh.materials)
            > 8
        )
        assert mesh.uv is not None and np.isfinite(mesh.uv).all()


@pytest.mark.parametrize("name", builtin_mesh.names)
def test_the_same_every_time(name):
    first, second = built(name), builtin_mesh(name, LIGHT.get(name))
    np.testing.assert_array_equal(first.vertices, second.vertices)
    np.testing.assert_array_equal(first.faces, second.faces)


def first_hits(mesh: Mesh, eye, directions) -> tuple[np.ndarray, np.ndarray]:
    """Nearest triangle along each ray (-1: none) by brute force, and whether its front is seen."""
    edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    reach = np.asarray(eye, float) - mesh.corners[:, 0]
    height = -(normal * reach).sum(axis=1)
    turned = (np.cross(reach, edges[:, 1]), np.cross(edges[:, 0], reach))
    found, front = [], []
    for direction in directions:
        slope = normal @ direction
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = height / slope
            u, v = (turned[0] @ direction) / slope, (turned[1] @ direction) / slope
            inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 1e-9)
        nearest = np.where(inside, distance, np.inf)
        best = int(nearest.argmin())
        found.append(best if inside[best] else -1)
        front.append(bool(slope[best] < 0))
    return np.array(found), np.array(front)


@pytest.mark.parametrize("name", [*PAPER, "quad_room"])
def test_the_eye_sees_fronts_all_round(name):
    mesh = built(name)
    directions = np.random.default_rng(3).standard_normal((150, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found, front = first_hits(mesh, (0.0, 0.0, 1.6), directions)
    assert front[found >= 0].all()
    # the ground reaches as far as one sees
    assert (found[directions[:, 2] < -0.06] >= 0).all()
    if name in ("facade", "temple", "patio"):
        assert (found >= 0).mean() > 0.7
    if name == "quad_room":
        assert (found >= 0).all()


def test_brute_force_rays_see_a_sphere_from_both_sides():
    mesh = builtin_mesh("sphere", 320)
    inside, front = first_hits(mesh, (0.01, 0.02, 0.03), np.eye(3))
    assert (inside >= 0).all() and not front.any()
    outside, front = first_hits(mesh, (3.0, 0.1, 0.2), [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    assert outside[0] >= 0 and front[0] and outside[1] == -1


@pytest.mark.parametrize("name", ["sphere", "cube"])
def test_closed_shapes_point_outwards(name):
    mesh = builtin_mesh(name, 1_200)
    a, b, c = mesh.corners.transpose(1, 0, 2)
    volume = (np.cross(a, b) * c).sum() / 6
    assert volume == pytest.approx(4.16 if name == "sphere" else 8.0, rel=0.01)


def test_characters_are_closed_bodies():
    """Every edge has one face on each side, whole scene but for the ground."""
    mesh = built("characters")
    points = np.round(mesh.vertices * 1e7).astype(np.int64)
    _, weld = np.unique(points, axis=0, return_inverse=True)
    faces = weld.reshape(-1)[mesh.faces[2:]]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forth = {(int(a), int(b)) for a, b in edges}
    assert len(forth) == len(edges)
    assert forth == {(b, a) for a, b in forth}


@pytest.mark.parametrize(
    ("name", "triangles", "words"),
    [
        ("fasade", None, ["fasade", "facade", "quad_room"]),
        (3, None, ["3", "patio"]),
        ("facade", 100, ["100", "600", "4,900"]),
        ("patio", 10**9, ["60,000", "3,000,000"]),
        ("cube", 0, ["12"]),
        ("cube", 12.0, ["whole number"]),
        ("cube", True, ["whole number"]),
        ("cube", "many", ["many", "whole number"]),
    ],
)
def test_wrong_names_and_numbers(name, triangles, words):
    for make in (lambda: builtin_mesh(name, triangles), lambda: builtin_scene(name, triangles=triangles)):
        with pytest.raises(InputError) as caught:
            make()
        assert "\n" not in str(caught.value)
        for word in words:
            assert word in str(caught.value)


@pytest.mark.parametrize("name", builtin_mesh.names)
def test_scenes_look_at_something(name):
    scene = builtin_scene(name, 40, 30, triangles=LIGHT.get(name))
    assert isinstance(scene, Scene) and scene.name == name
    assert (scene.camera.width, scene.camera.height) == (40, 30)
    assert scene.lights and max(scene.background) > 0
    u, v = np.meshgrid(20.0 + np.arange(-10.0, 11.0, 4.0), 15.0 + np.arange(-10.0, 11.0, 4.0))
    ray = scene.camera.ray(np.stack([u, v], axis=-1))
    assert np.asarray(ray.valid).all()
    eye = np.asarray(ray.origin, float).reshape(-1, 3)[0]
    found, front = first_hits(scene.mesh, eye, np.asarray(ray.direction, float).reshape(-1, 3))
    assert front[found >= 0].all()
    assert (found >= 0).mean() > (0.4 if name in PAPER else 0.1)
