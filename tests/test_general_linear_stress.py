"""The stress suite of general linear cameras in short, and what its oracle makes of wrong answers."""

import dataclasses

import numpy as np
import pytest

from mpcam.stress import general_linear as suite
from mpcam.stress.general_linear_kinds import kind_rows
from mpcam.stress.general_linear_truth import Truth
from mpcam.stress.projections import images
from mpcam.stress.regions import bound_rows

CAMERAS = suite.cameras()


@pytest.mark.parametrize("name", list(CAMERAS)[::3])
def test_cameras_pass(name):
    camera = CAMERAS[name]
    rows = suite.image_rows(name, camera, suite.inputs(camera, 8)) + suite.ray_rows(name, camera, suite.pixels(5))
    rows += bound_rows(name, camera, 3000)
    assert [row for row in rows if not row.good()] == []
    assert sum(row.worst > 0 for row in rows) >= 8


@pytest.mark.slow
def test_a_million_points_pass():
    for name, camera in CAMERAS.items():
        rows = suite.image_rows(name, camera, suite.inputs(camera, 3000))
        assert [row for row in rows if not row.good()] == []


def test_kinds_pass():
    rows = kind_rows(12)
    assert [row for row in rows if not row.good()] == [] and len(rows) == 15


def judged(camera, points, change):
    found = list(images(camera, points, "float64"))
    change(*found)
    return suite.judge("", "", "float64", Truth(camera), points, found)


def test_the_oracle_notices():
    camera = CAMERAS["slits at 2 and 4"]
    sets = suite.inputs(camera, 40)
    points = sets["in the image"]
    assert judged(camera, points, lambda pixel, depth, valid: None).good()
    valid = images(camera, points, "float64")[2]
    assert valid.all()

    def move(pixel, depth, valid):
        pixel[3, 1] *= 1 + 1e-11

    def deepen(pixel, depth, valid):
        depth[5] *= 1 + 1e-11

    def lose(pixel, depth, valid):
        valid[7] = False

    assert judged(camera, points, move).worst > suite.LIMIT
    assert judged(camera, points, deepen).worst > suite.LIMIT
    assert judged(camera, points, lose).missed == 1
    for name in ("before the plane", "in the plane of slit 1", "on slit 2"):
        row = judged(camera, sets[name], lambda pixel, depth, valid: valid.fill(True))
        assert row.invented == 40, name
    steeper = dataclasses.replace(camera, rays=np.asarray(camera.rays) * (1 + 1e-12))
    found = images(steeper, points, "float64")
    assert not suite.judge("", "", "float64", Truth(camera), points, found).good()


def test_points_near_slits_are_tried_on_both_sides_of_rounding():
    """Some of them have an image, some are too near."""
    camera = CAMERAS["slits at 2 and 4"]
    near = suite.inputs(camera, 200)["near slit 1"]
    valid = images(camera, near, "float64")[2]
    assert 0.5 < valid.mean() < 0.999 and (near[:, 2] > 2).any() and (near[:, 2] < 2).any()
