"""Calibrated lenses: against the published formulas at 50 digits, OpenCV and COLMAP where those are right, Embree."""

from typing import Any

import cv2
import drjit.llvm as types
import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pycolmap
import pytest
from catalog import cameras, triangles
from test_bounds import assert_holds, extent
from test_rasterize import assert_agree

import mpcam as mp
from mpcam.cameras.change import resized
from mpcam.cameras.outline import outline
from mpcam.rendering.device_camera import unposed

TUM_VI = (0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182)

REAL = {
    "TUM-VI, Kannala-Brandt": mp.KannalaBrandt(512, 512, 190.978477, 190.973307, 254.931706, 256.897443, TUM_VI),
    "TUM-VI, double sphere": mp.DoubleSphere(
        512, 512, 158.286, 158.274346, 254.961166, 256.889439, -0.172131, 0.593118
    ),
    "EuRoC, double sphere": mp.DoubleSphere(
        752, 480, 349.756002, 348.724542, 365.894408, 249.329956, -0.240957, 0.566997
    ),
    "EuRoC, unified": mp.UnifiedOmni(752, 480, 460.7, 459.3, 365.8, 249.3, 0.5903, 1.1005),
    "action camera": mp.KannalaBrandt(640, 480, 293.1, 293.4, 319.2, 241.1, (0.0443, 0.0094, -0.0056, 0.0017)),
    "220 degrees": mp.KannalaBrandt(512, 512, 137.2, 137.2, 255.3, 256.9, (-0.02, -0.003, 5e-4, -1e-4), max_angle=1.92),
    "catadioptric": mp.UnifiedOmni.mei(640, 480, 707.1, 706.8, 321.0, 243.5, 0.95),
}

EXTREME = {
    "folds within the image": mp.KannalaBrandt(64, 64, 20, 21, 32, 31, (0.05, -0.05, 0, 0)),
    "stretches": mp.KannalaBrandt(64, 64, 20, 21, 32, 31, (0.5, 0.2, 0, 0.01)),
    "pinhole": mp.UnifiedOmni(64, 64, 30, 31, 30, 33, 0.0),
    "stereographic": mp.UnifiedOmni.mei(64, 64, 30, 31, 30, 33, 1.0),
    "fisheye": mp.UnifiedOmni.mei(64, 64, 60, 61, 30, 33, 2.3),
    "orthographic sphere": mp.UnifiedOmni(64, 64, 30, 31, 30, 33, 1.0, 0.7),
    "narrow double sphere": mp.DoubleSphere(64, 64, 30, 31, 30, 33, -0.5, 0.1),
    "center outside": mp.DoubleSphere(64, 64, 50, 51, 30, 33, 1.5, 0.3),
    "spheres touch": mp.DoubleSphere(64, 64, 40, 41, 30, 33, 1.0, 0.5),
}

LENSES = REAL | EXTREME


@pytest.fixture(params=LENSES)
def lens(request):
    return LENSES[request.param]


def published(camera, x, y, z):
    """Pixel by the formula of the paper, in the arithmetic of mpmath; x, y, z: a point in the camera frame."""
    rho, d = mpmath.sqrt(x * x + y * y), mpmath.sqrt(x * x + y * y + z * z)
    if isinstance(camera, mp.KannalaBrandt):
        theta = mpmath.atan2(rho, z)
        factor = theta * (1 + sum(mpmath.mpf(k) * theta ** (2 * i + 2) for i, k in enumerate(camera.k))) / rho
    elif isinstance(camera, mp.DoubleSphere):
        xi, alpha = mpmath.mpf(camera.xi), mpmath.mpf(camera.alpha)
        shifted = xi * d + z
        factor = 1 / (alpha * mpmath.sqrt(rho * rho + shifted * shifted) + (1 - alpha) * shifted)
    else:
        alpha = mpmath.mpf(camera.alpha)
        factor = 1 / (alpha * mpmath.sqrt(mpmath.mpf(camera.beta) * rho * rho + z * z) + (1 - alpha) * z)
    return mpmath.mpf(camera.cx) + camera.fx * factor * x, mpmath.mpf(camera.cy) + camera.fy * factor * y


def test_rays_satisfy_the_published_formula(lens):
    """Every pixel's ray, put into the formula at 50 digits, gives the pixel back."""
    mpmath.mp.dps = 50
    pixels = np.random.default_rng(1).uniform(0, 1, (40, 2)) * [lens.width, lens.height]
    ray = lens.ray(pixels)
    assert ray.valid.mean() > 0.4
    for pixel, direction in zip(pixels[ray.valid], ray.direction[ray.valid], strict=True):
        u, v = published(lens, *(mpmath.mpf(float(c)) for c in direction))
        # Near the rim the pixel hardly depends on the ray, and in far corners a little of the ray is a lot of pixels.
        assert max(abs(u - pixel[0]), abs(v - pixel[1])) < 1e-11 * max(lens.width, lens.height)


def test_projection_satisfies_the_published_formula(lens):
    mpmath.mp.dps = 50
    theta = lens.limit * np.linspace(0.01, 0.99, 20)
    phi = np.arange(20.0)
    points = 3 * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    image = lens.project(points)
    assert image.valid.all()
    for point, pixel in zip(points, image.pixel[:, 0], strict=True):
        u, v = published(lens, *(mpmath.mpf(float(c)) for c in point))
        error = np.hypot(float(u - pixel[0]), float(v - pixel[1]))
        assert error < 1e-11 * max(lens.width, np.hypot(*pixel))


def test_the_domain_is_where_the_radius_increases(lens):
    """Not before and not after: by derivatives of the published formula at 50 digits."""
    mpmath.mp.dps = 50
    r = lambda t: (published(lens, mpmath.sin(t), mpmath.mpf(0), mpmath.cos(t))[0] - lens.cx) / lens.fx  # noqa: E731
    limit = mpmath.mpf(lens.limit)
    inside = [limit * mpmath.mpf(i) / 200 for i in range(1, 200)] + [limit - mpmath.mpf(10) ** -i for i in range(3, 6)]
    values = [r(theta) for theta in sorted(inside)]
    assert all(b > a > 0 for a, b in zip(values[:-1], values[1:], strict=True))
    if lens.limit < min(lens.max_angle, np.pi - 2e-6):
        # Beyond, it falls, or has gone to infinity and come back from the other side.
        beyond = r(limit + mpmath.mpf(10) ** -5)
        assert beyond < r(limit - mpmath.mpf(10) ** -9) or beyond < 0
    for away in (-1e-9, 1e-9):
        theta = lens.limit + away
        image = lens.project([np.sin(theta), 0, np.cos(theta)])
        assert image.valid.item() == (away < 0 or theta > np.pi)  # beyond pi it is the other side
        assert np.isfinite(image.pixel).all()


@pytest.mark.parametrize(
    ("lens", "degrees"),
    [
        (mp.UnifiedOmni.mei(64, 64, 9, 9, 32, 32, 0.5), 120),  # cos theta = -xi
        (mp.UnifiedOmni.mei(64, 64, 9, 9, 32, 32, 2.0), 120),  # cos theta = -1 / xi
        (mp.UnifiedOmni(64, 64, 9, 9, 32, 32, 1.0), 90),
        (mp.UnifiedOmni(64, 64, 9, 9, 32, 32, 0.0, 5.0), 90),
        (mp.DoubleSphere(64, 64, 9, 9, 32, 32, 0.5, 0.0), 120),  # cos theta = -xi
        (mp.DoubleSphere(64, 64, 9, 9, 32, 32, -0.5, 0.0), 60),
        (mp.DoubleSphere(64, 64, 9, 9, 32, 32, 2.0, 0.7), 120),  # cos theta = -1 / xi
        (mp.DoubleSphere(64, 64, 9, 9, 32, 32, 0.0, 2 / 3), 120),  # cos theta = -(1 - alpha) / alpha
        (mp.KannalaBrandt(64, 64, 9, 9, 32, 32, (-1 / 3 / (np.pi / 3) ** 2, 0, 0, 0)), 60),
        (mp.KannalaBrandt(64, 64, 9, 9, 32, 32, (0, 0, 0, 0)), 180),
        (mp.KannalaBrandt(64, 64, 9, 9, 32, 32, (0, 0, 0, 0), max_angle=np.radians(100)), 100),
    ],
)
def test_known_domains(lens, degrees):
    assert abs(np.degrees(lens.domain.max_angle) - degrees) < 1e-4


def test_published_border_of_the_double_sphere_lets_in_what_has_no_image():
    """Usenko 2018, equation 43, puts the border at another angle than the one where the denominator vanishes."""
    xi, alpha = -0.5, 0.1
    lens = mp.DoubleSphere(64, 64, 30, 30, 32, 32, xi, alpha)
    w1 = alpha / (1 - alpha)
    w2 = (w1 + xi) / np.sqrt(2 * w1 * xi + xi * xi + 1)
    theta = np.arccos(-w2) - 0.01  # inside, says the equation
    point = np.array([np.sin(theta), 0.0, np.cos(theta)])
    shifted = xi + point[2]
    assert alpha * np.hypot(point[0], shifted) + (1 - alpha) * shifted < 0
    assert not lens.project(point).valid.any()


def test_turning_points_are_found_wherever_they_are():
    """Also two that lie close together, which no grid would see; JAX's grid agrees where it can see them."""
    rng = np.random.default_rng(3)
    traced_limit = jax.jit(lambda k: mp.KannalaBrandt(8, 8, 4, 4, 4, 4, k).angle_limit())
    for _ in range(30):
        k = tuple(rng.normal(size=4) * [0.2, 0.1, 0.03, 0.01])
        roots = np.roots([9 * k[3], 7 * k[2], 5 * k[1], 3 * k[0], 1])
        squares = [root.real for root in roots if abs(root.imag) < 1e-12 and 0 < root.real < np.pi**2]
        expected = np.sqrt(min(squares)) if squares else np.pi
        camera = mp.KannalaBrandt(8, 8, 4, 4, 4, 4, k)
        assert abs(camera.limit - expected) < 1e-9
        with jax.enable_x64(True):
            traced = float(traced_limit(jnp.asarray(k)))
        assert expected - 1e-9 < traced + 1e-9 < expected + 2e-9
    # f' = (1 - s)^2 (1 + s^2 / 9) - 1e-12 is below zero on a stretch of 2e-6 only
    square = np.polynomial.polynomial.polymul([1, -2, 1], [1, 0, 1 / 9])
    k = (square - [1e-12, 0, 0, 0, 0])[1:] / [3, 5, 7, 9] / (1 - 1e-12)
    assert abs(mp.KannalaBrandt(8, 8, 4, 4, 4, 4, k).limit - 1) < 1e-5


@pytest.mark.parametrize("name", ["TUM-VI, Kannala-Brandt", "action camera", "220 degrees"])
def test_opencv_fisheye_agrees_in_front_of_the_camera(name):
    camera = REAL[name]
    theta = np.random.default_rng(4).uniform(0.01, np.radians(75), 500)
    phi = np.arange(500.0)
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    matrix = np.array([[camera.fx, 0, camera.cx - 0.5], [0, camera.fy, camera.cy - 0.5], [0, 0, 1]])
    zero = np.zeros(3)
    theirs, _ = cv2.fisheye.projectPoints(points[:, None], zero, zero, matrix, np.array(camera.k))
    assert np.abs(camera.project(points).pixel[:, 0] - theirs[:, 0] - 0.5).max() < 1e-9
    back = cv2.fisheye.undistortPoints(theirs, matrix, np.array(camera.k))[:, 0]
    direction = camera.ray(theirs[:, 0] + 0.5).direction
    assert np.abs(direction[:, :2] / direction[:, 2:] - back).max() < 1e-6


def test_opencv_fisheye_goes_wrong_near_90_degrees_and_this_does_not():
    """OpenCV clamps theta_d at 90 degrees (issue 26174) and says nothing; once this fails, it has been mended."""
    k, focal = (0.05, -0.01, 0.0, 0.0), 300.0
    camera = mp.KannalaBrandt(2000, 2000, focal, focal, 1000.5, 1000.5, k)
    theta = np.radians([80.0, 85.0, 89.5, 91.0, 100.0])
    radius = theta * (1 + k[0] * theta**2 + k[1] * theta**4)
    pixels = np.stack([1000.0 + focal * radius, np.full(5, 1000.0)], -1)
    matrix = np.array([[focal, 0, 1000.0], [0, focal, 1000.0], [0, 0, 1]])
    theirs = np.arctan(cv2.fisheye.undistortPoints(pixels[:, None], matrix, np.array(k))[:, 0, 0])
    error = np.degrees(np.abs(theirs - theta))
    assert error[0] < 1e-3
    assert (error[1:] > [0.1, 3, 4, 10]).all()
    ray = camera.ray(pixels + 0.5)
    assert ray.valid.all()
    assert np.abs(np.arctan2(ray.direction[:, 0], ray.direction[:, 2]) - theta).max() < 1e-13


@pytest.mark.parametrize("name", ["catadioptric", "fisheye", "stereographic"])
def test_opencv_omnidir_agrees(name):
    camera = LENSES[name]
    theta = np.random.default_rng(5).uniform(0.01, 0.9 * camera.limit, 300)
    phi = np.arange(300.0)
    points = 5 * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    scale = 1 + camera.xi
    matrix = np.array([[scale * camera.fx, 0, camera.cx - 0.5], [0, scale * camera.fy, camera.cy - 0.5], [0, 0, 1]])
    zero = np.zeros(3)
    theirs, _ = cv2.omnidir.projectPoints(points[:, None], zero, zero, matrix, camera.xi, np.zeros(4))
    ours = camera.project(points).pixel[:, 0]
    assert (np.abs(ours - theirs.reshape(-1, 2) - 0.5) < 1e-9 * (1 + np.abs(ours))).all()


@pytest.mark.parametrize("name", ["TUM-VI, Kannala-Brandt", "action camera", "EuRoC, unified"])
def test_colmap_agrees_in_front_of_the_camera(name):
    camera = REAL[name]
    fisheye = isinstance(camera, mp.KannalaBrandt)
    shape = camera.k if fisheye else (camera.alpha, camera.beta)
    theirs = pycolmap.Camera(
        model="OPENCV_FISHEYE" if fisheye else "EUCM",
        width=camera.width,
        height=camera.height,
        params=[camera.fx, camera.fy, camera.cx, camera.cy, *shape],
    )
    points = np.random.default_rng(6).normal(size=(300, 3)) + [0, 0, 2]
    points = points[points[:, 2] > 0.5]
    assert np.abs(theirs.img_from_cam(points) - camera.project(points).pixel[:, 0]).max() < 1e-9


def test_unified_models_contain_each_other():
    """xi = 0 is the unified model with another focal length; without spheres, both are the pinhole."""
    pixels = np.random.default_rng(7).uniform(0, 64, (200, 2))
    double = mp.DoubleSphere(64, 64, 30, 31, 30, 33, 0.0, 0.55)
    single = mp.UnifiedOmni(64, 64, 30, 31, 30, 33, 0.55)
    assert np.abs(double.ray(pixels).direction - single.ray(pixels).direction).max() < 1e-14
    pinhole = mp.Pinhole(64, 64, 30, 31, 30, 33)
    for other in (mp.DoubleSphere(64, 64, 30, 31, 30, 33, 0.0, 0.0), mp.UnifiedOmni(64, 64, 30, 31, 30, 33, 0.0)):
        assert np.abs(other.ray(pixels).direction - pinhole.ray(pixels).direction).max() < 1e-14
    stereographic = mp.Radial.paraboloid(64, 64)
    other = mp.UnifiedOmni.mei(64, 64, 32, 32, 32, 32, 1.0)
    inside = stereographic.ray(pixels)
    assert np.abs(other.ray(pixels).direction - inside.direction)[inside.valid].max() < 1e-14
    assert abs(other.xi - 1) < 1e-15


def test_float32_inverse_stays_in_the_domain():
    """Where f' nearly vanishes, one Newton step too many would leave it."""
    lens = mp.KannalaBrandt(64, 64, 20, 20, 32, 32, (-0.08728705, -0.11698019, 0.05218104, -0.00495911))
    rim = float(lens.radius_at(lens.limit))
    r = (rim * (1 - np.append(10 ** np.linspace(-8, -5, 20001), 0.0))).astype(np.float32)
    theta = lens.angle_at(types.Float(r)).numpy()
    assert theta.max() <= lens.limit + 1e-6
    assert np.abs(theta - lens.angle_at(r.astype(np.float64))).max() < 3e-4


def test_boxes_hold(lens):
    corners = triangles(150, seed=8)
    low, high, seen = extent(lens, corners)
    low, high = np.clip(low, -1e9, 1e9), np.clip(high, -1e9, 1e9)
    slack = 1e-9 * (1 + np.maximum(np.abs(low), np.abs(high)))
    quick = outline(lens, *(np.moveaxis(corners[:, i], -1, 0) for i in range(3)))
    for box in (lens.bound(corners), mp.Box(quick.low.T, quick.high.T, quick.valid)):
        assert_holds(box, low, high, seen, slack)


def test_boxes_are_tight_in_the_image(lens):
    """No more than a tenth of a pixel beyond dense samples, for triangles whose image lies in the picture."""
    rng = np.random.default_rng(9)
    center = lens.ray(rng.uniform(0.2, 0.8, (400, 1, 2)) * [lens.width, lens.height])
    corners = (center.direction + 0.2 * rng.normal(size=(400, 3, 3)))[center.valid[:, 0]]
    s = np.linspace(0, 1, 401)[:, None]
    edges = np.concatenate([corners[:, [i]] * (1 - s) + corners[:, [(i + 1) % 3]] * s for i in range(3)], 1)
    image = lens.project(edges)
    inside = image.valid.all((1, 2)) & lens.contains(image.pixel[..., 0, :]).all(1)
    assert inside.sum() > 50
    pixel, box = image.pixel[inside][..., 0, :], lens.bound(corners[inside])
    excess = np.maximum(pixel.min(1) - box.low, box.high - pixel.max(1)) / max(1, lens.width / 512)
    if lens.convex:
        assert np.percentile(excess, 98) < 0.1
    else:
        assert lens in (EXTREME["stretches"], EXTREME["narrow double sphere"])


@pytest.mark.parametrize("name", REAL)
def test_real_lenses_bulge_outward(name):
    """So that their boxes are tight."""
    assert REAL[name].convex


def test_boxes_hold_where_jax_does_not_know_the_lens_yet():
    camera = cameras(64)["unified_omni"]
    corners = triangles(60, seed=10)
    low, high, seen = extent(camera, corners)
    with jax.enable_x64(True):
        box = jax.jit(lambda c, t: c.bound(t))(camera, jnp.asarray(corners))
    box = mp.Box(*(np.asarray(part) for part in box))
    assert_holds(box, np.clip(low, -1e9, 1e9), np.clip(high, -1e9, 1e9), seen, 1e-6)


@pytest.mark.parametrize("name", REAL)
def test_first_hits_agree_with_embree(name):
    camera = resized(REAL[name], REAL[name].width // 2, REAL[name].height // 2)
    camera = camera.with_pose(mp.look_at((0.12, 0.07, 0.31), (0.5, 1.0, 0.7)))
    for mesh in (mp.builtin_mesh("quad_room"), mp.builtin_mesh("temple"), mp.builtin_mesh("sphere", triangles=20480)):
        hits = mp.rasterize(camera, mesh)
        assert_agree(hits, mp.rasterize(camera, mesh, method="raytrace"))
    assert hits.mask.mean() > 0.6


@pytest.mark.parametrize("model", ["kannala_brandt", "double_sphere", "unified_omni"])
def test_linear_views_and_fine_meshes_come_near(model):
    """On a finely divided sphere, straight edges and a cubemap are nearly right."""
    camera, mesh = cameras(128)[model], mp.builtin_mesh("sphere", triangles=20480)
    truth = mp.rasterize(camera, mesh, method="raytrace")
    for method, settings, tolerance in (("vertex", {"level": 2}, 1e-4), ("cubemap", {"resolution": 512}, 1e-3)):
        hits = mp.rasterize(camera, mesh, method=method, **settings)
        assert (hits.mask != truth.mask).mean() < 1e-3
        both = hits.mask & truth.mask
        assert np.percentile(np.abs(hits.depth[both] - truth.depth[both]), 99) < tolerance


def test_kernels_see_every_number():
    """Each number of a tuple reaches the device, and the derived ones do too."""
    camera = REAL["220 degrees"]
    lens: Any = unposed(camera)
    assert np.allclose([number.numpy()[0] for number in lens.k], camera.k, rtol=1e-6)
    assert abs(lens.limit.numpy()[0] - 1.92) < 1e-6
    assert abs(lens.edge.numpy()[0] - camera.edge) < 1e-6


def test_printed_on_one_line():
    text = repr(REAL["220 degrees"].with_pose(mp.look_at((1, 2, 3), (0, 0, 0))))
    assert text == (
        "KannalaBrandt(512, 512, fx=137.2, fy=137.2, cx=255.3, cy=256.9, k=(-0.02, -0.003, 0.0005, -0.0001), "
        "max_angle=1.92, eye=(1, 2, 3))"
    )
    assert repr(EXTREME["pinhole"]) == "UnifiedOmni(64, 64, fx=30, fy=31, cx=30, cy=33, alpha=0, beta=1)"


def test_another_size_shows_the_same():
    camera = REAL["EuRoC, double sphere"]
    half = resized(camera, 376, 240)
    pixels = np.array([[100.0, 200.0], [700.0, 30.0]])
    assert np.allclose(camera.ray(pixels).direction, half.ray(pixels / 2).direction, atol=1e-12)
