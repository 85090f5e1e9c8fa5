"""The experiments on fits in their quick form."""

import numpy as np
import pytest
from test_experiments import quick

import mpcam as mp
from mpcam.experiments.fit_error_vs_triangles import EYE, uniform
from mpcam.experiments.fit_hou2006_fig6 import enough
from mpcam.experiments.hou2006_scenes import SHAPES


def test_errors_against_triangles(tmp_path):
    table = quick("fit-error-vs-triangles", tmp_path).table("errors")
    assert {row["kind"] for row in table.rows} == {"uniform", "simplified", "fitted"}
    by = {(row["kind"], row["triangles"] > 14): row for row in table.rows}
    assert len(by) == 6 and {row["reflector"] for row in table.rows} == {"sphere"}
    for kind in ("uniform", "simplified", "fitted"):
        assert by[kind, True]["rms"] < by[kind, False]["rms"] < by[kind, False]["far"]
        assert 18 < by[kind, True]["triangles"] <= 32
        assert by[kind, True]["frame_ms"] > 0 and "frame_ms" not in by[kind, False]
    assert by["fitted", True]["rms"] < 0.6 * by["simplified", True]["rms"] and by["fitted", True]["missed"] == 0


def test_pictures_by_fitted_camera_triangles(tmp_path):
    report = quick("fit-hou2006-fig6", tmp_path)
    rows = report.table("quality").rows
    assert [row["kind"] for row in rows] == ["decomposed", "fitted"] * 2 and {row["mirror"] for row in rows} == {
        SHAPES[0]
    }
    for before, after in (rows[:2], rows[2:]):
        assert before["triangles"] == after["triangles"] and after["rms"] < 0.7 * before["rms"]
        assert after["seconds"] > 0 and before["seconds"] is None and min(before["still_ms"], after["still_ms"]) > 0


def test_how_many_are_enough():
    def rows(kind, errors):
        return [{"mirror": "m", "kind": kind, "triangles": n, "flip": e, "psnr": -e} for n, e in errors]

    known = rows("decomposed", [(20, 0.8), (40, 0.4), (160, 0.1), (320, 0.026)])
    known += rows("fitted", [(20, 0.4), (80, 0.09), (160, 0.095), (320, 0.025)])
    assert enough(known, "m") == pytest.approx(0.5)  # neither the fewest nor those that are as good as any count
    far = [row | {"psnr": 100 * row["psnr"]} for row in known]
    assert enough(far, "m", "psnr") == pytest.approx(0.5)
    assert np.isnan(enough(rows("decomposed", [(20, 0.8)]) + rows("fitted", [(20, 0.4)]), "m"))


@pytest.mark.parametrize("many", [30, 104])
def test_uniform_ones_are_about_as_many(many):
    cams = uniform(mp.Surface.wave(), np.array(EYE), many)
    assert 0.6 * many < cams.count <= many
