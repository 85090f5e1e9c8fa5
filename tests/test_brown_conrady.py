"""The Brown-Conrady lens: against its formula at 50 digits, COLMAP and OpenCV, and what one-to-one means."""

import dataclasses

import cv2
import mpmath
import numpy as np
import pycolmap
import pytest
from catalog import POSE

import mpcam as mp

EUROC = (-0.28340811, 0.07395907), (0.00019359, 1.76187114e-05)

LENSES = {
    "EuRoC": mp.BrownConrady(752, 480, 458.654, 457.296, 367.215, 248.375, *EUROC),
    "barrel": mp.BrownConrady(64, 64, 60, 61, 32, 31, (-0.28, 0.02), (3e-4, -1e-3)),
    "simple radial": mp.BrownConrady(640, 480, 520.0, 520.0, 320.0, 240.0, (0.11,)),
    "rational": mp.BrownConrady(640, 480, 180, 178, 321, 239, (9.1, 5.2, 0.19, 9.4, 8.1, 1.1), (1e-4, -2e-4)),
    "pole": mp.BrownConrady(64, 64, 15, 15, 32, 32, (0.1, 0.02, 0, -0.4, 0.01, 0), (0.01, 0.02)),
    "decentred": mp.BrownConrady(64, 64, 40, 41, 32, 31, (-0.2, 0.03), (0.04, -0.07)),
    "only tangential": mp.BrownConrady(64, 64, 40, 41, 32, 31, (), (0.1, 0.15)),
    "folds in the image": mp.BrownConrady(64, 64, 40, 41, 32, 31, (-0.5, 0.02), (-0.01, 0.02)),
    "folds on one side": mp.BrownConrady(64, 64, 15, 15, 32, 31, (-0.3, 0.04, 0.001), (0.004, -0.002)),
    "stretches": mp.BrownConrady(64, 64, 12, 12, 32, 31, (0.9, 0.7, 0.3), (0.02, 0.01)),
    "telephoto": mp.BrownConrady(64, 64, 4e5, 4e5, 32, 31, (-0.3, 900.0), (1e-3, 0)),
}


@pytest.fixture(params=LENSES)
def lens(request):
    return LENSES[request.param]


def published(camera, x, y, z):
    """Pixel by OpenCV's formula, in the arithmetic of mpmath; x, y, z: a point in the camera frame."""
    k1, k2, k3, k4, k5, k6 = (mpmath.mpf(value) for value in camera.k)
    p1, p2 = (mpmath.mpf(value) for value in camera.p)
    a, b = x / z, y / z
    r2 = a * a + b * b
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    u = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
    v = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
    return camera.cx + camera.fx * u, camera.cy + camera.fy * v


def exact(point):
    return [mpmath.mpf(float(c)) for c in point]


def plane_points(camera, count, seed, most=1.2):
    """Points (N, 3) on the plane z = 1, up to `most` times the outer radius, and near it, and near the axis."""
    rng = np.random.default_rng(seed)
    outer = camera.reach.outer
    r = outer * rng.uniform(0, most, count)
    r = np.where(rng.uniform(size=count) < 0.3, outer * (1 - 10.0 ** rng.uniform(-9, 0, count)), r)
    r = np.where(rng.uniform(size=count) < 0.3, 10.0 ** rng.uniform(-8, np.log10(outer), count), r)
    phi = rng.uniform(-np.pi, np.pi, count)
    return np.stack([r * np.cos(phi), r * np.sin(phi), np.ones(count)], -1)


def random_lens(rng, wild):
    """Coefficients as calibrations give them, or of any size."""
    if not wild:
        k = rng.normal(size=6) * [0.3, 0.1, 0.03, *(rng.choice([0, 1]) * np.array([0.3, 0.1, 0.03]))]
        p = rng.normal(size=2) * 2e-3
    else:
        k, p = rng.normal(size=6) * 10.0 ** rng.uniform(-3, 1.5, 6), rng.normal(size=2) * 10.0 ** rng.uniform(-4, 0)
    f = 10.0 ** rng.uniform(1, 4)
    return mp.BrownConrady(640, 480, f, f * rng.uniform(0.9, 1.1), 320 + 9 * rng.normal(), 240, k, p)


def stretch(camera, points):
    """Largest derivative of the pixel with respect to the direction, by differences: what makes errors larger."""
    step = 1e-7
    moved = [points * (1 + step * np.eye(3)[i]) for i in range(2)]
    here = camera.project(points).pixel[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = [np.abs(camera.project(p).pixel[:, 0] - here).max(-1) / (step * np.abs(points[:, i]))
                for i, p in enumerate(moved)]  # fmt: skip
    return np.nan_to_num(np.maximum(*rate)) * (points**2).sum(-1) + camera.fx


def test_rays_satisfy_the_formula(lens):
    """Every pixel's ray, put into the formula at 50 digits, gives the pixel back."""
    mpmath.mp.dps = 50
    pixels = np.random.default_rng(1).uniform(0, 1, (40, 2)) * [lens.width, lens.height]
    ray = lens.ray(pixels)
    assert ray.valid.mean() > 0.25
    amplified = stretch(lens, ray.direction)
    for pixel, direction, factor in zip(pixels[ray.valid], ray.direction[ray.valid], amplified[ray.valid], strict=True):
        u, v = published(lens, *exact(direction))
        assert max(abs(u - pixel[0]), abs(v - pixel[1])) < 2e-15 * (factor + 1000)


def test_projection_satisfies_the_formula(lens):
    mpmath.mp.dps = 50
    points = 3 * plane_points(lens, 40, 2, 1.0)
    image = lens.project(points)
    assert image.valid.mean() > 0.3
    points, pixels = points[image.valid[:, 0]], image.pixel[image.valid]
    for point, pixel, factor in zip(points, pixels, stretch(lens, points / points[:, 2:]), strict=True):
        u, v = published(lens, *exact(point))
        assert np.hypot(float(u - pixel[0]), float(v - pixel[1])) < 4e-15 * (factor + np.hypot(float(u), float(v)))


def eigenvalues(camera, x, y):
    """Of the derivative of the formula at 50 digits, by differences there; ascending."""
    unit = dataclasses.replace(camera, fx=1.0, fy=1.0, cx=0.0, cy=0.0)
    h = mpmath.mpf(10) ** -20
    image = lambda a, b: published(unit, a, b, mpmath.mpf(1))  # noqa: E731
    du = [(a - b) / (2 * h) for a, b in zip(image(x + h, y), image(x - h, y), strict=True)]
    dv = [(a - b) / (2 * h) for a, b in zip(image(x, y + h), image(x, y - h), strict=True)]
    assert abs(du[1] - dv[0]) < 1e-15 * (1 + abs(du[1])), "the map is a gradient: its derivative is symmetric"
    mean, half = (du[0] + dv[1]) / 2, mpmath.sqrt(((du[0] - dv[1]) / 2) ** 2 + du[1] * dv[0])
    return mean - half, mean + half


@pytest.mark.parametrize("name", ["barrel", "folds in the image"])
def test_the_domain_ends_where_the_map_folds(name):
    """To 1e-12: towards (p2, p1) at `outer`, on the other side at `inner`, and in between wherever the fold is."""
    mpmath.mp.dps = 50
    camera = LENSES[name]
    p1, p2 = camera.p
    toward = np.array([p2, p1]) / np.hypot(p1, p2)
    assert camera.reach.inner < camera.reach.outer < 1000
    for radius, sign in ((camera.reach.outer, 1), (camera.reach.inner, -1)):
        lowest = [eigenvalues(camera, *exact(sign * radius * (1 + away) * toward))[0] for away in (-1e-12, 1e-12)]
        assert lowest[0] > 0 > lowest[1]
    for phi in np.linspace(0, 2 * np.pi, 9):
        azimuth = np.array([np.cos(phi), np.sin(phi)])
        low, high = 0.0, 2.0 * camera.reach.outer
        while high - low > 1e-13 * high:
            middle = 0.5 * (low + high)
            inside = camera.project([*(middle * azimuth), 1.0]).valid[0]
            low, high = (middle, high) if inside else (low, middle)
        lowest = [eigenvalues(camera, *exact(low * (1 + away) * azimuth))[0] for away in (-1e-12, 1e-12)]
        assert lowest[0] > 0 > lowest[1]
    assert camera.domain.max_angle == np.arctan(camera.reach.outer)
    assert camera.inner_angle == np.arctan(camera.reach.inner)


def unfolded(camera, points):
    """Whether the derivative stays positive from the axis to points on z = 1, by many samples of its determinant.

    Not beyond half of the largest image.
    """
    share = np.linspace(0, 1, 801)[1:, None, None]
    x, y = np.moveaxis(share * points[:, :2], -1, 0)
    (p1, p2), (k1, k2, k3, k4, k5, k6), s = camera.p, camera.k, x * x + y * y
    above, below = 1 + s * (k1 + s * (k2 + s * k3)), 1 + s * (k4 + s * (k5 + s * k6))
    with np.errstate(all="ignore"):
        rate = ((k1 + s * (2 * k2 + 3 * s * k3)) * below - above * (k4 + s * (2 * k5 + 3 * s * k6))) / below**2
        xx = above / below + 2 * rate * x * x + 2 * p1 * y + 6 * p2 * x
        yy = above / below + 2 * rate * y * y + 6 * p1 * y + 2 * p2 * x
        xy = 2 * rate * x * y + 2 * p1 * x + 2 * p2 * y
        small = np.sqrt(s) * above / below + 3 * s * np.hypot(p1, p2) < 5e5
        return ((xx * yy > xy * xy) & (xx > 0) & (below > 0) & small & (s < 9e4**2)).all(0)


def test_the_domain_is_where_the_map_is_one_to_one():
    """Nothing valid is behind a fold, and nothing before one is left out, but for shadows of islands of folds."""
    rng = np.random.default_rng(3)
    folded = behind = islands = 0
    for number in range(80):
        camera = random_lens(rng, number % 2)
        points = plane_points(camera, 100, number, 2.0)
        valid, free = camera.project(points).valid[:, 0], unfolded(camera, points)
        ends = camera.domain.image_radius is not None
        behind += (valid & ~free).sum() if ends else 0
        folded += (~valid & ~free).sum() if ends else 0
        if camera.reach.level > -1e6:
            islands += 1
        else:
            assert valid[free].all(), camera
    assert behind == 0
    assert folded > 1200
    assert islands < 8


def round_trip(camera, seed):
    """(points tried, answers missed, wrong answers) of pixels of points all over the domain and outside."""
    points = plane_points(camera, 100, seed)
    image = camera.project(points)
    valid = image.valid[:, 0]
    points, pixels = points[valid], image.pixel[valid, 0]
    ray = camera.ray(pixels)
    direction = points / np.linalg.norm(points, axis=-1, keepdims=True)
    apart = np.abs(ray.direction - direction).max(-1)
    again = camera.project(ray.direction)
    off = np.abs(again.pixel[:, 0] - pixels).max(-1)
    allowed = 1e-9 * np.abs(pixels).max(-1) + 1e-15 * stretch(camera, points)
    # Within sqrt(eps) of a fold, rounding decides where a point is; its pixel is right all the same.
    wrong = (off > allowed) & again.valid[:, 0] | (apart > 1e-6)
    return len(points), int((~ray.valid).sum()), int((wrong & ray.valid).sum())


def check_round_trips(count, seed):
    rng = np.random.default_rng(seed)
    total = np.zeros(3, int)
    for number in range(count):
        total += round_trip(random_lens(rng, number % 2), number)
    assert total[0] > 60 * count
    assert total[1] == total[2] == 0


def test_round_trip_of_random_lenses():
    check_round_trips(150, 4)


@pytest.mark.slow
def test_round_trip_of_ten_thousand_lenses():
    check_round_trips(10000, 5)


def check_against_others(count, seed):
    """OpenCV's 8 coefficients, and COLMAP's FULL_OPENCV, OPENCV, RADIAL and SIMPLE_RADIAL, in turn."""
    rng = np.random.default_rng(seed)
    zero = np.zeros(3)
    for number in range(count):
        camera = random_lens(rng, number % 2)
        kind = number % 4
        kept = camera.k if kind < 1 else (camera.k[:2] if kind < 3 else camera.k[:1])
        f = camera.fx if kind > 1 else camera.fy
        camera = dataclasses.replace(camera, fy=f, k=kept, p=camera.p if kind < 2 else ())
        (k1, k2, k3, *rest), (p1, p2) = camera.k, camera.p
        points = plane_points(camera, 20, number, 1.0)
        image = camera.project(points)
        valid = image.valid[:, 0]
        points, pixels = points[valid], image.pixel[valid, 0]
        frame = [camera.fx, camera.fy, camera.cx, camera.cy]
        model, params = (
            ("FULL_OPENCV", [*frame, k1, k2, p1, p2, k3, *rest]),
            ("OPENCV", [*frame, k1, k2, p1, p2]),
            ("RADIAL", [f, *frame[2:], k1, k2]),
            ("SIMPLE_RADIAL", [f, *frame[2:], k1]),
        )[kind]
        theirs = pycolmap.Camera(model=model, width=640, height=480, params=params)
        matrix = np.array([[camera.fx, 0, camera.cx - 0.5], [0, camera.fy, camera.cy - 0.5], [0, 0, 1]])
        coefficients = np.array([k1, k2, p1, p2, k3, *rest])
        opencv = cv2.projectPoints(points[:, None], zero, zero, matrix, coefficients)[0][:, 0] + 0.5
        for other in (theirs.img_from_cam(points), opencv):
            assert (np.abs(other - pixels) < 1e-9 * (camera.fx + np.abs(pixels))).all(), camera


def test_colmap_and_opencv_project_alike():
    check_against_others(200, 6)


@pytest.mark.slow
def test_colmap_and_opencv_project_ten_thousand_lenses_alike():
    check_against_others(10000, 7)


def test_opencv_undistorts_alike_where_it_converges_and_is_wrong_elsewhere():
    """Its undistortPoints says nothing where it fails; once this fails, it has been mended."""
    rng = np.random.default_rng(8)
    tried = failed = 0
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-14)
    for number in range(100):
        camera = random_lens(rng, 0)
        points = plane_points(camera, 30, number, 1.0)
        points = points[np.hypot(*points[:, :2].T) < 10]
        image = camera.project(points)
        points, pixels = points[image.valid[:, 0]], image.pixel[image.valid]
        (k1, k2, k3, *rest), (p1, p2) = camera.k, camera.p
        matrix = np.array([[camera.fx, 0, camera.cx - 0.5], [0, camera.fy, camera.cy - 0.5], [0, 0, 1]])
        coefficients = np.array([k1, k2, p1, p2, k3, *rest])
        theirs = cv2.undistortPoints(pixels[:, None] - 0.5, matrix, coefficients, criteria=criteria)
        ray = camera.ray(pixels)
        assert ray.valid.all()
        ours = ray.direction[:, :2] / ray.direction[:, 2:]
        scale = 1e-6 * (1 + np.abs(points[:, :2]).max(-1))
        assert (np.abs(ours - points[:, :2]).max(-1) < scale).all()
        tried += len(points)
        failed += (np.abs(theirs[:, 0] - points[:, :2]).max(-1) > scale).sum()
    assert 0.1 < failed / tried < 0.5


def test_without_distortion_it_is_the_pinhole():
    pixels = np.random.default_rng(9).uniform(-500, 900, (300, 2))
    ours, pinhole = mp.BrownConrady(64, 48, 30, 31, 30, 23, (), (), POSE), mp.Pinhole(64, 48, 30, 31, 30, 23, POSE)
    assert np.abs(ours.ray(pixels).direction - pinhole.ray(pixels).direction).max() < 1e-15
    points = np.random.default_rng(10).normal(size=(300, 3))
    assert np.array_equal(ours.project(points).valid, pinhole.project(points).valid)
    seen = ours.project(points).valid
    assert np.allclose(ours.project(points).pixel[seen], pinhole.project(points).pixel[seen], rtol=1e-13)


def test_max_angle_ends_the_domain():
    camera = mp.BrownConrady(64, 64, 40, 40, 32, 32, (0.1,), (0.01, 0.02), max_angle=0.5)
    assert camera.domain.max_angle == camera.inner_angle == 0.5
    for theta, expected in ((0.4999, True), (0.5, True), (0.5001, False)):
        point = [np.sin(theta), 0, np.cos(theta)]
        assert camera.project(point).valid[0] == expected
        free = dataclasses.replace(camera, max_angle=np.pi / 2)
        assert camera.ray(free.project(point).pixel[0]).valid == expected
    # The largest radius of the image is that towards (p2, p1).
    rim = np.tan(0.5) * np.array([0.02, 0.01]) / np.hypot(0.02, 0.01)
    assert np.isclose(camera.domain.image_radius or 0, np.hypot(*(camera.project([*rim, 1]).pixel[0] - 32)))
    assert LENSES["stretches"].domain.image_radius is None


def test_what_is_beyond_is_invalid():
    for camera in LENSES.values():
        image = camera.project(
            [[0, 0, -1], [1, 2, -3], [1, 0, 0], [0, 0, 0], [np.nan, 0, 1], [np.inf, 1, 1], [1e300, 0, 1]]
        )
        assert not image.valid.any()
        assert np.isfinite(image.pixel).all()
        ray = camera.ray([[np.nan, 3], [3, -np.inf], [1e300, -1e300], [1e30, 0]])
        assert not ray.valid.any()
        assert np.isfinite(ray.direction).all()
    assert LENSES["EuRoC"].ray(camera.project([1e-200, 0, 1e-200]).pixel[0]).valid


def test_two_folds_close_together_are_found():
    """Radial and of the form (1 - s)^2 - 1e-12: it falls below zero on a stretch of 1e-6 only, which no grid sees."""
    k = (np.array([1, -2 - 0, 1]) - [1e-12, 0, 0])[1:] / [3, 5]
    camera = mp.BrownConrady(64, 64, 40, 40, 32, 32, k / (1 - 1e-12))
    assert abs(camera.reach.outer - 1) < 1e-5
    open_again = mp.BrownConrady(64, 64, 40, 40, 32, 32, k / (1 + 1e-12) + [0, 1e-11])
    assert open_again.reach.outer > 2
