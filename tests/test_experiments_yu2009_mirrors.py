"""The city strip and the mirror spheres of Yu et al. 2009 in their quick form: scenes, rows, and figures that fit."""

import dataclasses

import numpy as np
import pytest
from test_experiments import quick

import mpcam as mp
from mpcam.experiments import yu2009_city
from mpcam.experiments import yu2009_paper_mirrors as paper
from mpcam.experiments.yu2009_butterfly import EYE, blossom, butterfly, butterfly_scene
from mpcam.experiments.yu2009_fig10 import cap_of
from mpcam.experiments.yu2009_seams import seam_jumps

# The scenes


@pytest.mark.parametrize("triangles", [550, 1_100, 2_200])
def test_the_butterfly_scenes_have_the_papers_triangles(triangles):
    mesh = butterfly_scene(triangles).mesh
    corners = mesh.vertices[mesh.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert mesh.triangle_count == triangles and area.min() > 1e-6
    assert butterfly("#ffffff").count == 36 and blossom("#ffffff").count == 20


def test_the_city_has_the_papers_triangles():
    mesh = yu2009_city.city()
    assert mesh.triangle_count == yu2009_city.TRIANGLES
    assert np.isfinite(mesh.vertices).all() and mesh.normals is not None and np.isfinite(mesh.normals).all()


def test_numbers_of_triangles_that_cannot_be_are_refused():
    with pytest.raises(mp.InputError, match="even number"):
        yu2009_city.city(15_001)
    with pytest.raises(mp.InputError, match="400 triangles or more"):
        butterfly_scene(100)


def test_the_strip_is_seen_through_two_slits():
    camera = yu2009_city.strip_camera()
    assert camera.kind == "cross_slit"
    assert len(camera.slits) == 2
    moved = yu2009_city.strip_camera(8.0)
    near, far = camera.project(np.array([0.0, 0.0, 3.0])), moved.project(np.array([8.0, 0.0, 3.0]))
    np.testing.assert_allclose(near.pixel, far.pixel, atol=1e-6)


# Seams


def test_jumps_at_seams():
    eye = mp.Pinhole.from_fov(400, 300, 0.7, camera_from_world=mp.look_at(EYE, (0, 0, 1.45)))
    plane = cap_of(60, quick=True)
    jumps = seam_jumps(plane, eye, 2.0)
    assert np.isfinite(jumps).mean() > 0.95
    assert 0.01 < np.nanmax(jumps) < 20
    # Unit lengths at the vertices are common to all triangles around: no seams.
    whole = dataclasses.replace(plane, ray_scale="unit")
    assert np.nanmax(seam_jumps(whole, eye, 2.0)) < 1e-9


# The experiments


def test_fig1(tmp_path):
    report = quick("yu2009-fig1", tmp_path)
    rows = report.table("strip").rows
    assert [row["method"] for row in rows] == ["invert", "two_pass, patch 5"]
    assert rows[0]["wrong_percent"] <= 0.1 < 100 > rows[1]["wrong_percent"]
    for row in rows:
        assert row["moving_ratio"] == pytest.approx(row["moving_ms"] / row["moving_trace_ms"])


def test_fig8(tmp_path):
    report = quick("yu2009-fig8", tmp_path)
    rows = report.table("spheres").rows
    by = {row["rays"]: row for row in rows if row["method"] == "invert"}
    assert by["general_linear"]["left_out"] > 0
    assert by["normals"]["ray_rms"] < by["directions"]["ray_rms"] < by["general_linear"]["ray_rms"]
    assert by["general_linear"]["seam_max"] > 0.1
    assert all(by[name]["seam_max"] < 1e-9 for name in ("directions", "continuous", "normals"))
    assert all(0 < row["flip"] < 0.5 for row in rows[1:])
    assert report.table("hits").row(method="two_pass, patch 6")["paper_fps"] == paper.FIG_8_FPS


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
