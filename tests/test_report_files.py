"""The files of a comparison: written whole or not at all, and nothing of others touched."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from comparison_example import SIZE, comparison

from mpcam.comparison import output
from mpcam.comparison.metrics import flip_map
from mpcam.errors import InputError
from mpcam.io.images import read_camera, read_channels, read_image


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return comparison().write(tmp_path_factory.mktemp("report") / "out").parent


def test_all_files_are_written(folder):
    listed = json.loads((folder / "results.json").read_text(encoding="utf-8"))["files"]
    there = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    assert listed == there
    assert {
        "report.html",
        "results.csv",
        "pareto.png",
        "truth.exr",
        "images/truth.png",
        "images/cubemap-64.png",
        "images/vertex-level-0-difference.png",
    } <= set(there)
    base = comparison()
    assert base.truth_image is not None
    assert base.truth_depth is not None
    np.testing.assert_array_equal(read_image(folder / "truth.exr"), base.truth_image)
    np.testing.assert_array_equal(read_channels(folder / "truth.exr")["ray.distance"], base.truth_depth)
    assert read_camera(folder / "truth.exr") == base.camera
    assert read_image(folder / "pareto.png").shape[0] > 300
    difference = read_image(folder / "images" / "vertex-level-0-difference.png")
    expected = output.magma(flip_map(base.images["vertex level 0"], base.truth_image))
    np.testing.assert_allclose(difference, expected, atol=0.01)
    assert not read_image(folder / "images" / "raytrace-difference.png").any()


def test_a_failure_leaves_nothing_behind(tmp_path):
    broken = comparison("broken")
    images = dict(broken.images) | {"invert": np.full((SIZE, SIZE, 3), np.nan, np.float32)}
    with pytest.raises(InputError, match="NaN"):
        replace(broken, images=images).write(tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_a_failure_keeps_the_older_comparison(folder, tmp_path):
    target = tmp_path / "out"
    shutil.copytree(folder, target)
    (target / "notes.txt").write_text("mine", encoding="utf-8")
    before = {path: path.read_bytes() for path in target.rglob("*") if path.is_file()}
    broken = comparison("broken")
    images = {"invert": np.full((SIZE, SIZE, 3), np.nan, np.float32)}
    with pytest.raises(InputError):
        replace(broken, images=images).write(target)
    assert {path: path.read_bytes() for path in target.rglob("*") if path.is_file()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_only_our_own_files_are_replaced(folder, tmp_path):
    target = tmp_path / "out"
    shutil.copytree(folder, target)
    for name in ("notes.txt", "images/mine.png", "images/cubemap-64.txt"):
        (target / name).write_text("mine", encoding="utf-8")
    fewer = comparison("fewer")
    keep = [r for r in fewer.rows if r.method != "cubemap"]
    replace(fewer, rows=tuple(keep), images={r.label: fewer.images[r.label] for r in keep}).write(target)
    for name in ("notes.txt", "images/mine.png", "images/cubemap-64.txt"):
        assert (target / name).read_text(encoding="utf-8") == "mine"
    assert not (target / "images" / "cubemap-64.png").exists()
    assert (target / "images" / "hemicube-64.png").exists()
    assert json.loads((target / "results.json").read_text(encoding="utf-8"))["name"] == "fewer"


def test_a_list_of_files_from_elsewhere_removes_nothing(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    (tmp_path / "precious.png").write_text("x", encoding="utf-8")
    (target / "results.json").write_text(
        '{"files": ["../precious.png", "images/../../precious.png", 3]}', encoding="utf-8"
    )
    comparison("new").write(target)
    assert (tmp_path / "precious.png").exists()


def test_unusable_folders_are_named(tmp_path):
    (tmp_path / "file").write_text("x", encoding="utf-8")
    for name in ("file", "file/below"):
        with pytest.raises(InputError, match="file") as caught:
            output.check_output(tmp_path / name)
        assert "\n" not in str(caught.value)
