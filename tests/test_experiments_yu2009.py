"""The experiments of Yu et al. 2009 in their quick form: scenes, cameras, rows, and figures that fit."""

import numpy as np
import pytest
from PIL import Image
from test_experiments import quick

import mpcam as mp
from mpcam.experiments import yu2009_fig5, yu2009_paper, yu2009_views
from mpcam.experiments.yu2009_measures import holes, seam, seam_pixels
from mpcam.experiments.yu2009_scenes import BOX, CYLINDER, SPHERE, cow_scene, solids_scene, teapot_scene

# Scenes and cameras


def test_the_scenes_have_the_papers_triangles():
    assert solids_scene().mesh.triangle_count == 2 + 4 * SPHERE + 3 * CYLINDER + 3 * BOX
    for name, scene in {"cow": cow_scene(), "teapot": teapot_scene()}.items():
        assert scene.mesh.triangle_count == pytest.approx(yu2009_paper.TRIANGLES[name], rel=0.02)


def test_solids_and_cow_face_outwards():
    for scene in (solids_scene(), cow_scene()):
        mesh = scene.mesh
        assert mesh.normals is not None and np.isfinite(mesh.normals).all()
        assert ((mesh.normals[mesh.faces].mean(1) * mesh.face_normals).sum(-1) > 0).mean() > 0.99


def test_the_first_camera_is_a_cross_slit_with_both_slits_as_given():
    camera = yu2009_fig5.cross_slit(80, 60)
    assert camera.kind == "cross_slit"
    directions = [slit.direction for slit in camera.slits]
    assert abs(directions[0] @ directions[1]) < 1e-12
    # The ground is seen from above: its far border lies higher in the image.
    near, far = (camera.project(np.array([0.0, y, 0.0])) for y in (-4.0, 4.0))
    assert near.valid.all() and far.valid.all() and near.pixel[0, 1] > far.pixel[0, 1]


def test_a_panorama_sees_the_cow_from_all_sides():
    camera = yu2009_views.cow_around(96, 72, 8)
    ways = camera.ray(np.stack(np.broadcast_arrays(np.arange(96) + 0.5, 36.0), -1)).direction[:, :2]
    turn = np.unwrap(np.arctan2(ways[:, 1], ways[:, 0]))
    assert (np.diff(turn) > 0).all() or (np.diff(turn) < 0).all()
    assert abs(turn[-1] - turn[0]) == pytest.approx(2 * np.pi * 95 / 96, rel=0.02)
    half = yu2009_views.teapot_around(96, 72, 8).ray(np.array([[0.0, 36.0], [96.0, 36.0]])).origin[:, :2]
    assert abs(np.degrees(np.arccos((half[0] @ half[1]) / 3.2**2))) == pytest.approx(90.0, abs=0.1)


def test_the_view_from_above_is_straight_in_the_middle_and_looks_inwards_all_around():
    camera = yu2009_views.teapot_top(80, 60, 8)
    ray = camera.ray(np.array([[40.0, 30.0], [60.0, 30.0], [40.0, 5.0], [10.0, 50.0]]))
    np.testing.assert_allclose(ray.direction[0], (0, 0, -1), atol=1e-9)
    assert ((ray.direction[1:, :2] * ray.origin[1:, :2]).sum(-1) < 0).all()
    assert ray.origin[1, 0] > 0 and ray.origin[2, 1] > 0  # x to the right, y up
    assert seam(camera)["degrees"] < 1e-6


@pytest.mark.parametrize("angle", [12.0, 60.0])
def test_the_hinge_has_no_seam(angle):
    camera = yu2009_views.hinged(160, 120, angle)
    jump = seam(camera)
    assert jump["degrees"] < 1e-6 and jump["units"] < 1e-7
    assert seam_pixels(camera, (1.0, 2.0)) < 1e-9
    first, second = (camera.piece(k) for k in range(2))
    assert first.kind == second.kind == "cross_slit"


def test_a_seam_is_found():
    path = [[-1.0, 0, 1], [0.5, 0, 1], [1.5, 0.4, 1]]
    camera = mp.GeneralLinears.along_path(path, [[0.3, 2, 0], [1.3, 2, 0]], 60, 40)
    assert seam(camera)["degrees"] > 1 and seam_pixels(camera, (1.0,)) > 1


def test_holes_are_uncovered_pixels_without_background_beside():
    expected = np.ones((8, 8), bool)
    expected[:, 0] = False
    found = expected.copy()
    assert holes(found, expected) == 0
    found[3, 1] = False  # at the outline
    assert holes(found, expected) == 0
    found[5, 4:6] = False
    assert holes(found, expected) == 2


# The experiments


def test_fig5(tmp_path):
    report = quick("yu2009-fig5", tmp_path)
    rows = report.table("methods").rows
    patches = [row for row in rows if row["family"] == "two_pass"]
    assert [row["holes"] for row in patches] == [0, 0, 0]
    errors = [row["rmse"] for row in patches]
    assert errors == sorted(errors, reverse=True) and errors[-1] < 0.5 * errors[0]
    invert = report.table("methods").row(method="invert")
    assert invert["wrong_percent"] <= 0.02 and invert["holes"] == 0
    for row in rows:
        assert row["moving_ratio"] == pytest.approx(row["moving_ms"] / rows[0]["moving_ms"])


def test_fig6_and_fig7(tmp_path):
    report = quick("yu2009-fig6-fig7", tmp_path)
    rows = report.table("views").rows
    assert [row["view"] for row in rows] == ["cow", "teapot", "teapot", "teapot from above"]
    assert [row["pieces"] for row in rows[:3]] == [3, 3, 6]
    for row in rows:
        assert row["invert_wrong_percent"] <= 0.02 and row["two_pass_wrong_percent"] < 0.5
        assert row["two_pass_holes"] == 0 and row["seam_degrees"] < 1e-6
        assert row["two_pass_ratio"] == pytest.approx(row["two_pass_moving_ms"] / row["raytrace_moving_ms"])


def test_fig9(tmp_path):
    report = quick("yu2009-fig9", tmp_path)
    frames, times = report.table("frames").rows, report.table("times").rows
    assert [row["angle"] for row in frames] == pytest.approx([12, 36, 60, 36])
    for row in frames:
        assert row["invert_wrong_percent"] <= 0.02 and row["two_pass_holes"] == 0
        assert row["seam_degrees"] < 1e-6 and row["seam_pixels"] < 1e-9
    assert all(row["gain"] == pytest.approx(row["anew_ms"] / row["aim_ms"]) for row in times)
    with Image.open(tmp_path / "yu2009-fig9" / "images" / "film.gif") as film:
        assert getattr(film, "n_frames", 1) == len(frames) and film.size == (120, 90)
        still = report.pictures[0].frames[0]
        shown = np.asarray(film.convert("RGB")) / 255
    assert np.abs(shown - mp.comparison.metrics.display(still)).mean() < 0.02
