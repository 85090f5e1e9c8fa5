"""The camera with three rays: cubic, images, derivatives and the quartic of the paper, against 50 digits."""

from fractions import Fraction

import drjit as dr
import drjit.llvm.ad as types
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mpcam.cameras import three_rays_quartic as hou
from mpcam.cameras.three_rays import inside, project
from mpcam.errors import InputError
from mpcam.math import polynomial
from mpcam.math.cubic import cubic_roots, determinant_cubic
from mpcam.stress import camera_triangles as stress
from mpcam.stress.three_ray_inputs import prescribed
from mpcam.stress.three_ray_truth import determinant

EPS = {"float64": 2.0**-52, "float32": 2.0**-23}
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def inputs(kind, count, seed=1) -> list[np.ndarray]:
    """v, d (3, 3, count) and q (3, count)."""
    return [np.moveaxis(x, 0, -1) for x in stress.KINDS[kind](np.random.default_rng(seed), count)]


def table(images):
    return np.array([[np.asarray(x, np.float64) for x in image] for image in images])


def on_device(v, d, q):
    v, d, q = [x.astype(np.float32) for x in (v, d, q)]
    return [types.Array3f(*x) for x in v], [types.Array3f(*x) for x in d], types.Array3f(*q)


@pytest.mark.parametrize("precision", EPS)
def test_roots_of_random_cubics(precision):
    rng = np.random.default_rng(2)
    roots = np.sort(rng.uniform(-1, 1, (3, 2000)), axis=0) * 10 ** rng.uniform(-3, 3, 2000)
    r0, r1, r2 = roots
    k = [x.astype(precision) for x in (-r0 * r1 * r2, r0 * r1 + r0 * r2 + r1 * r2, -r0 - r1 - r2, np.ones(2000))]
    k0, k1, k2, k3 = k
    libraries = [cubic_roots(k0, k1, k2, k3, -1e4, 1e4)]
    if precision == "float32":
        libraries.append(jax.jit(cubic_roots)(*[jnp.asarray(x) for x in k], -1e4, 1e4))
        k0, k1, k2, k3 = [types.Float(x) for x in k]
        libraries.append(cubic_roots(k0, k1, k2, k3, -1e4, 1e4))
    apart = np.diff(roots, axis=0).min(axis=0) > 0.05 * np.abs(roots).max(axis=0)
    for found in libraries:
        x = np.array([root for root, _ in found], np.float64)
        exists = np.array([there for _, there in found])
        size = sum(np.abs(k[i].astype(np.float64) * x**i) for i in range(4))
        left = np.abs(polynomial([c.astype(np.float64) for c in k], x))
        assert (left <= 4 * EPS[precision] * size)[exists].all()
        assert exists[:, apart].all()
        assert (x[exists & (np.abs(x) > 0)] != 0).all()


@pytest.mark.parametrize("leading", [1.0, 1e-30, 0.0])
def test_lower_degrees_double_roots_and_ends_of_the_interval(leading):
    def found(k0, k1, k2, k3, low=-10.0, high=10.0):
        return [float(root) for root, exists in cubic_roots(k0, k1, k2, k3, low, high) if exists]

    assert np.allclose(found(-6.0, 11.0, -6.0, 1.0), [1, 2, 3])
    assert np.allclose(found(2.0, -3.0, 1.0, 0.0), [1, 2])
    assert np.allclose(found(2.0, -3.0, 1.0, 1e-30), [1, 2])
    assert found(-2.0, 4.0, 0.0 * leading, 0.0) == [0.5]
    assert found(0.0, 1.0, 0.0, leading) == [0]
    assert found(1.0, 0.0, 0.0, 0.0) == []
    assert found(0.0, 0.0, 0.0, 0.0) == []
    assert np.allclose(found(1.0, -2.0, 1.0, 0.0), [1, 1], atol=1e-7)
    assert found(1.0 + 1e-15, -2.0, 1.0, 0.0) == []
    assert found(1.0, 0.0, 1.0, 0.0) == []
    assert found(0.0, 0.0, 0.0, 1.0) == [0]
    assert found(0.0, 1.0, 1.0, 0.0, 0.0, 5.0) == [0]
    assert found(-5.0, 1.0, 0.0, 0.0, 0.0, 5.0) == [5]
    assert found(0.0, -1.0, 1.0, 0.0, 0.5, 0.75) == []


def test_coefficients_keep_what_plain_products_lose():
    """Three vectors that are parallel to eight digits: their determinant has none left in float32."""
    rng = np.random.default_rng(1)
    d = (np.ones(3) + 1e-4 * rng.normal(size=(3, 3))).astype(np.float32)
    a = rng.normal(size=(3, 3)).astype(np.float32)
    columns = [[np.float32(x) for x in row] for row in d], [[np.float32(x) for x in row] for row in a]
    exact = float(determinant(*[[Fraction(float(x)) for x in row] for row in d]))
    assert abs(determinant_cubic(columns[1], columns[0])[0][3] - exact) < 1e-6 * abs(exact)
    traced = jax.jit(lambda a, d: determinant_cubic(list(a), list(d)))(a, d)[0][3]
    assert abs(traced - exact) < 1e-6 * abs(exact)
    held = [[types.Float(float(x)) for x in row] for row in a], [[types.Float(float(x)) for x in row] for row in d]
    assert abs(determinant_cubic(*held)[0][3].numpy()[0] - exact) < 1e-6 * abs(exact)


@pytest.fixture(scope="module")
def cases():
    return stress.run_cases(stress.projection_cases(10, seed=5))


@pytest.mark.parametrize("kind", stress.KINDS)
def test_every_kind_of_camera_in_both_precisions(kind, cases):
    found = [case for case in cases if case.case == f"images, {kind}"]
    assert {case.precision for case in found} == set(EPS)
    for case in found:
        assert case.good(stress.LIMIT), case


def test_jax_is_as_good_and_broadcasts():
    """Points and triangles of shapes (n, 1) and (n,), float32; float64 is below, with the derivatives."""
    n, compiled = 12, jax.jit(project)
    for kind in ("everywhere", "three images", "general linear", "coplanar directions"):
        v, d, q = [x.astype(np.float32) for x in inputs(kind, n, seed=3)]
        images = compiled(jnp.asarray(v), jnp.asarray(d), jnp.asarray(q[:, :, None]))
        assert images[0].w1.shape == (n, n)
        found = table(images)[:, :, np.arange(n), np.arange(n)]
        given = [np.moveaxis(x.astype(float), -1, 0) for x in (v, d, q)]
        case = stress.judged(kind, "float32", given, found, EPS["float32"])
        assert case.good(stress.LIMIT), case


def test_prescribed_images_are_found():
    rng = np.random.default_rng(4)
    w, c = rng.dirichlet((1, 1, 1), (50, 3)), 10 ** rng.uniform(-1, 1, (50, 3))
    v, d, q = [np.moveaxis(x, 0, -1) for x in prescribed(rng, w, c)]
    found = table(project(v, d, q))
    assert (found[:, 3] == 1).all()
    order = np.argsort(c, axis=1)
    expected = np.take_along_axis(np.stack([w[:, :, 0], w[:, :, 1], c]), order[None], 2)
    assert np.allclose(found[:, :3].transpose(1, 2, 0), expected, rtol=1e-4, atol=1e-4)


def test_a_wrong_image_would_be_found():
    v, d, q = [x[0] for x in stress.KINDS["three images"](np.random.default_rng(1), 1)]
    found = table(project(v, d, q))
    assert stress.judge_one(v, d, q, found, 2.0**-52)[1:] == (0, 0)
    off = found + [[0, 0, 1e-6, 0]]
    assert stress.judge_one(v, d, q, off, 2.0**-52)[0] > stress.LIMIT or stress.judge_one(v, d, q, off, 2.0**-52)[1]
    fewer = found * [[1], [0], [1]]
    assert stress.judge_one(v, d, q, fewer, 2.0**-52)[1] == 1
    assert stress.judge_one(v, d, q, found[[0, 1, 1]], 2.0**-52)[1:] == (1, 1)


def test_the_suite_wants_points():
    with pytest.raises(InputError, match="at least 1"):
        stress.run(points=0)


def only(images):
    valid = [image for image in images if image.valid]
    assert len(valid) == 1
    return [float(x) for x in valid[0][:3]]


def test_closed_forms():
    """Parallel rays and a pinhole, where the answer is known; behind the camera; on it; with no way to reach it."""
    up = np.array([[0.0, 0, 2]] * 3)
    assert np.allclose(only(project(CORNERS, up, np.array([0.2, 0.3, 3.0]))), [0.5, 0.2, 1.5])
    assert np.allclose(only(project(CORNERS, up * [[1], [2], [4]], np.array([0.2, 0.3, 3.0]))), [0.5, 0.2, 3 / 4.2])
    center = np.array([0.25, 0.25, -1.0])
    seen = np.array([0.3, 0.2, 0.0]) * 3 - 2 * center
    assert np.allclose(only(project(CORNERS, CORNERS - center, seen)), [0.5, 0.3, 2])
    assert not any(image.valid for image in project(CORNERS, up, np.array([0.2, 0.3, -3.0])))
    assert not any(image.valid for image in project(CORNERS, up, np.array([0.9, 0.3, 1.0])))
    assert np.allclose(only(project(CORNERS, up, np.array([0.2, 0.3, 0.0]))), [0.5, 0.2, 0])
    flat = np.array([[1.0, 0, 0], [0, 1, 0], [1, 1, 0]])
    assert not any(image.valid for image in project(CORNERS, flat, np.array([0.2, 0.3, 1.0])))
    assert not any(image.valid for image in project(CORNERS, flat, np.array([0.2, 0.3, 0.0])))
    assert not any(image.valid for image in project(CORNERS, center - CORNERS, center))


def test_shared_corners_and_edges_belong_to_both():
    """Weights that rounding makes negative: points behind an edge are in one of the two triangles at least."""
    rng = np.random.default_rng(6)
    v, d = rng.normal(size=(2, 4, 3)) + np.array([0, 0, 2])
    t, c = rng.uniform(size=300), 10 ** rng.uniform(-2, 2, 300)
    q = (np.outer(1 - t, v[0]) + np.outer(t, v[1]) + c[:, None] * (np.outer(1 - t, d[0]) + np.outer(t, d[1]))).T
    for third in (2, 3):
        corners, rays = v[[0, 1, third], :, None], d[[0, 1, third], :, None]
        images = table(project(corners, rays, q))
        assert ((images[:, 3] == 1) & (np.abs(images[:, 2] - c) < 1e-6 * c)).any(axis=0).all()
    assert inside(0.5, 0.5)
    assert not inside(0.5, 0.5 + 1e-9)
    assert inside(0.5, 0.5 + 1e-9, 1e-8)


def test_shapes_and_plain_numbers():
    v, d, q = inputs("everywhere", 30)
    pairs = project(v[:, :, :20], d[:, :, :20], q[:, :10, None])
    diagonal = project(v[:, :, :10], d[:, :, :10], q[:, :10])
    for many, few in zip(pairs, diagonal, strict=True):
        assert many.c.shape == (10, 20)
        assert np.array_equal(many.c[np.arange(10), np.arange(10)], few.c)
    numbers = project(v[:, :, 0].tolist(), d[:, :, 0].tolist(), q[:, 0].tolist())
    arrays = project(v[:, :, 0], d[:, :, 0], q[:, 0])
    assert np.array_equal(table(numbers), table(arrays))


def test_no_numbers_give_no_images():
    case = stress.not_finite_row()
    assert case.good(stress.LIMIT), case
    for bad in (np.nan, np.inf, -np.inf, 3e38):
        q = np.array([bad, 0.1, 1.0], np.float32)
        assert not any(x.valid for x in project(CORNERS.astype(np.float32), CORNERS.astype(np.float32) + 1, q))


def test_derivatives_by_the_implicit_function_theorem():
    v, d, q = [np.moveaxis(x, -1, 0) for x in inputs("three images", 8)]

    def values(v, d, q):
        images = jnp.stack([jnp.stack([x.astype(float) for x in image]) for image in project(v, d, q)])
        return images[:, :3], images

    with jax.enable_x64(True):
        given = [jnp.asarray(x) for x in (v, d, q)]
        slopes, found = jax.jit(jax.vmap(jax.jacrev(values, argnums=(0, 1, 2), has_aux=True)))(*given)
    case = stress.judged("three images", "float64", (v, d, q), np.moveaxis(np.asarray(found), 0, -1), EPS["float64"])
    assert case.good(stress.LIMIT), case
    for which, slope in enumerate(slopes):
        for index in np.ndindex(*(v, d, q)[which].shape[1:]):
            ends = []
            for step in (1e-6, -1e-6):
                moved = [x.copy() for x in (v, d, q)]
                moved[which][(slice(None), *index)] += step
                ends.append(table(project(*[np.moveaxis(x, 0, -1) for x in moved]))[:, :3])
            expected = np.moveaxis(ends[0] - ends[1], -1, 0) / 2e-6
            given = np.asarray(slope)[(slice(None), slice(None), slice(None), *index)]
            # Where images are far from folds, finite differences of this length are good to some digits.
            assert np.median(np.abs(given - expected) / (1 + np.abs(expected))) < 1e-6
            assert np.percentile(np.abs(given - expected) / (1 + np.abs(expected)), 75) < 1e-3


def test_derivatives_on_the_device_and_where_there_are_none():
    sets = [inputs("everywhere", 40), inputs("collapsed on the point", 12)]
    v, d, q = [np.concatenate(parts, axis=-1) for parts in zip(*sets, strict=True)]
    corners, rays, point = on_device(v, d, q)
    for array in (*corners, *rays, point):
        dr.enable_grad(array)
    image = project(corners, rays, point)
    dr.backward(image[0].c + image[0].w1 + image[1].c + image[2].w2)
    gradients = [array.grad.numpy() for array in (point, *corners, *rays)]
    assert all(np.isfinite(x).all() for x in gradients)
    assert all((x[:, 40:] == 0).all() for x in gradients)
    step = 1e-6
    ends = [project(v, d, q + s * np.array([[1.0], [0], [0]])) for s in (step, -step)]
    same = np.all([x.valid == y.valid for x, y in zip(*ends, strict=True)], axis=0)
    slope = np.subtract(*[a.c + a.w1 + b.c + c.w2 for a, b, c in ends]) / (2 * step)
    assert np.median((np.abs(gradients[0][0] - slope) / (1 + np.abs(slope)))[same][:30]) < 1e-4


def test_the_quartic_gives_the_same_images():
    v, d, q = inputs("everywhere", 500)
    ours, theirs = table(project(v, d, q)), table(hou.project_quartic(v, d, q))
    ours = np.take_along_axis(ours, np.argsort(-ours[:, 3:], axis=0, kind="stable"), 0)  # as theirs, valid ones first
    same = (ours[:, 3] == theirs[:, 3]).all(axis=0)
    assert same.mean() > 0.99
    assert np.median(np.abs(ours - theirs)[:, :, same]) < 1e-14
    assert np.percentile(np.abs(ours - theirs)[:, 2, same], 98) < 1e-8


def test_one_root_of_the_quartic_is_no_image():
    v, d, q = inputs("everywhere", 200)
    spurious, k = hou.spurious_root(v, d, q), hou.quartic_coefficients(v, d, q)
    left = sum(k[4 - i] * spurious**i for i in range(5))
    size = sum(np.abs(k[4 - i] * spurious**i) for i in range(5))
    assert (np.abs(left) < 1e-9 * size).all()
    roots = hou.quartic_roots(*k)
    real = (np.abs(np.imag(roots)) < 1e-9 * np.abs(roots)).sum(axis=-1)
    assert set(real) == {2, 4}
