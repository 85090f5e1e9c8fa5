"""Single-pole occlusion cameras at their limits: boxes at the axis, and the stress suite in short."""

import numpy as np
import pytest
from catalog import triangles
from kit import extent
from single_poles import make

from mpcam.stress import single_pole_occlusion as suite


def near_the_axis(camera, count, seed):
    """Triangles around the pole's axis, across it, with a corner or an edge on it, and across the planes of z."""
    rng = np.random.default_rng(seed)
    z = rng.choice([0.5, 1.0, 2.0, 3.0, 6.0], (count, 3)) * rng.choice([1.0, 1.0, 1.0, -0.3], (count, 3))
    z += rng.choice([0, 1.0], (count, 3)) * rng.normal(size=(count, 3)) * 0.2
    offset = rng.normal(size=(count, 3, 2)) * 10.0 ** rng.uniform(-6, 0, (count, 1, 1))
    offset[rng.random((count, 3)) < 0.15] = 0.0
    offset[rng.random((count, 3)) < 0.1, 1] = 0.0
    pole = np.array([(camera.pole[0] - camera.cx) / camera.fx, (camera.pole[1] - camera.cy) / camera.fy])
    return np.concatenate([(pole + offset) * z[..., None], z[..., None]], -1)


@pytest.mark.parametrize("changes", [{}, {"pole": (45.0, 33.0), "shift_near": 0.0}, {"pole": (300.0, -90.0)}])
def test_boxes_hold_triangles_at_the_axis(changes):
    camera = make(**changes)
    corners = near_the_axis(camera, 700, 7)
    low, high, some = extent(camera, corners)
    box = camera.bound(corners)
    assert (box.valid >= some).all() and some.mean() > 0.8
    slack = 1e-9 * np.maximum(1, np.maximum(np.abs(low), np.abs(high)))
    assert (box.low <= low + slack)[some].all() and (box.high >= high - slack)[some].all()


def test_boxes_are_tight():
    """For small triangles nearly exact; for large ones not much more than what their points need."""
    camera = make()
    corners = triangles(700, seed=8) + [0, 0, 3.0]
    corners = corners[(corners[..., 2] > 0.3).all(1)]
    low, high, some = extent(camera, corners)
    box = camera.bound(corners)
    excess = (box.high - box.low) - (high - low)
    small = some & ((high - low).max(1) < 4)
    part = (excess / (high - low).max(1, keepdims=True))[small]
    assert small.sum() > 200 and np.median(part) < 0.1 and np.percentile(part, 95) < 0.6
    assert np.percentile(excess[some], 95) < camera.shift_far
    assert not camera.bound(corners * [1, 1, -1]).valid.any()


# The stress suite


@pytest.mark.parametrize("name", list(suite.cameras())[1::4])
def test_the_stress_suite_passes(name):
    camera = suite.cameras()[name]
    rows = suite.image_rows(name, camera, 1) + suite.ray_rows(name, camera, 1)
    assert [row for row in rows if not row.good()] == []
    assert sum(row.worst > 0 for row in rows) > 15


def test_its_oracle_notices():
    camera = suite.cameras()["usual"]
    points, pixels = suite.points(camera, 2)["in the range"], suite.pixels(camera, 2)
    pixel, depth, valid = suite.images(camera, points, "float64")

    def judged(pixel, depth, valid):
        return suite.judge_images("", "", "float64", camera, points, (pixel, depth, valid))

    assert judged(pixel, depth, valid).good()
    assert judged(pixel * (1 + 1e-12), depth, valid).worst > suite.LIMIT
    assert judged(pixel, depth * (1 + 1e-12), valid).worst > suite.LIMIT
    assert judged(pixel, depth, ~valid).missed == 2
    behind = suite.points(camera, 2)["behind"]
    assert suite.judge_images("", "", "float64", camera, behind, (pixel, depth, valid)).invented == 2

    going, ending = pixels["that go on"], pixels["that end"]
    for place, change, worst in (
        (0, lambda x: x * (1 + 1e-12), True),
        (1, lambda x: x * (1 + 1e-12), True),
        (3, lambda x: x + 1e-11, True),
        (4, lambda x: ~x, False),
    ):
        pieces, middle = suite.ray_pieces(camera, going, "float64"), suite.rays(camera, going, "float64")
        assert suite.judge_rays("", "", "float64", camera, going, pieces, middle).good()
        changed = [*pieces[1]]
        changed[place] = change(changed[place])
        row = suite.judge_rays("", "", "float64", camera, going, [pieces[0], tuple(changed), pieces[2]], middle)
        assert row.worst > suite.LIMIT if worst else row.missed == 2, (place, row)
    pieces, middle = suite.ray_pieces(camera, ending, "float64"), suite.rays(camera, ending, "float64")
    third = [*pieces[2][:4], np.ones(2, bool)]
    assert suite.judge_rays("", "", "float64", camera, ending, [*pieces[:2], tuple(third)], middle).invented >= 2
