"""Form factors and ambient occlusion against closed formulas, and the coverage maps that they count."""

import drjit as dr
import numpy as np
import pytest
from catalog import NAMES, cameras, soup

import mpcam as mp
from mpcam.effects.occlusion import facing

UP = (0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)


def ball(radius: float, distance: float) -> mp.Mesh:
    """A ball around (0, 0, distance), of so many triangles that its volume is off by 1e-4."""
    matrix = np.diag([radius, radius, radius, 1.0])
    matrix[2, 3] = distance
    return mp.builtin_mesh("sphere", triangles=81_920).transformed(matrix)


def disc(radius: float, height: float, parts: int = 2048) -> mp.Mesh:
    angle = np.linspace(0, 2 * np.pi, parts, endpoint=False)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(parts, height)], -1)
    first = np.arange(parts)
    faces = np.stack([0 * first, 1 + first, 1 + (first + 1) % parts], -1)
    return mp.Mesh(np.vstack([[0, 0, height], rim]), faces)


def rectangle(*corners) -> mp.Mesh:
    return mp.Mesh(corners, [[0, 1, 2], [0, 2, 3]])


def parallel(a: float, b: float, c: float) -> tuple[mp.Mesh, float]:
    """A rectangle a x b at height c with a corner straight above the element, and its form factor."""
    x, y = a / c, b / c
    p, q = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    factor = (x / p * np.arctan(y / p) + y / q * np.arctan(x / q)) / (2 * np.pi)
    return rectangle((0, 0, c), (a, 0, c), (a, b, c), (0, b, c)), factor


def perpendicular(a: float, b: float, c: float) -> tuple[mp.Mesh, float]:
    """A wall a high and b wide at distance c, from the element's plane upwards and to one side."""
    x, y = c / b, a / b
    root = np.sqrt(x * x + y * y)
    factor = (np.arctan(1 / x) - x / root * np.arctan(1 / root)) / (2 * np.pi)
    return rectangle((c, 0, 0), (c, b, 0), (c, b, a), (c, 0, a)), factor


def tilted(angle: float, azimuth: float) -> tuple[float, float, float]:
    return np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)


def cases(kind: str) -> list[tuple[mp.Mesh, tuple, float, str]]:
    """Mesh, normal, exact share, weight."""
    if kind == "ball":
        return [(ball(r, d), UP, (r / d) ** 2, "cosine") for r, d in ((0.5, 1.3), (0.3, 0.8), (0.9, 1.5))]
    if kind == "solid angle":
        return [
            (ball(r, d), UP, 1 - np.sqrt(1 - (r / d) ** 2), "uniform") for r, d in ((0.5, 1.3), (0.3, 0.8), (0.9, 1.5))
        ]
    if kind == "tilted ball":
        mesh, share = ball(0.4, 1.7), (0.4 / 1.7) ** 2
        angles = (0.2, 0.7, 1.1, 0.5 * np.pi - np.arcsin(0.4 / 1.7))
        return [(mesh, tilted(a, 3 * a), share * np.cos(a), "cosine") for a in angles]
    if kind == "disc":
        return [(disc(r, h), UP, r * r / (r * r + h * h), "cosine") for r, h in ((1, 1), (0.5, 1.2), (2, 0.7))]
    make = parallel if kind == "parallel" else perpendicular
    found = [make(*sides) for sides in ((1, 1, 1), (2, 0.5, 0.7), (3, 2, 0.3))]
    return [(mesh, UP, factor, "cosine") for mesh, factor in found]


KINDS = ("ball", "solid angle", "tilted ball", "disc", "parallel", "perpendicular")


def error(kind: str, size: int) -> float:
    """Root mean square of the errors of a kind's cases."""
    found = [
        mp.form_factor(mesh, ORIGIN, normal, size, weight=weight) - share for mesh, normal, share, weight in cases(kind)
    ]
    return float(np.sqrt(np.mean(np.square(found))))


@pytest.mark.parametrize("kind", KINDS)
def test_shares_are_those_of_the_formulas(kind):
    """A pixel's width at the outline is the most that counting can be off by; in the mean it is far less."""
    assert error(kind, 64) < 1.5e-3
    assert error(kind, 256) < 3e-4


@pytest.mark.parametrize("kind", KINDS)
def test_errors_fall_at_least_as_one_over_size(kind):
    sizes = np.array([16, 32, 64, 128, 256])
    slope = np.polyfit(np.log(sizes), np.log([error(kind, int(size)) for size in sizes]), 1)[0]
    assert slope < -1


def test_ambient_occlusion_is_the_rest():
    mesh = ball(0.5, 1.3)
    for weight in ("cosine", "uniform"):
        covered = mp.form_factor(mesh, ORIGIN, UP, 32, weight=weight)
        assert mp.ambient_occlusion(mesh, ORIGIN, UP, 32, weight) == 1 - covered


@pytest.mark.parametrize("weight", ["cosine", "uniform"])
def test_a_closed_box_is_dark_and_the_open_air_is_bright(weight):
    rng = np.random.default_rng(1)
    points, normals = rng.uniform(-0.9, 0.9, (30, 3)), rng.normal(size=(30, 3))
    box = mp.builtin_mesh("cube").transformed(np.diag([2.5, 2.5, 2.5, 1.0]))
    assert box.bounds[1].min() > 1
    assert np.array_equal(mp.ambient_occlusion(box, points, normals, 32, weight), np.zeros(30))
    assert np.array_equal(mp.ambient_occlusion(box, points + 9, points + 9, 32, weight), np.ones(30))
    empty = mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert np.array_equal(mp.ambient_occlusion(empty, points, normals, 32, weight), np.ones(30))


def test_an_element_does_not_see_its_own_face():
    """Points on the faces of a convex body: nothing outside, everything inside."""
    for scale, shift in ((1.0, 0.0), (1e-6, 3.0), (1e6, -5e7)):
        matrix = np.diag([scale, scale, scale, 1.0])
        matrix[:3, 3] = shift * scale
        mesh = mp.builtin_mesh("cube", triangles=108).transformed(matrix)
        middle = mesh.corners.mean(axis=1)
        assert np.array_equal(mp.form_factor(mesh, middle, mesh.face_normals, 32), np.zeros(len(middle)))
        assert np.array_equal(mp.form_factor(mesh, middle, -mesh.face_normals, 32), np.ones(len(middle)))


def test_without_the_offset_it_would():
    mesh = mp.builtin_mesh("sphere", triangles=1280)
    middle = mesh.corners.mean(axis=1)
    assert mp.form_factor(mesh, middle, mesh.face_normals, 16).max() == 0
    assert mp.form_factor(mesh, middle, mesh.face_normals, 16, offset=-1e-6).max() == 1


def test_a_corner_of_a_room():
    """Half open at a wall, and (by symmetry) a quarter in the edge of two: cosine weight."""
    wall = rectangle((0, -1e3, -1e3), (0, 1e3, -1e3), (0, 1e3, 1e3), (0, -1e3, 1e3))
    assert abs(mp.ambient_occlusion(wall, (1e-3, 0, 0), UP, 256) - 0.5) < 2e-3
    other = rectangle((-1e3, 0, -1e3), (1e3, 0, -1e3), (1e3, 0, 1e3), (-1e3, 0, 1e3))
    both = mp.Mesh.concatenate([wall, other])
    assert abs(mp.ambient_occlusion(both, (1e-3, 1e-3, 0), UP, 256) - 0.25) < 2e-3


def test_shapes_are_those_of_the_points():
    mesh = mp.builtin_mesh("cube")
    points = np.zeros((2, 5, 3)) + (0, 0, 3)
    assert mp.form_factor(mesh, points, -points, 16).shape == (2, 5)
    assert np.ptp(mp.form_factor(mesh, points, -7 * points, 16)) == 0
    assert mp.form_factor(mesh, points[0, 0], -points[0, 0], 16).shape == ()
    assert mp.form_factor(mesh, np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    assert mp.form_factor(mp.Scene((mesh,)), points, -points, 16).max() > 0


def test_moving_the_eye_compiles_nothing():
    mesh, rng = soup(500, seed=3), np.random.default_rng(2)
    points, normals = rng.normal(size=(40, 3)), rng.normal(size=(40, 3))
    mp.form_factor(mesh, points, normals, 32)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        mp.form_factor(mesh, points + 0.1, normals, 32)
        history = dr.kernel_history([dr.KernelType.JIT])
    assert len(history) >= 40 * 3
    assert all(kernel["cache_hit"] for kernel in history)


def test_views_are_turned_by_rotations():
    rng = np.random.default_rng(4)
    normals = np.vstack([rng.normal(size=(200, 3)), np.eye(3), -np.eye(3)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turns = facing(normals)
    assert np.allclose(turns @ turns.transpose(0, 2, 1), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(turns), 1)
    assert np.allclose(np.einsum("nij,nj->ni", turns, normals), UP)


@pytest.mark.parametrize("name", NAMES)
def test_coverage_is_the_mask_of_the_hits(name):
    eye = (0.12, 0.07, 0.31) if name != "orthographic" else (-15.0, -20.0, 9.0)
    camera = cameras(100, mp.look_at(eye, (0.5, 1.0, 0.7)))[name]
    v, u = np.indices((100, 100)) + 0.5
    valid = camera.ray(np.stack([u, v], -1)).valid
    partly = 0
    for mesh in (mp.builtin_mesh("temple"), soup(6, seed=21), soup(300, seed=21)):
        coverage, hits = mp.coverage_map(camera, mesh), mp.rasterize(camera, mesh)
        assert np.array_equal(coverage.mask, hits.mask)
        assert coverage.fraction == pytest.approx(hits.mask.sum() / valid.sum())
        partly += 0 < coverage.fraction < 1
    assert partly


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: mp.form_factor(m, (0, 0), UP), r"points has shape \(2,\): the last axis must have length 3"),
        (lambda m: mp.form_factor(m, "here", UP), r"points: numbers of shape \(..., 3\) are needed, got 'here'"),
        (lambda m: mp.form_factor(m, ORIGIN, [UP, UP]), r"normals have shape \(2, 3\) and points \(3,\)"),
        (lambda m: mp.form_factor(m, [ORIGIN] * 2, [UP, ORIGIN]), r"normals\[1\] is \[0.0, 0.0, 0.0\]: give a direc"),
        (lambda m: mp.form_factor(m, (0, np.nan, 0), UP), "points is .*nan.*: finite numbers are needed"),
        (lambda m: mp.form_factor(m, ORIGIN, UP, 4), "size=4: a whole number of pixels from 8 to 4096"),
        (lambda m: mp.form_factor(m, ORIGIN, UP, 64.0), "size=64.0: a whole number"),
        (lambda m: mp.form_factor(m, ORIGIN, UP, offset="big"), "offset='big': a finite length"),
        (lambda m: mp.ambient_occlusion(m, ORIGIN, UP, weight="flat"), "weight='flat': allowed are cosine, uniform"),
        (lambda m: mp.ambient_occlusion("mesh", ORIGIN, UP), "a str is not a scene: give a Scene, a Mesh"),
    ],
)
def test_mistakes_are_named(call, words):
    with pytest.raises(mp.InputError, match=words) as caught:
        call(mp.builtin_mesh("cube"))
    assert "\n" not in str(caught.value)
