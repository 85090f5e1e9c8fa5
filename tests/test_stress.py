"""The stress suite in short: nothing missed, nothing invented; and it can fail."""

import dataclasses

import numpy as np

from mpcam.cli import main
from mpcam.stress import camera_triangles, radial
from mpcam.stress.report import Case, as_dicts


def test_radial_cameras_pass():
    for name in ("cosine_sphere", "paraboloid 270"):
        camera = radial.cameras()[name]
        for case in [*radial.projection_cases(name, camera, 20), *radial.bound_cases(name, camera, 2000)]:
            assert case.good(radial.LIMIT), case


def test_a_wrong_projection_would_be_found(monkeypatch):
    camera = radial.cameras()["equisolid"]
    off = dataclasses.replace(camera, cx=camera.cx + 1e-9)
    exact = radial._exact
    monkeypatch.setattr(radial, "_exact", lambda _, point: exact(camera, point))
    cases = radial.projection_cases("equisolid", off, 10)
    assert any(case.worst > radial.LIMIT for case in cases if case.precision == "float64")
    narrow = dataclasses.replace(camera, fov=camera.fov - 0.2)
    monkeypatch.setattr(radial, "_exact", exact)
    judged = radial._judged(
        "x", "x", "float64", camera, np.array([[1.0, 0, 0.05]]), np.array([[0.0, 0.0]]), [False], 1e-16
    )
    assert judged.missed == 1
    judged = radial._judged(
        "x", "x", "float64", narrow, np.array([[1.0, 0, 0.05]]), np.array([[0.0, 0.0]]), [True], 1e-16
    )
    assert judged.invented == 1


def test_a_box_too_small_would_be_found(monkeypatch):
    camera = radial.cameras()["equidistant"]
    whole = type(camera).local_bound

    def half(self, a, b, c):
        box = whole(self, a, b, c)
        return box._replace(high=0.5 * (box.low + box.high))

    monkeypatch.setattr(type(camera), "local_bound", half)
    assert radial.bound_cases("equidistant", camera, 500)[0].missed > 50


def test_camera_triangles_pass():
    from mpcam.stress import camera_triangle_bounds as bounds

    for kind in bounds.KINDS:
        for case in bounds.bound_cases(kind, 1):
            assert case.good(camera_triangles.LIMIT) and case.count == bounds.FACES * bounds.TRIANGLES, case


def test_parallel_rays_have_no_waist():
    from mpcam.stress import camera_triangle_bounds as bounds

    for case in bounds.bound_cases("parallel", 8 * bounds.FACES * bounds.TRIANGLES):
        assert case.good(camera_triangles.LIMIT), case


def test_a_lost_pixel_would_be_found(monkeypatch):
    from mpcam.rendering import general
    from mpcam.stress import camera_triangle_bounds as bounds
    from mpcam_kernels.ray_cones import Cone

    narrow = Cone.may_meet
    general._pipeline.cache_clear()
    monkeypatch.setattr(Cone, "may_meet", lambda cone, ball: narrow(cone, type(ball)(*ball.xyz, 0.5 * ball.w)))
    found = {case.case: case.missed for case in bounds.bound_cases("positive", 1)}
    general._pipeline.cache_clear()
    assert found["tight, positive"] > 10


def test_rows_are_json():
    row = as_dicts([Case("a", "b", "float32", 3, float("nan"), 0, 1)])[0]
    assert row["worst"] is None
    assert row["invented"] == 1


def test_mistakes_on_the_command_line(capsys):
    assert main(["stress", "pinhole"]) == 2
    assert main(["stress", "radial", "--triangles", "0"]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2
    assert "allowed are radial" in lines[0]
    assert "at least 1 of each" in lines[1]
