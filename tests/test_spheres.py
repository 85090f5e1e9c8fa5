"""Calibrated lenses where their formulas cancel: near xi = -1 and 1, at the rim, straight behind; against 50 digits."""

from typing import Any

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

import mpcam as mp
from mpcam.backend import types
from mpcam.cameras.calibrated import FARTHEST
from mpcam.rendering.device_camera import unposed
from mpcam.stress import suite
from mpcam.stress.exact import DIGITS

EPS = 2.0**-52
NEAR = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 2.0**-53]
"""1 + xi of double spheres, down to the nearest number to -1."""


def double_sphere(front: float, alpha: float) -> mp.DoubleSphere:
    return mp.DoubleSphere(64, 64, 20.0, 21.0, 32.0, 31.0, front - 1, alpha)


def angles(camera, count: int = 25) -> np.ndarray:
    """Across the domain, near its end, and where most of the image is: around 1 + xi."""
    around = (1 + camera.xi) * 10.0 ** np.linspace(-3, 3, count)
    inside = camera.limit * np.concatenate([np.linspace(0.02, 0.98, count), 1 - 10.0 ** np.linspace(-9, -2, count)])
    return np.sort(np.concatenate([around[around < camera.limit], inside]))


def published(camera, theta):
    """r by Usenko 2018, equations 40 to 42, and dr / dtheta by mpmath's differences."""
    xi, alpha = mpmath.mpf(camera.xi), mpmath.mpf(camera.alpha)

    def radius(t):
        side, shifted = mpmath.sin(t), xi + mpmath.cos(t)
        return side / (alpha * mpmath.sqrt(side * side + shifted * shifted) + (1 - alpha) * shifted)

    theta = mpmath.mpf(float(theta))
    return radius(theta), mpmath.diff(radius, theta)


@pytest.mark.parametrize("front", NEAR)
@pytest.mark.parametrize("alpha", [0.0, 0.3, 0.5, 0.6, 1.0])
def test_nothing_is_lost_near_minus_one(front, alpha):
    """Radius, slope and inverse, in units of eps times what one part in the angle or the radius makes of them."""
    camera = double_sphere(front, alpha)
    theta = angles(camera)
    radius, slope, back = camera.radius_at(theta), camera.slope_at(theta), camera.angle_at(camera.radius_at(theta))
    with mpmath.workdps(DIGITS):
        for t, r, s, b in zip(theta, radius, slope, back, strict=True):
            exact, rise = published(camera, t)
            assert abs(r - exact) < 8 * EPS * (exact + t * rise)
            # The inverse is as good as the radius was: what it gives has that radius, at a fold too.
            again, rise_there = published(camera, b)
            assert abs(again - r) < 8 * EPS * (exact + b * abs(rise_there))
            bend = abs(published(camera, t * (1 + 1e-6))[1] - rise) * 10**6
            assert abs(s - rise) < 16 * EPS * (rise + bend)


def test_at_minus_one_the_axis_has_no_image():
    """The image would be a ring: r = cos(theta / 2) / (alpha - (1 - alpha) sin(theta / 2)), 1 / alpha at the axis."""
    with pytest.raises(mp.InputError, match="xi=-1.*above -1"):
        double_sphere(0.0, 0.6)
    camera = double_sphere(2.0**-53, 0.6)
    theta = np.linspace(0.01, 0.99 * camera.limit, 50)
    ring = np.cos(theta / 2) / (0.6 - 0.4 * np.sin(theta / 2))
    assert np.abs(camera.radius_at(theta) / ring - 1).max() < 1e-13


@pytest.mark.parametrize("front", [1e-8, 1e-12])
def test_kernels_see_as_much(front):
    """float32 cannot hold xi, but what the image depends on."""
    camera = double_sphere(front, 0.6)
    pixels = np.random.default_rng(1).uniform(0, 64, (2, 100)).astype(np.float32)
    lens: Any = unposed(camera)
    ray = lens.local_ray(types().Array2f(*pixels))
    exact = camera.local_ray(pixels.astype(np.float64))
    assert (ray.valid.numpy() == exact.valid).all()
    found, truth = ray.direction.numpy()[:, exact.valid], exact.direction[:, exact.valid]
    assert np.abs(found[:2] / truth[:2] - 1).max() < 1e-4


CALIBRATED = ("kannala-brandt", "double-sphere", "unified-omni")
ILL = "nearly folds at the rim"
"""Its fold is as uncertain as the last places of its coefficients make it; the stress suite has it."""


@pytest.mark.parametrize("model", CALIBRATED)
def test_domains_end_where_the_published_formula_does(model):
    """To 1e-12 rad, and as much of the image circle; traced by JAX too."""
    cameras = {name: camera for name, camera in suite(model).cameras().items() if name != ILL}
    traced = jax.jit(lambda camera: camera.angle_limit())
    for name, camera in cameras.items():
        definition = suite(model).definition(camera)
        with mpmath.workdps(DIGITS):
            values = [mpmath.mpf(number.value) for number in definition.numbers]
            limit = definition.largest(*values)
            rim = definition.rim(limit, *values)
        assert abs(camera.domain.max_angle - limit) < 1e-12, name
        if camera.domain.image_radius is None:
            assert abs(rim - FARTHEST) < 1, name
        else:
            assert abs(camera.domain.image_radius / (max(camera.fx, camera.fy) * rim) - 1) < 1e-12, name
        with jax.enable_x64(True):
            assert abs(float(traced(camera)) - limit) < 1e-12, name


@pytest.mark.parametrize("model", ["kannala-brandt", "double-sphere"])
def test_derivatives_are_finite_everywhere(model):
    """On the axis, at the rim, beyond it, straight behind, at the center; and of rays, as far out as pixels go."""
    rng = np.random.default_rng(2)
    with jax.enable_x64(True):

        def seen(camera, point, pixel):
            image, ray = camera.local_project(point)[0], camera.local_ray(pixel)
            return image.pixel.sum() + image.depth.sum() + ray.direction.sum()

        gradient = jax.jit(jax.grad(seen, argnums=(0, 1, 2)))
        for name, camera in suite(model).cameras().items():
            theta = np.concatenate([[0.0, camera.limit, np.pi], rng.uniform(0, np.pi, 20)])
            point = np.stack([np.sin(theta), 0 * theta, np.cos(theta)])
            point[:2, 2] = point[:, 3] = 0
            pixel = rng.uniform(-1, 2, (2, 20)) * camera.width
            pixel[:, 0], pixel[:, 1] = (camera.cx, camera.cy), 1e9
            for leaf in jax.tree_util.tree_leaves(gradient(camera, jnp.asarray(point), jnp.asarray(pixel))):
                assert np.isfinite(np.asarray(leaf)).all(), name


def test_derivatives_near_minus_one_are_right():
    camera = double_sphere(1e-8, 0.3)
    theta = angles(camera)
    with jax.enable_x64(True):
        slopes = jax.vmap(jax.grad(camera.radius_at))(jnp.asarray(theta))
    with mpmath.workdps(DIGITS):
        exact = np.array([float(published(camera, t)[1]) for t in theta])
    assert np.abs(np.asarray(slopes) / exact - 1).max() < 1e-6
