"""The city strip and the mirror spheres of Yu et al. 2009 in their quick form: scenes, rows, and figures that fit."""

import pytest
from test_experiments import quick

import mpcam as mp
from mpcam.experiments import yu2009_paper_mirrors as paper


def test_fig10(tmp_path):
    report = quick("yu2009-fig10", tmp_path)
    (row,) = report.table("cameras").rows
    assert 0 < row["cameras"] <= row["wanted"]
    assert row["invert_fps"] == pytest.approx(1e3 / row["invert_ms"])
    (row,) = report.table("scenes").rows
    assert row["paper_fps"] == paper.FIG_10_SCENES[row["scene_triangles"], row["patch"]]
    assert row["invert_wrong"] <= 0.1
    costs = report.table("curve").rows
    assert costs[1]["cameras"] > 3 * costs[0]["cameras"]
    assert costs[1]["pixels_k"] == pytest.approx(costs[0]["pixels_k"], rel=0.2)
