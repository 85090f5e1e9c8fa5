"""The experiments of Rosen et al. 2011 in their quick form: rows, and figures that fit."""

import numpy as np
import pytest
from test_experiments import quick

from mpcam.experiments import rosen2011_occlusion_path as occlusion_path
from mpcam.experiments.rosen2011_fig17_fig19 import heated
from mpcam.experiments.rosen2011_scenes import statue_scene


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


def test_ambient_occlusion(tmp_path):
    """All rows by both measures; sides hold more than the output alone, and each set what its parts hold."""
    report = quick("rosen2011-ambient-occlusion", tmp_path)
    table = report.table("occlusion")
    assert len(table.rows) == len(occlusion_path.WAYS) * len(occlusion_path.SETTINGS) + 1
    for setting in occlusion_path.SETTINGS:
        base = table.row(setting=setting, way="output")
        assert base["less_error"] == base["less_flicker"] == 1
        for row in table.rows:
            if row["setting"] == setting:
                assert row["less_error"] == pytest.approx(base["error"] / row["error"])
                assert 0.01 < row["error"] < 0.12 and 0 < row["flicker"] < 0.06
                assert ("occlusion_ms" in row) == (setting != "dense")
    assert table.row(way="truth")["error"] == 0
    assert table.row(setting="fine", way="graph")["paper_penalty"] == 25
    shares = {row["buffers"]: row["held_percent"] for row in report.table("held").rows}
    assert 40 < shares["output"] < shares["output + graph"] < shares["output + two views"] < 95
    assert shares["graph"] < shares["output + graph"] < shares["output + graph, split before"]


def test_flicker_counts_fixed_points():
    """A value that hangs on the place in the world stays; one that hangs on the pixel moves."""
    scene = statue_scene(8_000, 0.0, 64, 64)
    views = occlusion_path.Views(scene.mesh, 64)
    flicker, wanted = None, None
    for time in (0.0, 0.02):
        views.aim(time)
        hits = views.fronts["output"].frame()
        found = {
            ("", "still"): np.where(hits.mask, np.sin(hits.points[..., 2]), 0.0),
            ("", "screen"): np.broadcast_to(np.arange(64) / 64, (64, 64)),
        }
        wanted = hits.mask if wanted is None else wanted
        flicker = occlusion_path.Flicker(hits, wanted) if flicker is None else flicker
        flicker.add(hits, found)
    assert flicker is not None
    assert flicker.changes["", "still"][0] < 0.02 < 2 * flicker.changes["", "screen"][0]


def test_table1(tmp_path):
    report = quick("rosen2011-table1", tmp_path)
    assert [(row["fine"], row["coarse"]) for row in report.table("output").rows] == [(1.0, 6), (0.25, 6)]
    coarse = report.table("coarse").rows
    assert [row["coarse"] for row in coarse] == [3, 6, 9, 12]
    assert [row["paper_slower"] for row in coarse] == pytest.approx([1, 18.2 / 31, 18.2 / 37.2, 18.2 / 39.8])
    for name in ("output", "image", "coarse"):
        for row in report.table(name).rows:
            assert 0 < row["ms"] < 1e4 and row["ratio"] > 0 and row["steps"] > 1 and row["spread"] >= 0
    images = report.table("image").rows
    assert images[1]["rmse"] < images[0]["rmse"] and images[1]["steps"] > images[0]["steps"]
    # Depth and three colors, a patch of four numbers, and ranges of two for each square and for squares of squares.
    memory = report.table("memory").rows[1]
    assert 4 * 4 + 16 < memory["bytes_per_pixel"] < 4 * 4 + 16 + 8 / 4
    assert memory["bytes_per_ray"] == 6 * 4 + 1 + 1 + 4 + 8 + 4 + 1 + 4
