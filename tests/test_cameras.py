"""What single camera models promise beyond `kit`: the published formulas, domains, distances, precision."""

import drjit.llvm as types
import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from catalog import NAMES, POSE, cameras, own

import mpcam as mp
from mpcam.backend import aligned
from mpcam.cameras.capabilities import Bends
from mpcam.cameras.serialize import camera_to_json

RNG = np.random.default_rng(7)
PIXELS = RNG.uniform(0, 64, (4000, 2))


@pytest.fixture(params=NAMES)
def camera(request):
    return cameras(64, POSE)[request.param]


def test_center_ray_runs_along_the_axis(camera):
    if not hasattr(camera, "cx") or isinstance(camera, Bends):
        assert isinstance(camera, mp.GeneralLinear | mp.SinglePoleOcclusion)  # which have no axis, or bend it
        return
    center = [camera.cx, camera.cy]
    ray = camera.ray(center)
    assert ray.origin.shape == ray.direction.shape == (3,)
    assert ray.valid
    assert np.allclose(ray.direction, np.asarray(camera.camera_from_world)[2, :3], atol=1e-15)
    assert np.allclose(ray.origin, camera.eye, atol=1e-14)


def test_shapes_follow_the_input(camera):
    assert camera.ray(np.zeros((2, 5, 2))).valid.shape == (2, 5)
    image = camera.project(np.zeros((2, 5, 3)))
    assert image.pixel.shape == (2, 5, 1, 2)
    assert image.depth.shape == image.valid.shape == (2, 5, 1)
    box = camera.bound(np.zeros((4, 3, 3)))
    assert box.low.shape == box.high.shape == (4, 2)
    assert camera.project([[1, 2, 3]]).pixel.shape == (1, 1, 2)


@pytest.mark.parametrize("name", ["paraboloid", "cosine_sphere", "equisolid", "equidistant"])
def test_profiles_agree_with_fifty_digits(name):
    """Gascuel 2008, Table 1: r of theta, and r = 1 on the inscribed circle at 90 degrees."""
    mpmath.mp.dps = 50
    exact = {
        "paraboloid": lambda t: (1 - mpmath.cos(t)) / mpmath.sin(t),
        "cosine_sphere": mpmath.sin,
        "equisolid": lambda t: mpmath.sqrt(1 - mpmath.cos(t)),
        "equidistant": lambda t: 2 * t / mpmath.pi,
    }[name]
    camera = getattr(mp.Radial, name)(512, 512)
    theta = np.linspace(1e-6, np.pi / 2, 101)
    points = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    r = (camera.project(points).pixel[:, 0, 0] - 256) / 256
    expected = np.array([float(exact(mpmath.mpf(float(t)))) for t in theta])
    assert np.abs(r - expected).max() < 1e-14
    assert abs(r[-1] - 1) < 1e-14


@pytest.mark.parametrize("name", NAMES[:8])
def test_angle_at_the_rim(name):
    camera = cameras(64)[name]
    assert isinstance(camera, mp.Radial)
    rim = camera.ray([[camera.cx + camera.radius, camera.cy], [camera.cx + camera.radius + 1e-6, camera.cy]])
    assert rim.valid.tolist() == [True, False]
    angle = np.arccos(np.clip(rim.direction[0, 2], -1, 1))
    assert abs(angle - camera.fov / 2) < 1e-7
    beyond = camera.fov / 2 + 1e-6
    if beyond < np.pi:
        assert not camera.project([np.sin(beyond), 0, np.cos(beyond)]).valid[0]


def _image_jacobian(camera, directions):
    """(N, 2, 2) derivative of the pixel along two orthonormal tangents, by central differences."""
    helper = np.where(np.abs(directions[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(directions, helper)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    second = np.cross(directions, first)
    step = 1e-6
    columns = []
    for tangent in (first, second):
        ahead, behind = (camera.project(directions + sign * step * tangent).pixel[:, 0] for sign in (1, -1))
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, -1)


def _directions(camera):
    ray = camera.ray(RNG.uniform(0, 64, (500, 2)))
    inside = ray.valid & (ray.direction[:, 2] > 0.05)
    return ray.direction[inside]


def test_paraboloid_keeps_angles():
    camera = mp.Radial.paraboloid(64, 64)
    jacobian = _image_jacobian(camera, _directions(camera))
    gram = np.swapaxes(jacobian, 1, 2) @ jacobian
    assert np.abs(gram[:, 0, 1] / gram[:, 0, 0]).max() < 1e-6
    assert np.abs(gram[:, 0, 0] / gram[:, 1, 1] - 1).max() < 1e-6


def test_equisolid_keeps_solid_angle():
    camera = mp.Radial.equisolid(64, 64)
    area = np.abs(np.linalg.det(_image_jacobian(camera, _directions(camera))))
    assert np.abs(area / (0.5 * 32**2 * 1.0) - 1).max() < 1e-6  # dA = (1/2) R^2 dOmega for r = sqrt(1 - cos)


def test_cosine_sphere_keeps_solid_angle_times_cosine():
    camera = mp.Radial.cosine_sphere(64, 64)
    directions = _directions(camera)
    area = np.abs(np.linalg.det(_image_jacobian(camera, directions)))
    assert np.abs(area / (32**2 * directions[:, 2]) - 1).max() < 1e-6


def test_double_precision_on_dr_jit(camera):
    points = camera.ray(PIXELS).direction * 3 + camera.eye
    exact, device = (
        camera.project(points),
        camera.project(types.Array3f64(*(aligned(row, np.float64) for row in points.T))),
    )
    inside = exact.valid[:, 0]
    assert np.abs(device.pixel[0].numpy().T[inside] - exact.pixel[inside, 0]).max() < 1e-6


@pytest.mark.parametrize("name", ["equisolid", "equidistant"])
def test_straight_behind_a_full_view_lies_the_rim(name):
    camera = getattr(mp.Radial, name)(512, 512, fov=2 * np.pi)
    image = camera.project([[0, 0, -1.0], [1e-200, 0, -2.0]])
    assert image.valid.all()
    assert np.allclose(image.pixel[:, 0], [512, 256])
    assert np.allclose(camera.ray(image.pixel[0, 0]).direction, [0, 0, -1], atol=1e-7)


@pytest.mark.parametrize("scale", [1e-12, 1e-8, 1e8, 1e12])
def test_projection_does_not_depend_on_distance(camera, scale):
    if camera.ray_geometry != "central":
        return
    camera = camera.with_pose(np.eye(4))
    points = np.array([[0.3, -0.2, 0.9], [1e-6, 0, 1.0], [0.0, 0.0, 1.0]])
    near = camera.project(points).pixel
    assert np.allclose(camera.project(points * scale).pixel, near, atol=1e-9)
    far = camera.project(types.Array3f(*map(aligned, (points * scale).T)))
    assert np.allclose(far.pixel[0].numpy().T, near[:, 0], atol=1e-3)


def test_equal_models_agree_where_theory_says_so():
    """Lambert's sqrt(1 - cos theta) is sqrt(2) sin(theta / 2); a user's tan(theta / 2) is the paraboloid."""
    own = mp.Radial.from_function(64, 64, lambda theta: mp.math.tan(theta / 2))
    built_in = mp.Radial.paraboloid(64, 64)
    ray, other = own.ray(PIXELS), built_in.ray(PIXELS)
    assert np.array_equal(ray.valid, other.valid)
    assert np.abs(ray.direction - other.direction)[ray.valid].max() < 1e-9
    assert own.profile.convex


def test_convexity_is_recognized():
    assert mp.custom_profile(mp.math.sin, np.pi / 2).convex
    assert mp.custom_profile(lambda theta: theta, np.pi).convex
    assert not mp.custom_profile(lambda theta: theta**0.5, np.pi / 2).convex
    assert not mp.custom_profile(lambda theta: theta**1.5, np.pi / 2).convex
    assert not mp.custom_profile(lambda theta: theta + theta**3, np.pi / 2).convex


@pytest.mark.parametrize("name", ["equisolid", "kannala_brandt"])
def test_compiled_functions_take_cameras(name):
    camera = cameras(64, POSE)[name]
    with jax.enable_x64(True):
        move = jax.jit(lambda c, point: c.project(point).pixel)
        point = camera.eye + 2 * camera.ray([20.0, 27.0]).direction
        assert np.allclose(move(camera, jnp.asarray(point)), camera.project(point).pixel, atol=1e-9)
        gradient = jax.grad(lambda c: jnp.sum(move(c, jnp.asarray(point))))(camera)
        assert np.abs(np.asarray(gradient.camera_from_world)[:3]).max() > 0


@pytest.mark.parametrize("name", own())
def test_a_profile_of_ones_own_cannot_be_written(name):
    with pytest.raises(mp.InputError, match="custom profile 'custom' cannot be written"):
        camera_to_json(own()[name])
