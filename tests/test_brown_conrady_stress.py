"""The stress suite of the Brown-Conrady lens in short, and that its oracle can fail."""

import dataclasses

import mpmath
import numpy as np
import pytest

from mpcam.stress import brown_conrady
from mpcam.stress.exact import DIGITS
from mpcam.stress.folds import Folds
from mpcam.stress.projections import judge_images, judge_rays
from mpcam.stress.report import LIMIT


def oracle(camera):
    """To be made and used within mpmath.workdps."""
    k, p = ([mpmath.mpf(float(x)) for x in numbers] for numbers in (camera.k, camera.p))
    folds = Folds(k, p, float(camera.max_angle))
    return folds, brown_conrady.exact_camera(camera, folds)


@pytest.mark.parametrize("name", list(brown_conrady.cameras())[::2])
def test_lenses_pass(name):
    rows = brown_conrady.lens_rows(name, brown_conrady.cameras()[name], 1)
    assert [row for row in rows if not row.good()] == []
    assert sum(row.worst > 0 for row in rows) >= 8


def test_the_oracle_knows_a_fold():
    """Without tangential distortion, 1 + 3 k1 s + 5 k2 s^2 = 0; with it alone, r (1 - 2 cos) = 1 / (2 |p|)."""
    with mpmath.workdps(DIGITS):
        radial, _ = oracle(brown_conrady.cameras()["folds, no decentering"])
        expected = mpmath.sqrt((1.5 - mpmath.sqrt(1.5**2 - 4 * 5 * mpmath.mpf(0.02))) / (2 * 5 * mpmath.mpf(0.02)))
        assert abs(radial.radius(mpmath.mpf(1), mpmath.mpf(0)) / expected - 1) < 1e-14
        camera = dataclasses.replace(brown_conrady.cameras()["only decentering"], p=(0.0, 0.2))
        tangential, _ = oracle(camera)
        for angle in (1.7, 2.0, mpmath.pi):
            x, y = mpmath.cos(angle), mpmath.sin(angle)
            assert abs(tangential.radius(x, y) * (1 - 2 * x) * 2 * mpmath.mpf(0.2) - 1) < 1e-60


def test_wrong_answers_would_be_found():
    camera = brown_conrady.cameras()["folds in the image"]
    with mpmath.workdps(DIGITS):
        folds, exact = oracle(camera)
        points, places = brown_conrady.near_folds(camera, folds, 20)
        off = dataclasses.replace(camera, cx=camera.cx + 1e-9)
        with np.errstate(all="ignore"):
            for wrong, found in ((camera, 0), (off, 1)):
                image, ray = wrong.local_project(points.T)[0], wrong.local_ray(places.T)
                rows = [
                    judge_images("x", "x", "float64", exact, points, (image.pixel.T, image.depth, image.valid)),
                    judge_rays("x", "x", "float64", exact, places, (ray.origin.T, ray.direction.T, ray.valid)),
                ]
                assert all((row.worst > LIMIT) == found for row in rows)
        assert 4 < ray.valid.sum() < 16
        judged = judge_rays("x", "x", "float64", exact, places, (ray.origin.T, ray.direction.T, ~ray.valid))
        assert judged.missed + judged.invented >= 18


def test_the_other_side_of_a_fold_would_be_found():
    """Its pixel is right, but it lies beyond the domain."""
    camera = brown_conrady.cameras()["folds in the image"]
    with mpmath.workdps(DIGITS):
        folds, exact = oracle(camera)
        for phi in range(6):
            rim = folds.at_rim(phi)
            u, v = (float(c) for c in folds.image(0.9 * rim[0], 0.9 * rim[1]))
            place = np.array([camera.cx + camera.fx * u, camera.cy + camera.fy * v])
            assert camera.ray(place).valid
            u, v = (mpmath.mpf(c) for c in ((place[0] - camera.cx) / camera.fx, (place[1] - camera.cy) / camera.fy))
            x, y = mpmath.findroot(
                lambda a, b, u=u, v=v: [c - d for c, d in zip(folds.image(a, b), (u, v), strict=True)],
                (1.1 * rim[0], 1.1 * rim[1]),
            )
            assert mpmath.hypot(x, y) > mpmath.hypot(*rim)
            direction = np.array([[float(x), float(y), 1.0]]) / float(mpmath.sqrt(x * x + y * y + 1))
            judged = judge_rays("x", "x", "float64", exact, place[None], (0 * direction, direction, [True]))
            assert judged.invented == 1


def test_a_wrong_domain_would_be_found():
    camera = brown_conrady.cameras()["folds in the image"]
    with mpmath.workdps(DIGITS):
        folds, exact = oracle(camera)
        assert brown_conrady.domain_row("x", camera, folds, exact).good()
        narrower = dataclasses.replace(camera, max_angle=(camera.domain.max_angle or 0) - 1e-13)
        assert brown_conrady.domain_row("x", narrower, folds, exact).worst > LIMIT
