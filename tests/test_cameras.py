"""What each camera model promises: exact rays and projections, domains, gradients, one answer from three libraries."""

import copy
import dataclasses
import pickle

import drjit.llvm as types
import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from catalogue import NAMES, POSE, cameras

import mpcam as mp
from mpcam.cameras.serialize import camera_from_json, camera_to_json

RNG = np.random.default_rng(7)
PIXELS = RNG.uniform(0, 64, (4000, 2))


@pytest.fixture(params=NAMES)
def camera(request):
    return cameras(64, POSE)[request.param]


def test_round_trip(camera):
    ray = camera.ray(PIXELS)
    distance = RNG.uniform(0.01, 100, len(PIXELS))
    image = camera.project(ray.origin + distance[:, None] * ray.direction)
    assert ray.valid.mean() > 0.7
    assert image.valid[ray.valid].all()
    assert np.abs(image.pixel[ray.valid, 0] - PIXELS[ray.valid]).max() < 1e-8
    assert np.allclose(image.depth[ray.valid, 0], distance[ray.valid], rtol=1e-11)
    assert np.abs(np.linalg.norm(ray.direction, axis=-1) - 1).max() < 1e-14


def test_centre_ray_runs_along_the_axis(camera):
    centre = [camera.cx, camera.cy]
    ray = camera.ray(centre)
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


def test_float32_libraries_agree_with_float64(camera):
    points = camera.ray(PIXELS).direction * 3 + camera.eye
    exact = camera.project(points)
    jax_image = camera.project(jnp.asarray(points, jnp.float32))
    device = camera.project(types.Array3f(*points.T.astype(np.float32)))
    inside = exact.valid[:, 0] & (np.abs(exact.pixel[:, 0] - 32).max(-1) < 30)
    # Away from the rim, where the cosine-sphere's inverse has no derivative, float32 keeps about five digits.
    assert np.abs(np.asarray(jax_image.pixel)[inside, 0] - exact.pixel[inside, 0]).max() < 2e-3
    assert np.abs(device.pixel[0].numpy().T[inside] - exact.pixel[inside, 0]).max() < 2e-3
    ray, jax_ray = camera.ray(PIXELS), camera.ray(jnp.asarray(PIXELS, jnp.float32))
    device_ray = camera.ray(types.Array2f(*PIXELS.T.astype(np.float32)))
    inside = ray.valid & (np.abs(PIXELS - 32).max(-1) < 20)
    assert np.abs(np.asarray(jax_ray.direction)[inside] - ray.direction[inside]).max() < 5e-6
    assert np.abs(device_ray.direction.numpy().T[inside] - ray.direction[inside]).max() < 5e-6
    assert (np.asarray(jax_ray.valid)[inside] & device_ray.valid.numpy()[inside]).all()


def test_double_precision_on_dr_jit(camera):
    points = camera.ray(PIXELS).direction * 3 + camera.eye
    exact, device = camera.project(points), camera.project(types.Array3f64(*points.T))
    inside = exact.valid[:, 0]
    assert np.abs(device.pixel[0].numpy().T[inside] - exact.pixel[inside, 0]).max() < 1e-6


def _numbers(camera):
    """Every number of a camera as (field, index); index None for fields that are one number."""
    names = [field.name for field in dataclasses.fields(camera) if field.init]
    names = [name for name in names if name not in (*camera.static_fields, "camera_from_world")]
    values = {name: getattr(camera, name) for name in names}
    return [(n, i) for n, v in values.items() for i in (range(len(v)) if isinstance(v, tuple) else (None,))]


def _number(camera, name, index):
    value = getattr(camera, name)
    return value if index is None else value[index]


def _changed(camera, name, index, value):
    """The camera with one of its numbers replaced."""
    if index is not None:
        several = getattr(camera, name)
        value = (*several[:index], value, *several[index + 1 :])
    return dataclasses.replace(camera, **{name: value})


def test_jax_gradients_of_projection_match_differences(camera):
    """With respect to the point, the pose, and every number of the camera."""
    inner = camera.ray(np.array([[20.0, 27.0], [camera.cx, camera.cy], [35.0, 40.0]]))
    points = inner.origin + 2.5 * inner.direction
    with jax.enable_x64(True):

        def pixel_of_point(point):
            return camera.project(point).pixel[0]

        for point in points:
            exact = np.asarray(jax.jacobian(pixel_of_point)(jnp.asarray(point)))
            differences = _differences(lambda p: camera.project(p).pixel[0], point)
            assert np.abs(exact - differences).max() < 1e-5 * np.abs(differences).max()
        for name, index in _numbers(camera):
            start = float(_number(camera, name, index))

            def pixel(value, name=name, index=index):
                return _changed(camera, name, index, value).project(points).pixel

            exact = np.asarray(jax.jacobian(lambda v, f=pixel: jnp.asarray(f(v)))(jnp.asarray(start)))
            step = 1e-6 * max(1.0, abs(start))
            differences = (
                (pixel(start - step) - pixel(start - 3 * step)) / (2 * step)
                if name in ("fov", "max_angle")  # which may be the largest allowed
                else (pixel(start + step) - pixel(start - step)) / (2 * step)
            )
            assert np.abs(exact - differences).max() < 1e-4 * max(1.0, np.abs(differences).max()), name


def _differences(function, x, step=1e-6):
    columns = []
    for i in range(len(x)):
        delta = np.zeros(len(x))
        delta[i] = step
        columns.append((function(x + delta) - function(x - delta)) / (2 * step))
    return np.stack(columns, -1)


def test_jax_gradients_of_rays_match_differences(camera):
    pixels = np.array([[20.0, 27.0], [camera.cx, camera.cy], [35.0, 40.0]])
    with jax.enable_x64(True):
        for pixel in pixels:
            for part in ("origin", "direction"):
                exact = np.asarray(jax.jacobian(lambda p, part=part: getattr(camera.ray(p), part))(jnp.asarray(pixel)))
                differences = _differences(lambda p, part=part: getattr(camera.ray(p), part), pixel)
                assert np.abs(exact - differences).max() < 1e-7, (pixel, part)


def test_camera_is_a_jax_pytree(camera):
    with jax.enable_x64(True):
        leaves, tree = jax.tree_util.tree_flatten(camera)
        assert len(leaves) == 1 + len(_numbers(camera))
        assert jax.tree_util.tree_unflatten(tree, leaves) == camera

        @jax.jit
        def move(c, point):
            return c.project(point).pixel

        point = camera.eye + 2 * camera.ray([20.0, 27.0]).direction
        assert np.allclose(move(camera, jnp.asarray(point)), camera.project(point).pixel, atol=1e-9)
        gradient = jax.grad(lambda c: jnp.sum(move(c, jnp.asarray(point))))(camera)
        assert np.isfinite(np.asarray(gradient.camera_from_world)).all()
        assert np.abs(np.asarray(gradient.camera_from_world)[:3]).max() > 0


def test_bad_numbers_are_invalid_not_nan(camera):
    points = np.array([[np.nan, 0.0, 1], [np.inf, 1, 1], [0, -np.inf, 2], [1e300, 1e300, 1e300]])
    image = camera.project(points)
    assert not image.valid[:3].any()
    assert np.isfinite(image.pixel[:3]).all()
    ray = camera.ray([[np.nan, 3.0], [np.inf, 3.0]])
    assert not ray.valid.any()
    assert np.isfinite(ray.direction).all()
    assert np.isfinite(ray.origin).all()


@pytest.mark.parametrize("name", ["equisolid", "equidistant"])
def test_straight_behind_a_full_view_lies_the_rim(name):
    camera = getattr(mp.Radial, name)(512, 512, fov=2 * np.pi)
    image = camera.project([[0, 0, -1.0], [1e-200, 0, -2.0]])
    assert image.valid.all()
    assert np.allclose(image.pixel[:, 0], [512, 256])
    assert np.allclose(camera.ray(image.pixel[0, 0]).direction, [0, 0, -1], atol=1e-7)


def test_central_cameras_have_no_image_of_their_centre(camera):
    if camera.ray_geometry == "central":
        assert not camera.project(camera.eye).valid.any()


@pytest.mark.parametrize("scale", [1e-12, 1e-8, 1e8, 1e12])
def test_projection_does_not_depend_on_distance(camera, scale):
    if camera.ray_geometry != "central":
        return
    camera = camera.with_pose(np.eye(4))
    points = np.array([[0.3, -0.2, 0.9], [1e-6, 0, 1.0], [0.0, 0.0, 1.0]])
    near = camera.project(points).pixel
    assert np.allclose(camera.project(points * scale).pixel, near, atol=1e-9)
    far = camera.project(types.Array3f(*(points * scale).T.astype(np.float32)))
    assert np.allclose(far.pixel[0].numpy().T, near[:, 0], atol=1e-3)


def test_json_round_trip_is_exact(camera):
    if getattr(getattr(camera, "profile", None), "name", "") == "custom":
        with pytest.raises(mp.InputError, match="custom profile 'custom' cannot be written"):
            camera_to_json(camera)
        return
    again = camera_from_json(camera_to_json(camera))
    assert again == camera
    assert again != camera.with_pose(np.eye(4))


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


def test_pickled_and_copied_cameras_are_equal(camera):
    if getattr(getattr(camera, "profile", None), "name", "") == "custom":
        return  # a lambda of this file
    for again in (pickle.loads(pickle.dumps(camera)), copy.deepcopy(camera)):
        assert again == camera
        assert camera_to_json(again) == camera_to_json(camera)
