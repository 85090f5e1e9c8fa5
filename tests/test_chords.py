"""Bounding triangles hold the whole image of a triangle, touch its edges, and are as few as can be (every profile)."""

import drjit as dr
import drjit.llvm as types
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalog import cameras, triangles
from hypothesis import given, settings
from hypothesis import strategies as st

import mpcam as mp
from mpcam.backend import aligned
from mpcam.cameras.chords import chord_pieces, radial_bound_triangles
from mpcam.cameras.outline import Outline

SIZE = 512
CAMERAS = {name: camera for name, camera in cameras(SIZE).items() if isinstance(camera, mp.Radial)}
CAMERAS["equisolid 270"] = mp.Radial.equisolid(SIZE, SIZE, fov=1.5 * np.pi)
CAMERAS["user 270"] = mp.Radial.from_function(SIZE, SIZE, lambda theta: theta, fov=1.5 * np.pi)
CAMERAS["paraboloid 320"] = mp.Radial.paraboloid(SIZE, SIZE, fov=np.radians(320))
PROFILES = ["paraboloid", "cosine_sphere", "equisolid", "equidistant"]

_ALONG = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 33))
_INSIDE = np.array([(i, j, 8 - i - j) for i in range(9) for j in range(9 - i)]) / 8
_EDGES = np.stack([1 - _ALONG, _ALONG, 0 * _ALONG], -1)
WEIGHTS = np.concatenate([_EDGES, _EDGES[:, [2, 0, 1]], _EDGES[:, [1, 2, 0]], _INSIDE])


def split(corners):
    return [np.moveaxis(corners[:, i], -1, 0) for i in range(3)]


def seen_points(camera, corners):
    """Pixels of sampled points of triangles (N, 3, 3), and which of them are seen."""
    image = camera.local_project(np.moveaxis(np.einsum("mk,nkc->nmc", WEIGHTS, corners), -1, 0))[0]
    return image.pixel, image.valid


def depth(piece, u, v):
    """How far points (N, M) lie inside each of N pieces, pixels; negative outside."""
    columns = [np.asarray(n, np.float64)[:, None] for n in (*piece.low, *piece.high)]
    left, top, right, bottom = columns
    values = [u - left, v - top, right - u, bottom - v]
    for line in piece.lines:
        a, b, c = (np.asarray(n, np.float64)[:, None] for n in line)
        values.append(a * u + b * v + c)
    return np.where(np.asarray(piece.valid)[:, None], np.minimum.reduce(values), -np.inf)


def assert_holds(pieces, pixel, seen, slack=0.0):
    best = np.maximum.reduce([depth(piece, *pixel) for piece in pieces])
    missed = (seen & (best < -slack)).any(1)
    assert not missed.any(), (np.flatnonzero(missed), -best[seen].min())


def count(pieces):
    return np.sum([piece.valid for piece in pieces], axis=0)


def families(number, seed):
    """Random triangles (number, 3, 3) by kind."""
    rng = np.random.default_rng(seed)
    plain = triangles(number, seed)
    flat = 10.0 ** rng.uniform(-4, 0, (number, 1))
    along = rng.uniform(-0.5, 1.5, (number, 1))
    thin = 10.0 ** rng.uniform(-6, -1, (number, 1)) * rng.normal(size=(number, 3))
    needles = plain.copy()
    needles[:, 2] = plain[:, 0] * (1 - along) + plain[:, 1] * along + thin
    horizon = plain.copy()
    horizon[..., 2] *= flat
    opposite = plain.copy()
    opposite[:, 1] = -2 * plain[:, 0] + 10.0 ** rng.uniform(-7, -1, (number, 1)) * rng.normal(size=(number, 3))
    wide = 10.0 ** rng.uniform(-3, 1, (number, 1, 1)) * rng.normal(size=(number, 3, 3)) * [1, 1, 0.3]
    return {
        "everywhere": plain,
        "near the horizon": horizon,
        "needles": needles,
        "needles near the horizon": needles * np.stack([np.ones_like(flat), np.ones_like(flat), flat], -1),
        "nearly through the eye": opposite,
        "around the eye": rng.normal(size=(number, 3, 3)),
        "around the axis": wide + [0, 0, 1.0],
        "behind the eye": plain * [1, 1, 0.3] - [0, 0, 1.0],
        "whole numbers": rng.integers(-3, 4, (number, 3, 3)).astype(float),
    }


@pytest.mark.parametrize("kind", list(families(1, 0)))
@pytest.mark.parametrize("name", list(CAMERAS))
def test_pieces_hold_every_sampled_point(name, kind):
    camera, corners = CAMERAS[name], families(300, 11)[kind]
    pixel, seen = seen_points(camera, corners)
    assert_holds(radial_bound_triangles(camera, *split(corners)), pixel, seen)


@pytest.mark.parametrize("name", list(CAMERAS))
def test_pieces_hold_in_float32_kernels(name):
    """Without the slack of the kernels: the lines have their own."""
    camera = CAMERAS[name]
    corners = np.concatenate(list(families(150, 12).values())).astype(np.float32)
    pixel, seen = seen_points(camera, corners.astype(np.float64))
    found = camera.local_bound_triangles(*(types.Array3f(*map(aligned, corners[:, i].T)) for i in range(3)))
    dr.eval([[*piece.lines, piece.low, piece.high, piece.valid] for piece in found])
    pieces = [
        Outline(p.low.numpy(), p.high.numpy(), p.valid.numpy(), tuple(line.numpy() for line in p.lines)) for p in found
    ]
    assert_holds(pieces, pixel, seen)


@pytest.mark.parametrize("name", ["cosine_sphere", "equidistant 270"])
def test_jax_finds_the_same_pieces(name):
    corners = split(families(50, 13)["everywhere"])
    with jax.enable_x64(True):
        found = radial_bound_triangles(CAMERAS[name], *(jnp.asarray(corner) for corner in corners))
    for piece, same in zip(found, radial_bound_triangles(CAMERAS[name], *corners), strict=True):
        assert np.array_equal(piece.valid, same.valid)
        for line, line_of_numpy in zip(piece.lines, same.lines, strict=True):
            assert np.allclose(np.asarray(line)[:, same.valid], line_of_numpy[:, same.valid], atol=1e-6)


@settings(max_examples=200, deadline=None)
@given(
    st.sampled_from(list(CAMERAS)),
    st.lists(st.floats(-1, 1, width=32), min_size=9, max_size=9),
    st.sampled_from([1.0, 1e-3, 1e-6]),
    st.integers(0, 2),
    st.floats(-6, 3),
)
def test_pieces_hold_adversarial_triangles(name, numbers, flatness, copies, exponent):
    """Needles, repeated corners, corners at the eye, on the axis, on the horizon and on the rim."""
    camera = CAMERAS[name]
    corners = np.array(numbers).reshape(1, 3, 3) * [1, 1, flatness] * 10.0**exponent
    if copies:
        corners[:, copies] = corners[:, 0]
    pixel, seen = seen_points(camera, corners)
    # The slope of a user's function is found numerically, to ten digits or so.
    slack = 1e-6 if name == "user, convex" else 0.0
    assert_holds(radial_bound_triangles(camera, *split(corners)), pixel, seen, slack)


def at(theta, phi):
    """A direction, from degrees."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def edges(camera, corners, steps=2001):
    """Pixels (3, steps, 2) along the edges of one triangle."""
    s = np.linspace(0, 1, steps)[:, None]
    points = np.stack([corners[i] * (1 - s) + corners[(i + 1) % 3] * s for i in range(3)])
    image = camera.local_project(np.moveaxis(points, -1, 0))[0]
    return np.moveaxis(image.pixel, 0, -1), image.valid


IN_VIEW = {
    "off the axis": [at(20, 0), at(60, 10), at(50, 60)],
    "around the axis": [at(30, 0), at(40, 130), at(25, 240)],
    "near the horizon": [at(80, 0), at(85, 25), at(60, 20)],
    "wide": [at(70, 0), at(60, 100), at(80, 220)],
    "small": [at(40, 30), at(40.5, 30), at(40.2, 30.6)],
}


@pytest.mark.parametrize("kind", list(IN_VIEW))
@pytest.mark.parametrize("name", PROFILES)
def test_a_triangle_in_view_gives_one_piece_that_touches_its_edges(name, kind):
    camera, corners = CAMERAS[name], np.array(IN_VIEW[kind])
    for order in ([0, 1, 2], [2, 1, 0]):
        pieces = radial_bound_triangles(camera, *split(corners[None, order]))
        assert count(pieces) == 1
        pixel, seen = edges(camera, corners)
        assert seen.all()
        for line in pieces[0].lines:
            a, b, c = (float(n[0]) for n in line)
            assert abs(a * a + b * b - 1) < 1e-12
            assert 0 <= (a * pixel[..., 0] + b * pixel[..., 1] + c).min() < 0.05


@pytest.mark.parametrize("name", PROFILES)
def test_lines_of_most_triangles_in_view_touch_an_edge(name):
    """Parallel to the chord of an edge, and at most a twentieth of a pixel from it."""
    camera = CAMERAS[name]
    corners = triangles(2000, seed=14)
    corners[..., 2] = np.abs(corners[..., 2]) + 1e-3
    pieces = radial_bound_triangles(camera, *split(corners))
    alone = count(pieces) == 1
    assert alone.mean() > 0.9
    gaps = []
    for i in np.flatnonzero(alone)[:500]:
        pixel, _ = edges(camera, corners[i], 401)
        gaps += [(a * pixel[..., 0] + b * pixel[..., 1] + c).min() for a, b, c in (n[:, i] for n in pieces[0].lines)]
    assert np.min(gaps) >= 0
    assert np.mean(np.array(gaps) < 0.05) > 0.97


@pytest.mark.parametrize("name", PROFILES)
def test_chords_the_wrong_way_round_are_cut_in_two(name):
    """A flat triangle above its long edge: the edge bulges beyond the top corner, whose chords turn over."""
    camera = CAMERAS[name]
    corners = np.array([[at(70, -60), at(70, 60), at(52, 0)]])
    a, b, c = (camera.local_project(p)[0].pixel[:, 0] for p in split(corners))
    chords = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
    assert chords * np.linalg.det(corners[0]) < 0
    pieces = radial_bound_triangles(camera, *split(corners))
    assert count(pieces) == 2
    assert chord_pieces(camera, *split(corners))[1].all()
    pixel, seen = seen_points(camera, corners)
    assert_holds(pieces, pixel, seen)


@pytest.mark.parametrize("name", [*PROFILES, "paraboloid 270", "equidistant 270", "equisolid 270"])
@pytest.mark.parametrize("clipped", [1, 2, 3])
def test_corners_out_of_view(name, clipped):
    camera = CAMERAS[name]
    rim = np.degrees(camera.fov / 2)
    thetas = np.where(np.arange(3) < clipped, rim + 12, rim - 20)
    for shift in range(3):
        corners = np.array([[at(theta, phi) for theta, phi in zip(np.roll(thetas, shift), (-9, 8, 15), strict=True)]])
        pieces, sure = chord_pieces(camera, *split(corners))
        assert sure.all()
        assert count(pieces) == 3 - clipped
        pixel, seen = seen_points(camera, corners)
        assert_holds(pieces, pixel, seen)


@pytest.mark.parametrize("name", [*PROFILES, "paraboloid 270", "equidistant 270"])
@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_triangles_around_an_eye_in_their_plane(name, tilt):
    """They have no inside to tell, and are seen all around."""
    corners = np.array([[[0.0, 1, 0], [-1, 1, 0], [0.25, -0.5, 0]]])
    corners[..., 2] = tilt * corners[..., 0]
    for order in ([0, 1, 2], [2, 1, 0]):
        pixel, seen = seen_points(CAMERAS[name], corners[:, order])
        assert_holds(radial_bound_triangles(CAMERAS[name], *split(corners[:, order])), pixel, seen)


def test_a_view_below_180_degrees_may_see_what_no_corner_tells():
    camera = CAMERAS["narrow"]
    corners = np.array([[[-1, -3, 1], [-1, 3, 1], [-9, 0, 1.0]], [[-9, -9, 1], [9, -9, 1], [0, 9, 1]]])
    corners[0] += [1.2, 0, 0]
    pieces = radial_bound_triangles(camera, *split(corners))
    assert (count(pieces) == 1).all()
    assert not chord_pieces(camera, *split(corners))[1].any()
    box = camera.local_bound(*split(corners))
    assert np.array_equal(pieces[0].low, box.low)
    assert np.array_equal(pieces[0].lines[0], [[0, 0], [0, 0], [1, 1]])


def test_profiles_that_bulge_inwards_have_boxes_only():
    camera = CAMERAS["user, not convex"]
    corners = triangles(50, seed=15)
    pieces, box = radial_bound_triangles(camera, *split(corners)), camera.local_bound(*split(corners))
    assert np.array_equal(pieces[0].high, box.high)
    assert np.array_equal(count(pieces), box.valid.astype(int))
    assert (pieces[0].lines[2][2] == 1).all()


@pytest.mark.parametrize("name", list(CAMERAS))
def test_nothing_seen_and_bad_corners_have_no_piece(name):
    corners = np.array([[[1.0, 0, 1], [0, 1, 1], [1, 1, 1]]] * 3)
    corners[0, 1, 2], corners[1, 0, 0], corners[2] = np.nan, np.inf, -corners[2] + [1, 1, -99]
    pieces = radial_bound_triangles(CAMERAS[name], *split(corners))
    assert (count(pieces)[:2] == 0).all()
    assert (count(pieces)[2] == 0) == (CAMERAS[name].fov < 1.9 * np.pi)
    assert all(np.isfinite(line).all() for piece in pieces for line in piece.lines)


@pytest.mark.parametrize("name", PROFILES)
def test_pieces_are_smaller_than_boxes(name):
    """Counted in pixels, for triangles of some size in view: the box takes at least half as many again."""
    camera = CAMERAS[name]
    corners = families(300, 16)["around the axis"]
    corners[..., 2] = np.abs(corners[..., 2])
    u, v = np.meshgrid(np.arange(0, SIZE, 4) + 0.5, np.arange(0, SIZE, 4) + 0.5)
    u, v = (np.broadcast_to(n.ravel(), (300, n.size)) for n in (u, v))
    pieces, box = radial_bound_triangles(camera, *split(corners)), camera.local_bound(*split(corners))
    nothing = np.zeros((3, 300)) + [[0], [0], [1]]
    boxed = depth(Outline(box.low, box.high, box.valid, (nothing,) * 3), u, v) >= 0
    held = sum((depth(piece, u, v) >= 0).sum() for piece in pieces)
    assert held * 1.5 < boxed.sum()
