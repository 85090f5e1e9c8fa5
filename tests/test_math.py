"""The shared arithmetic: the same numbers from NumPy, JAX and Dr.Jit, and gradients through roots."""

import drjit.llvm as types
import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

from mpcam import math as m
from mpcam.backend import aligned

X = np.linspace(-0.9, 0.9, 19)


@pytest.mark.parametrize("name", ["sin", "cos", "tan", "asin", "acos", "atan", "absolute"])
def test_elementwise_functions_agree_with_fifty_digits(name):
    function = getattr(m, name)
    exact = np.array([float(getattr(mpmath, {"absolute": "fabs"}.get(name, name))(mpmath.mpf(float(x)))) for x in X])
    assert np.abs(function(X) - exact).max() < 1e-15
    assert np.abs(np.asarray(function(jnp.asarray(X, jnp.float32))) - exact).max() < 1e-6
    assert np.abs(function(types.Float(aligned(X))).numpy() - exact).max() < 1e-6


def test_vectors_agree_across_libraries():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 3, 50))
    expected = np.cross(a.T, b.T).T
    assert np.allclose(m.cross(a, b), expected, atol=1e-15)
    assert np.allclose(m.cross(jnp.asarray(a), jnp.asarray(b)), expected, atol=1e-5)
    device = m.cross(types.Array3f(*map(aligned, a)), types.Array3f(*map(aligned, b)))
    assert isinstance(device, types.Array3f)
    assert np.allclose(device.numpy(), expected, atol=1e-5)
    assert isinstance(m.vector(types.Float64(1.0), 2.0), types.Array2f64)


@pytest.mark.parametrize("scale", [1e-30, 1e-8, 1.0, 1e8, 1e30])
def test_normalize_at_every_scale_in_float32(scale):
    v = types.Array3f(3 * scale, 4 * scale, 0.0)
    assert np.allclose(m.normalize(v).numpy().ravel(), [0.6, 0.8, 0], atol=1e-6)


def test_zero_vector_stays_zero_with_finite_gradient():
    assert np.array_equal(m.normalize(np.zeros(3)), np.zeros(3))
    gradient = jax.grad(lambda v: m.normalize(v)[0] + m.norm(v))(jnp.zeros(3))
    assert np.isfinite(gradient).all()


def test_inverse_of_an_increasing_function():
    def cubic(x):
        return x**3 + 0.01 * x

    def slope(x):
        return 3 * x**2 + 0.01

    x = np.linspace(0, 2, 41)
    found = m.invert_increasing(cubic, slope, cubic(x), 0.0, 2.0)
    assert np.abs(found - x).max() < 1e-14
    assert np.allclose(m.invert_increasing(cubic, slope, np.array([-1.0, 99.0]), 0.0, 2.0), [0, 2])
    device = m.invert_increasing(cubic, slope, types.Float(aligned(cubic(x))), 0.0, 2.0)
    assert np.abs(device.numpy() - x).max() < 2e-6


def test_inverse_is_differentiated_by_the_implicit_function_theorem():
    def root(value):
        return m.invert_increasing(lambda x: x**3, lambda x: 3 * x**2, value, 0.0, 3.0)

    with jax.enable_x64(True):
        gradient = jax.grad(root)(jnp.asarray(8.0))
    assert abs(float(gradient) - 1 / 12) < 1e-12


def test_root_of_a_function_that_newton_alone_would_miss():
    steep = m.central_slope(lambda x: m.atan(50 * (x - 0.9)), 0.0, 1.0)
    value = np.arctan(50 * (np.linspace(0, 1, 21) - 0.9))
    found = m.invert_increasing(lambda x: m.atan(50 * (x - 0.9)), steep, value, 0.0, 1.0)
    assert np.abs(found - np.linspace(0, 1, 21)).max() < 1e-9


@pytest.mark.parametrize("power", [2, 5, 9])
def test_inverse_is_exact_where_newton_creeps_and_does_not_leave_the_root_again(power):
    """x + 50 x^power over eight decades: Newton's steps shrink slowly at first, and not at all in the last place."""
    x = np.pi * 10 ** np.linspace(-8, 0, 4001)
    value = x + 50 * x**power
    found = m.invert_increasing(
        lambda x: x + 50 * x**power, lambda x: 1 + 50 * power * x ** (power - 1), value, 0.0, float(np.pi)
    )
    assert (np.abs(found - x) < 1e-14 * x).all()


def test_sign_changes_of_a_polynomial():
    """Also of roots that nearly coincide, and of none where a minimum stays above zero."""
    found = m.sign_changes(list(np.polynomial.polynomial.polyfromroots([0.5, 1.0, 1.0 + 1e-6, 3.0])), 0.0, 2.0)
    assert np.allclose(found, [0.5, 1, 1 + 1e-6], atol=1e-9)
    assert m.sign_changes([1.0 + 1e-9, -2.0, 1.0], 0.0, 2.0) == []
    assert m.sign_changes([2.0], 0.0, 2.0) == []
    assert m.polynomial([1.0, 2.0, 3.0], 2.0) == 17


def test_guarded_root_has_no_infinite_derivative():
    x = np.array([-1.0, 0.0, 4.0])
    assert m.safe_sqrt(x).tolist() == [0, 0, 2]
    assert jax.vmap(jax.grad(m.safe_sqrt))(jnp.asarray(x)).tolist() == [0, 0, 0.25]
    assert isinstance(m.where(x[0] < 0, 1.0, 2.0), float)
