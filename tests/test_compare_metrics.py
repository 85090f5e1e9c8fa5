"""Error metrics: defining properties, closed forms, and NVIDIA's own FLIP."""

from typing import NamedTuple

import flip_evaluator
import numpy as np
import pytest

from mpcam.cameras import Pinhole, Radial
from mpcam.comparison import metrics
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh


class Frame(NamedTuple):
    """First hits as plain arrays."""

    triangle: np.ndarray
    depth: np.ndarray
    barycentric: np.ndarray | None = None


def frame(triangle, depth) -> Frame:
    return Frame(np.asarray(triangle, np.int32), np.asarray(depth, np.float32))


TRUTH = frame([[0, 1, -1, 2], [0, 1, -1, 2]], [[1, 2, np.inf, 4], [1, 2, np.inf, 4]])


def picture(seed: int = 0) -> np.ndarray:
    y, x = np.mgrid[0:60, 0:80] / 80
    return np.stack([0.5 + 0.5 * np.sin(9 * x), x * y, 0.2 + 0.6 * y], -1).astype(np.float32)


def test_equal_hits_have_no_error():
    errors = metrics.hit_errors(TRUTH, TRUTH)
    assert (errors.hit_mismatch, errors.triangle_mismatch, errors.depth_median, errors.depth_p999) == (0, 0, 0, 0)


def test_hit_mismatch_counts_both_directions_over_all_pixels():
    other = frame([[0, 1, 3, 2], [-1, 1, -1, 2]], [[1, 2, 9, 4], [np.inf, 2, np.inf, 4]])
    assert metrics.hit_errors(other, TRUTH).hit_mismatch == 2 / 8


def test_another_triangle_at_the_same_depth_is_no_mismatch():
    near = frame([[5, 6, -1, 2], [0, 1, -1, 2]], [[1.00005, 2.1, np.inf, 4], [1, 2, np.inf, 4]])
    errors = metrics.hit_errors(near, TRUTH)
    assert errors.triangle_mismatch == 1 / 8
    assert errors.hit_mismatch == 0


def test_depth_errors_are_relative_to_the_truth():
    deeper = frame(TRUTH.triangle, np.where(np.isinf(TRUTH.depth), np.inf, TRUTH.depth * 1.25))
    errors = metrics.hit_errors(deeper, TRUTH)
    assert errors.depth_median == pytest.approx(0.25, rel=1e-6)
    assert errors.depth_p999 == pytest.approx(0.25, rel=1e-6)


def test_nothing_in_common_leaves_depth_unmeasured():
    empty = frame(np.full((2, 4), -1), np.full((2, 4), np.inf))
    errors = metrics.hit_errors(empty, TRUTH)
    assert errors.hit_mismatch == 6 / 8
    assert np.isnan(errors.depth_median)
    assert np.isnan(errors.depth_p999)


def test_images_of_different_size_are_refused():
    with pytest.raises(InputError, match=r"\(1, 2\).*\(2, 4\)"):
        metrics.hit_errors(frame([[0, 1]], [[1, 1]]), TRUTH)
    with pytest.raises(InputError, match="cannot be compared"):
        metrics.image_rmse(np.zeros((2, 2, 3)), np.zeros((3, 2, 3)))


def exact_frame(camera, mesh, shift=(0.0, 0.0)) -> Frame:
    """First hits on a mesh of one triangle by its plane, of rays that leave `shift` pixels beside each center."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width] + 0.5
    origin, direction, valid = camera.ray(np.stack([u + shift[0], v + shift[1]], -1))
    a, b, c = mesh.corners[0]
    normal = np.cross(b - a, c - a)
    t = ((a - origin) @ normal) / (direction @ normal)
    point = origin + t[..., None] * direction - a
    weights = np.linalg.lstsq(np.stack([b - a, c - a], -1), point.reshape(-1, 3).T, rcond=None)[0].T.reshape(
        *t.shape, 2
    )
    hit = valid & (t > 0) & (weights.min(-1) >= 0) & (weights.sum(-1) <= 1)
    return Frame(np.where(hit, 0, -1), np.where(hit, t, np.inf), np.where(hit[..., None], weights, 0))


@pytest.mark.parametrize(
    "make", [lambda: Pinhole(40, 30, 30.0), lambda: Radial.equisolid(40, 40)], ids=["pinhole", "equisolid"]
)
def test_projection_error_is_the_distance_that_rays_were_moved_by(make):
    camera, mesh = make(), Mesh(np.array([(-1, -1, 2), (2, -1, 2.5), (0, 1.5, 3)]), np.array([(0, 1, 2)]))
    exact = metrics.projection_errors(camera, mesh, exact_frame(camera, mesh))
    assert exact.max < 1e-9
    moved = metrics.projection_errors(camera, mesh, exact_frame(camera, mesh, (0.3, -0.4)))
    assert moved.median == pytest.approx(0.5, abs=1e-9)
    assert moved.p95 == pytest.approx(0.5, abs=1e-9)
    assert moved.max == pytest.approx(0.5, abs=1e-9)


def test_points_that_the_camera_does_not_see_are_infinitely_far():
    camera, mesh = Pinhole(2, 1, 1.0), Mesh(np.array([(-1, -1, -2), (1, -1, -2), (0, 1, -2)]), np.array([(0, 1, 2)]))
    behind = Frame(np.zeros((1, 2), np.int32), np.ones((1, 2)), np.full((1, 2, 2), 1 / 3))
    errors = metrics.projection_errors(camera, mesh, behind)
    assert errors.median == errors.max == np.inf


def test_no_hits_leave_projection_unmeasured():
    camera, mesh = Pinhole(2, 1, 1.0), Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    nothing = Frame(np.full((1, 2), -1), np.full((1, 2), np.inf), np.zeros((1, 2, 2)))
    assert np.isnan(metrics.projection_errors(camera, mesh, nothing).median)
    assert np.isnan(metrics.projection_distances(camera, mesh, nothing)).all()


def test_rmse_and_psnr_in_display_space():
    white, black = np.ones((2, 2, 3)), np.zeros((2, 2, 3))
    assert metrics.image_rmse(white, black) == pytest.approx(1.0)
    assert metrics.psnr(1.0) == 0.0
    assert metrics.image_rmse(5 * white, white) == 0.0  # both show as white
    assert metrics.psnr(metrics.image_rmse(white, white)) == np.inf
    # linear 0.2140 is display 0.5 (IEC 61966-2-1), which is 6.02 dB from black
    gray = np.full((2, 2, 3), ((0.5 + 0.055) / 1.055) ** 2.4)
    assert metrics.image_rmse(gray, black) == pytest.approx(0.5)
    assert metrics.psnr(metrics.image_rmse(gray, black)) == pytest.approx(20 * np.log10(2))


def test_flip_is_zero_for_equal_images_and_grows_with_the_error():
    truth = picture()
    noise = np.random.default_rng(1).standard_normal(truth.shape)
    assert metrics.flip_map(truth, truth).max() == 0
    means = [metrics.flip_map(truth + size * noise, truth).mean() for size in (0.003, 0.01, 0.03, 0.1)]
    assert 0 < means[0] < means[1] < means[2] < means[3] < 1


def test_flip_agrees_with_the_reference_implementation():
    truth = picture()
    image = np.clip(truth + 0.1 * np.random.default_rng(2).standard_normal(truth.shape), 0, 1)
    image[10:20, 10:30] = 0.0
    reference, mean, _ = flip_evaluator.evaluate(
        metrics.display(truth).astype(np.float32), metrics.display(image).astype(np.float32), "LDR", applyMagma=False
    )
    # the two take cube roots and powers in float32 by different approximations
    np.testing.assert_allclose(metrics.flip_map(image, truth), np.asarray(reference)[..., 0], atol=2e-4)
    assert metrics.flip_map(image, truth).mean() == pytest.approx(mean, abs=2e-5)


def test_flip_of_one_pixel():
    assert metrics.flip_map(np.ones((1, 1, 3)), np.zeros((1, 1, 3))).shape == (1, 1)
