"""The experiments of Rosen et al. 2011 in their quick form: rows, and figures that fit."""

import numpy as np
import pytest
from test_experiments import quick

from mpcam.experiments.rosen2011_fig17_fig19 import heated


def test_fig17_fig19(tmp_path):
    """Coarse steps save the same share of every mean, change next to nothing, and miss nothing."""
    report = quick("rosen2011-fig17-fig19", tmp_path)
    table = report.table("steps")
    assert [(row["scene"], row["walk"]) for row in table.rows[::2]] == [
        ("teapot, in waves", "march"),
        ("teapot, in a teapot", "march"),
        ("maze", "pieces"),
        ("maze", "march"),
    ]
    for without, coarse in zip(table.rows[::2], table.rows[1::2], strict=True):
        assert (without["coarse"], coarse["coarse"], without["fewer"]) == ("none", "6", 1.0)
        assert coarse["fewer"] == pytest.approx(without["mean"] / coarse["mean"])
        assert without["entering"] >= without["mean"] and without["largest"] > 2 * without["mean"]
        assert coarse["changed_percent"] <= 0.1 and without["changed_percent"] == 0
        assert abs(coarse["found_percent"] - without["found_percent"]) < 0.2
    maze = [row for row in table.rows if row["scene"] == "maze"]
    assert min(row["fewer"] for row in maze[1::2]) > 3 and min(row["found_percent"] for row in maze) > 95
    assert table.row(scene="teapot, in a teapot", coarse="6")["paper_mean"] == 48
    assert len(report.pictures) == 12


def test_colors_of_steps_rise_from_black_to_white():
    colors = heated(np.array([0, 1, 2, 10, 100, 1000]), 1000.0)
    np.testing.assert_array_equal(colors[[0, 1, -1]], [[0, 0, 0], [0, 0, 0], [1, 1, 1]])
    assert (np.diff(colors.sum(1))[1:] > 0).all() and (colors[:, 0] >= colors[:, 1]).all()
