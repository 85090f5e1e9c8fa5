"""The stress cases of graph cameras in short, and that their oracle notices what is wrong."""

import dataclasses

import mpmath
import numpy as np
import pytest

import mpcam as mp
from mpcam.stress import graph_camera as stress
from mpcam.stress.exact import DIGITS
from mpcam.stress.graph_camera_truth import Truth
from mpcam.stress.projections import images

CAMERAS = stress.cameras()


@pytest.mark.parametrize("name", ["merge", "shared edge", "center close to the face"])
def test_cases_pass(name):
    rows = stress.image_rows(name, CAMERAS[name], 2) + stress.ray_rows(name, CAMERAS[name], 2)
    assert [row for row in rows if not row.good()] == []
    assert sum(row.worst > 0 for row in rows) > 8


def _judged(camera, other, points):
    with mpmath.workdps(DIGITS):
        return stress.judge("x", "x", "float64", Truth(camera), points, images(other, points, "float64"))


def test_a_wrong_center_or_place_would_be_found():
    camera = CAMERAS["bend"]
    points = stress.inputs(camera, 6)["on rays"]
    assert _judged(camera, camera, points).good()
    portals = [dataclasses.replace(camera.portals[0], center=camera.portals[0].center + 1e-12), *camera.portals[1:]]
    assert _judged(camera, mp.GraphCamera(camera.root, portals), points).worst > stress.LIMIT
    short = mp.GraphCamera(camera.root, camera.portals[:1])
    deep = points[camera.location(points) == 2]
    assert len(deep) and _judged(camera, short, deep).worst > stress.LIMIT
    nothing = mp.GraphCamera(camera.root, ends=[(0, 0, 1, -1e-3)])
    assert _judged(camera, nothing, points).missed > 4
    behind = -np.abs(points) * [1, 1, 1]
    assert _judged(camera, camera, behind).good()
    inside = CAMERAS["merge"]
    gap = np.array([[0.0, 0.0, 2.5], [0.01, 0.5, 2.6]])
    assert _judged(inside, inside, gap).good()
    assert _judged(inside, mp.GraphCamera(inside.root), gap).invented == 2


def test_distant_eyes():
    camera = stress.narrow_view(100.0, 0.3)
    assert camera.pieces_per_ray == 2
    pieces = camera.ray_pieces(np.array([[3.0, 4.0], [250.0, 250.0]]))
    assert pieces.valid.all() and np.allclose(pieces.direction[:, 0], pieces.direction[:, 1], atol=1e-15)
