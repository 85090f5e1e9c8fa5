"""Rays between the vertices of camera triangles: general linear in their planes, and lengths shared around vertices."""

import warnings

import numpy as np
import pytest

import mpcam as mp
from mpcam.cameras.nearly_linear import near_image, nearest_image
from mpcam.decomposition.decompose import decompose, directions_at_vertices, in_own_planes
from mpcam.decomposition.shared_lengths import shared_lengths, slants, spread, with_shared_lengths

EYE = (3.0, 1.0, 2.5)
SHAPES = {"sphere": mp.Surface.sphere(1.0), "wave": mp.Surface.wave()}


@pytest.fixture(scope="module")
def direct():
    return {name: directions_at_vertices(decompose(shape, EYE, 416)) for name, shape in SHAPES.items()}


def regular(cams):
    """Triangles that no ray grazes."""
    return np.abs(slants(cams)).min(axis=0) > 0.25


def edge_rays(cams, count=5):
    """Rays along each inner edge, as either of its triangles has them: origins and directions (E, 2, count, 3)."""
    known, pairs = {}, []
    for face, corners in enumerate(cams.faces.tolist()):
        for i in range(3):
            ends = tuple(sorted((corners[i], corners[(i + 1) % 3])))
            if ends in known:
                pairs.append((known[ends], face, ends))
            known[ends] = face
    part = np.linspace(0, 1, count)
    found = []
    for first, second, ends in pairs:
        both = []
        for face in (first, second):
            weights = np.zeros((count, 3))
            for end, value in zip(ends, (1 - part, part), strict=True):
                weights[:, cams.faces[face].tolist().index(end)] = value
            origin, along, _ = cams.ray_at(np.full(count, face), weights[:, 1], weights[:, 2])
            both.append((origin.T, (along / np.linalg.norm(along, axis=0)).T))
        found.append(both)
    return np.moveaxis(np.array(found), 2, 0)


@pytest.mark.parametrize("name", list(SHAPES))
def test_shared_lengths_make_triangles_nearly_general_linear_without_seams(direct, name):
    unit, shared = direct[name], with_shared_lengths(direct[name])
    kept = regular(unit)
    assert kept.mean() > 0.4
    assert np.median(spread(unit)[kept]) > 0.1
    assert np.median(spread(shared)[kept]) < (0.015 if name == "sphere" else 0.035)
    origin, along = edge_rays(shared)
    assert len(origin) > 200
    assert np.abs(along[:, 0] - along[:, 1]).max() < 1e-12 and np.abs(origin[:, 0] - origin[:, 1]).max() < 1e-12
    lengths = shared_lengths(unit)
    assert np.isclose(np.log(lengths).mean(), 0) and lengths.min() > 0


def test_lengths_are_the_least_squares():
    """Another way to them: the dense problem, all corners of all triangles at once."""
    cams = directions_at_vertices(decompose(SHAPES["wave"], EYE, 60))
    slant, lengths = slants(cams), np.log(shared_lengths(cams))
    kept = np.flatnonzero(((slant > 0.25).all(axis=0)) | ((slant < -0.25).all(axis=0)))
    rows, right = [], []
    for face in kept:
        for i in range(3):
            row = np.zeros(len(cams.vertices))
            row[cams.faces[face, i]] += 1.0
            row[cams.faces[face]] -= 1.0 / 3.0
            rows.append(row)
            right.append(np.log(np.abs(slant[:, face])).mean() - np.log(np.abs(slant[i, face])))
    rows, right = np.array(rows), np.array(right)
    best = np.linalg.lstsq(rows, right, rcond=None)[0]
    assert np.linalg.norm(rows @ lengths - right) <= np.linalg.norm(rows @ best - right) * (1 + 1e-6)


@pytest.mark.parametrize(("name", "share"), [("sphere", 0.999), ("wave", 0.93)])
def test_two_steps_from_the_closed_form_end_at_the_image(direct, name, share):
    cams = with_shared_lengths(direct[name])
    faces = np.flatnonzero(regular(cams))
    rng = np.random.default_rng(0)
    face = rng.choice(faces, 4000)
    weights = rng.dirichlet([1, 1, 1], 4000)
    distance = rng.uniform(0.2, 6.0, 4000)
    places, rays = (tuple(cams.node(i)[k][:, face] for i in range(3)) for k in range(2))
    origin = sum(w * p for w, p in zip(weights.T, places, strict=True))
    along = sum(w * r for w, r in zip(weights.T, rays, strict=True))
    point = origin + distance * along
    found = near_image(places, rays, point)
    good = found.residual < 1e-6
    assert good.mean() > share, good.mean()
    near = np.abs(found.second - weights[:, 1]) + np.abs(found.third - weights[:, 2])
    assert np.quantile(near[good], 0.99) < 1e-4
    more = near_image(places, rays, point, steps=5)
    assert (more.residual < 1e-12).mean() > share - 0.02
    start = near_image(places, rays, point, steps=0)
    assert np.median(start.residual) > 10 * np.median(found.residual)


@pytest.fixture(scope="module")
def fitted():
    return {name: decompose(shape, EYE, 416, mode="continuous") for name, shape in SHAPES.items()}


@pytest.mark.parametrize(("name", "rays", "limit"), [("sphere", 0.95, 0.045), ("wave", 0.78, 0.032)])
def test_fitted_rays_are_nearly_general_linear_without_paying_in_rays(direct, fitted, name, rays, limit):
    unit, cams = direct[name], fitted[name]
    assert (cams.faces == unit.faces).all() and (cams.vertices == unit.vertices).all()
    errors = [mp.ray_error(one, SHAPES[name], EYE) for one in (unit, with_shared_lengths(unit), cams)]
    assert errors[2].rms < rays * errors[0].rms < 0.7 * errors[1].rms
    assert errors[2].missed == 0
    kept = regular(unit)
    assert np.median(spread(cams)[kept]) < limit < 0.2 * np.median(spread(unit)[kept])
    origin, along = edge_rays(cams)
    assert np.abs(along[:, 0] - along[:, 1]).max() < 1e-12 and np.abs(origin[:, 0] - origin[:, 1]).max() < 1e-12


def test_the_steps_of_the_fit_are_those_of_its_sum(direct):
    """The normal equations' right side is half the gradient of the sum of squares, by differences."""
    from mpcam.decomposition.continuous import _Fit, _samples
    from mpcam.decomposition.reflector import reflector_of
    from mpcam.decomposition.views import seen_samples

    shape = SHAPES["wave"]
    cams = decompose(shape, EYE, 60)
    unit, whole = directions_at_vertices(cams), reflector_of(shape)
    samples = _samples(cams, unit.directions, seen_samples(whole, EYE, 2000), whole.radius)
    start = with_shared_lengths(unit)
    fit = _Fit(start, regular(unit), samples)
    rng = np.random.default_rng(0)
    rays = start.directions * rng.uniform(0.95, 1.05, (len(start.directions), 1))
    _, right = fit.equations(rays, 3.0)
    for _ in range(3):
        way = rng.normal(size=rays.shape)
        slope = (fit.cost(rays + 1e-6 * way, 3.0) - fit.cost(rays - 1e-6 * way, 3.0)) / 2e-6
        # Means are held while a triangle's parts are weighed, which is off by the square of the spread.
        assert 2 * right @ way.ravel() == pytest.approx(slope, rel=0.05, abs=0.01 * np.linalg.norm(right))


@pytest.mark.parametrize("name", list(SHAPES))
def test_every_point_has_its_image_by_the_steps_or_by_the_cubic(fitted, name):
    cams = fitted[name]
    rng = np.random.default_rng(1)
    face, weights, distance = (
        rng.integers(cams.count, size=3000),
        rng.dirichlet([1, 1, 1], 3000),
        rng.uniform(0.1, 9, 3000),
    )
    places, rays = (tuple(cams.node(i)[k][:, face] for i in range(3)) for k in range(2))
    point = sum(w * (p + distance * r) for w, p, r in zip(weights.T, places, rays, strict=True))
    two, every = near_image(places, rays, point), nearest_image(places, rays, point)
    assert 0.5 < (two.residual < 1e-6).mean() < 0.99
    assert every.residual.max() < 1e-6
    assert np.minimum(np.minimum(every.second, every.third), 1 - every.second - every.third).min() > -1e-3
    found = [1 - every.second - every.third, every.second, every.third]
    met = sum(w * (p + every.c * r) for w, p, r in zip(found, places, rays, strict=True))
    assert np.linalg.norm(met - point, axis=0).max() < 1e-4
    same = np.abs(every.second - weights[:, 1]) + np.abs(every.third - weights[:, 2]) < 1e-5
    assert same.mean() > 0.9  # of several images it may be another


def test_flat_mirrors_keep_their_rays():
    mirror = mp.Surface.paraboloid(1.0, 0.0)
    cams = decompose(mirror, EYE, 30, mode="continuous")
    assert np.isfinite(cams.directions).all() and cams.ray_scale == "near_far"
    assert mp.ray_error(cams, mirror, EYE).missed == 0


def test_in_their_own_planes_the_closed_form_is_exact(direct):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cams = in_own_planes(direct["wave"])
    assert cams.linear and np.isclose(slants(cams) > 0, slants(cams)[:1] > 0).all()
    places, rays = (tuple(cams.node(i)[k] for i in range(3)) for k in range(2))
    point = sum(places) / 3 + 2.0 * sum(rays) / 3
    assert near_image(places, rays, point, steps=0).residual.max() < 1e-12


def test_grazing_triangles_are_left_out_and_said(direct):
    with pytest.warns(UserWarning, match="camera triangles are left out"):
        cams = decompose(SHAPES["sphere"], EYE, 416, mode="general_linear")
    slant = slants(direct["sphere"])
    kept = (slant > 1e-6).all(axis=0) | (slant < -1e-6).all(axis=0)
    assert 0.5 < kept.mean() < 1 and cams.count == kept.sum()
    assert (cams.faces == direct["sphere"].faces[kept]).all()
    assert cams.pieces is not None and cams.pieces.count == cams.count
    assert mp.CameraTriangles.__name__ in repr(type(cams))


def test_modes_of_a_mirror():
    quad = mp.builtin_mesh("quad_room")
    scene = mp.Scene((quad,), camera=mp.Pinhole(40, 40, camera_from_world=mp.look_at((0, -2.5, 1.2), (0, 0, 1))))
    pictures = {}
    for mode in ("normals", "directions", "continuous", "general_linear"):
        mirror = mp.Mirror(mp.Surface.sphere(0.7, (0, 0, 1)), triangles=400, resolution=8, mode=mode)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pictures[mode] = mp.Reflection(scene, mirror=mirror).image()
    for mode in ("directions", "continuous"):
        assert 0 < np.abs(pictures[mode] - pictures["normals"]).mean() < 0.03
    assert 0 < np.abs(pictures["general_linear"] - pictures["normals"]).mean() < 0.1
    with pytest.raises(mp.InputError, match="mode"):
        mp.Reflection(scene, mirror=mp.Mirror(mp.Surface.sphere(0.7, (0, 0, 1)), mode="rays")).image()


def test_camera_triangles_with_normals_have_no_lengths():
    with pytest.raises(mp.InputError, match="directions"):
        shared_lengths(decompose(SHAPES["sphere"], EYE, 26))
