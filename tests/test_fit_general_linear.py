"""The nearest general linear camera: known ones from noisy rays, against the Cramer-Rao bound, and what is none."""

import numpy as np
import pytest

import mpcam as mp

KINDS = {
    "pinhole": mp.GeneralLinear([[0, 0, 0.1, 0.2], [1, 0, 0.1, 0.2], [0, 1, 0.1, 0.2]], 8, 8),
    "orthographic": mp.GeneralLinear([[0.2, 0.1, 0, 0], [0.2, 0.1, 1, 0], [0.2, 0.1, 0, 1]], 8, 8),
    "pushbroom": mp.GeneralLinear([[0, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0]], 8, 8),
    "cross_slit": mp.GeneralLinear([[0, 0, 0, 0], [1, 0, 1, 0], [0, -0.7, 0, 1]], 8, 8),
    "bilinear": mp.GeneralLinear([[0, 0, 0, 0], [0, 0.8, 1, 0], [-0.7, 0, 0, 1]], 8, 8),
}


def rays_of(camera, count, seed=0):
    pixels = np.random.default_rng(seed).uniform(0, 8, (count, 2))
    ray = camera.ray(pixels)
    return np.asarray(ray.origin), np.asarray(ray.direction)


@pytest.mark.parametrize("kind", list(KINDS))
def test_exact_rays_give_their_camera(kind):
    camera = KINDS[kind]
    assert camera.kind == kind
    origins, directions = rays_of(camera, 200)
    slide = np.random.default_rng(1).uniform(-0.3, 2, (200, 1))  # any point of a ray is as good
    found = mp.fit_general_linear(origins + slide * directions, 2.5 * directions, normal=(0, 0, 1))
    assert found.residual < 1e-12 and found.status == "converged"
    # Its kind is a matter of rounding where that is a tie: what is nearest, within rounding.
    assert found.kind == kind or found.margin < 1e-9
    check_origins, check_ways = rays_of(camera, 50, 5)
    seen = np.asarray(found.camera.project(check_origins + 3 * check_ways).pixel).reshape(50, 2)
    way = np.asarray(found.camera.ray(seen).direction)
    assert np.abs(way - check_ways).max() < 1e-6


def test_noisy_rays_come_near_the_cramer_rao_bound():
    """b = A a + c between the two planes, isotropic noise in both: Fisher information with each a_i unknown."""
    matrix, offset, depth, sigma, count = np.array([[1.8, 0.3], [-0.4, 0.6]]), np.array([0.1, -0.2]), 1.5, 1e-3, 300
    rng = np.random.default_rng(0)
    a = rng.uniform(-1, 1, (count, 2))
    b = a @ matrix.T + offset
    weight = np.linalg.inv(np.eye(2) + matrix @ matrix.T) / sigma**2
    information = np.zeros((6, 6))
    for x, y in a:
        slope = np.array([[x, y, 0, 0, 1, 0], [0, 0, x, y, 0, 1]])
        information += slope.T @ weight @ slope
    bound = np.diag(np.linalg.inv(information))
    errors = []
    for _ in range(150):
        near, far = (p + sigma * rng.normal(size=p.shape) for p in (a, b))
        origins = np.concatenate([near, np.zeros((count, 1))], axis=1)
        directions = np.concatenate([far - near, np.full((count, 1), depth)], axis=1)
        # The plane lies through the middle of the origins, which is z = 0, and so are the bounds' two planes.
        found = mp.fit_general_linear(origins, directions, normal=(0, 0, 1), depth=depth)
        ray = found.camera.ray(np.array([[10.0, 20.0], [50.0, 12.0], [30.0, 55.0]]))
        start, way = np.asarray(ray.origin), np.asarray(ray.direction)
        p = [start + ((z - start[:, 2:]) / way[:, 2:]) * way for z in (0.0, depth)]
        table = np.concatenate([p[0][:, :2], np.ones((3, 1))], axis=1)
        solved = np.linalg.solve(table, p[1][:, :2])
        errors.append(np.concatenate([(solved[:2].T - matrix).ravel(), solved[2] - offset]))
    ratio = np.mean(np.square(errors), axis=0) / bound
    assert np.sqrt(ratio.max()) < 1.3 and np.sqrt(ratio.min()) > 0.75
    assert found.residual == pytest.approx(sigma, rel=0.1)


def test_a_tilt_is_found():
    """Rays of a camera whose planes are tilted against their mean direction, by 0.2."""
    camera = mp.GeneralLinear([[0.2, 0, 0, 0], [0.2, 0.9, 1, 0], [-0.6, 0, 0, 1]], 8, 8)
    origins, directions = rays_of(camera, 400)
    mean = mp.fit_general_linear(origins, directions)
    free = mp.fit_general_linear(origins, directions, normal="free")
    assert mean.residual > 1e-3 and free.status == "converged"
    assert free.residual < 1e-6
    exact = mp.fit_general_linear(origins, directions, normal=(0, 0, 1))
    assert exact.residual < 1e-12


def test_rays_that_a_curved_mirror_sends():
    """A small patch is nearly general linear, and the error falls with the square of its size."""
    surface, eye = mp.Surface.ellipsoid((1, 0.7, 0.5)), np.array([3.0, 1.0, 2.0])
    residuals = []
    for size in (0.05, 0.025):
        u, v = np.meshgrid(0.1 + np.linspace(-size, size, 15), 0.7 + np.linspace(-size, size, 15))
        points, normals = surface.point(u.ravel() % 1, v.ravel()), surface.normal(u.ravel() % 1, v.ravel())
        way = points - eye
        way = way - 2 * (way * normals).sum(1, keepdims=True) * normals
        found = mp.fit_general_linear(points, way, depth=1.0)
        assert found.status == "converged" and found.kind != "not a camera"
        residuals.append(found.residual)
    assert 3 < residuals[0] / residuals[1] < 6


def test_what_is_no_camera_says_so():
    rng = np.random.default_rng(0)
    one = mp.fit_general_linear(np.zeros((5, 3)), np.ones((5, 3)))
    row = mp.fit_general_linear(np.stack([np.arange(6.0), np.zeros(6), np.zeros(6)], 1), np.tile([0, 0, 1.0], (6, 1)))
    two = mp.fit_general_linear([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 0.1, 1]])
    opposite = mp.fit_general_linear(rng.normal(size=(4, 3)), [[0, 0, 1], [0, 0, -1], [0, 0, 1], [0, 0, -1]])
    for found in (one, row, two, opposite):
        assert np.isfinite([found.residual, found.worst, found.margin]).all()
        assert np.isfinite(found.camera.rays).all()
    assert {one.status, row.status, two.status} == {"rank_deficient"}
    far = mp.fit_general_linear(
        1e8 + rng.normal(size=(50, 3)), rng.normal(size=(50, 3)) * 0.01 + [0, 0, 1], normal="free"
    )
    assert np.isfinite(far.residual)
    with pytest.raises(mp.InputError, match="zero"):
        mp.fit_general_linear(np.zeros((3, 3)), [[0, 0, 1], [0, 0, 0], [0, 1, 0]])
    with pytest.raises(mp.InputError, match="shape"):
        mp.fit_general_linear(np.zeros((3, 2)), np.zeros((3, 3)))
    with pytest.raises(mp.InputError, match="NaN"):
        mp.fit_general_linear([[np.nan, 0, 0]], [[0, 0, 1]])
    with pytest.raises(mp.InputError, match="depth"):
        mp.fit_general_linear(np.zeros((3, 3)), np.ones((3, 3)), depth=-1)
