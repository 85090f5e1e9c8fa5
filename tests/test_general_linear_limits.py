"""General linear cameras: tight boxes around slits, margins against a constrained search, defaults of makers."""

import numpy as np
import pytest
from test_general_linear import jordan

import mpcam as mp

GL = mp.GeneralLinear


def test_the_axis_of_an_epipolar_plane_image_is_its_middle():
    ray = GL.epi(64, 20, 0.1).ray(np.array([32.0, 10.0]))
    assert np.allclose(ray.origin, 0) and np.allclose(ray.direction, [0, 0, 1])


def test_default_scale_fills_the_shorter_side():
    for make in (GL.orthographic, lambda w, h: GL.twisted_orthographic(w, h, 0.1)):
        for width, height in ((64, 20), (20, 64)):
            rays = make(width, height).ray(np.array([[0.0, 0.0], [float(width), float(height)]]))
            reach = np.abs(rays.origin[1] - rays.origin[0])[:2] / (width, height)
            assert np.allclose(reach, 2.0 / 20)


@pytest.mark.parametrize("zone", [(0.05, 1.9), (2.1, 3.9), (4.1, 30.0)])
def test_boxes_of_small_triangles_are_tight_before_between_and_behind_slits(zone):
    """Between slits the determinant has the other sign."""
    camera = GL([[0.25, -0.5, 0, 0], [-0.25, -0.5, 1, 0], [0.25, -0.75, 0, 1]], 64, 64)
    assert np.allclose(camera.domain.slit_depths, (2, 4))
    rng = np.random.default_rng(1)
    pixels, depth = rng.uniform(5, 59, (200, 2)), rng.uniform(*zone, 200)
    ray = camera.ray(pixels)
    middle = ray.origin + ray.direction * (depth / ray.direction[:, 2])[:, None]
    triangles = middle[:, None] + 1e-3 * rng.normal(size=(200, 3, 3))
    box, weights = camera.bound(triangles), rng.dirichlet([0.5, 0.5, 0.5], 300)
    found = camera.project(np.einsum("wk,nkc->nwc", weights, triangles)).pixel[:, :, 0]
    low, high = found.min(1), found.max(1)
    size = (high - low).max(1, keepdims=True)
    near = (np.abs(depth - 2) > 0.05) & (np.abs(depth - 4) > 0.05)
    assert box.valid.all() and near.mean() > 0.8
    assert (box.low <= low + 1e-9)[near].all() and (box.high >= high - 1e-9)[near].all()
    assert ((low - box.low) < 0.7 * size + 1e-6)[near].all() and ((box.high - high) < 0.7 * size + 1e-6)[near].all()


@pytest.mark.parametrize("kind", ["cross_slit", "bilinear"])
def test_margin_to_a_double_slit_is_the_least_change(kind):
    """Another way to it: the nearest generators with B^2 = 4 A C, by a constrained search."""
    from scipy.optimize import minimize

    def discriminant(x):
        (a, b, c, d), (e, f, g, h) = x[:4], x[4:]  # U and S by rows
        return (a * h + e * d - b * g - f * c) ** 2 - 4.0 * (e * h - f * g) * (a * d - b * c)

    rng, checked = np.random.default_rng(7), 0
    for _ in range(40):
        turn = rng.normal(size=(2, 2))
        matrix = turn @ (jordan("pencil", rng) + 0.05 * rng.normal(size=(2, 2))) @ np.linalg.inv(turn)
        places = np.array([[0, 0], [1, 0], [0, 1]]) + 0.2 * rng.normal(size=(3, 2))
        camera = GL(np.concatenate([places @ matrix.T, places], axis=1), 8, 8)
        if camera.kind != kind or camera.nearest_kind != "pencil":
            continue
        U, S = (places[1:] - places[0]).T, ((places[1:] - places[0]) @ matrix.T).T
        start = np.concatenate([(U / np.linalg.norm(U)).ravel(), (S / np.linalg.norm(S)).ravel()])
        found = [
            minimize(
                lambda x, start=start: ((x - start) ** 2).sum(),
                start + 0.02 * rng.normal(size=8),
                jac=lambda x, start=start: 2.0 * (x - start),
                constraints={"type": "eq", "fun": discriminant},
                options={"ftol": 1e-14, "maxiter": 200},
            )
            for _ in range(4)
        ]
        least = min(np.sqrt(one.fun) for one in found if one.success)
        assert 0.6 * least < camera.margin < 1.4 * least, (camera.margin, least)
        checked += 1
    assert checked >= 5


def test_parallel_rays_from_a_flat_triangle_are_a_camera():
    """Nothing but rounding makes them none; in float64 that is far below one in two thousand."""
    camera = GL([[0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0.5, 5e-4]], 8, 8)
    assert camera.kind == "orthographic"
    assert GL([[0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0.5, 1e-12]], 8, 8, ((0, 0), (1, 0), (0, 1))).kind == "not a camera"
