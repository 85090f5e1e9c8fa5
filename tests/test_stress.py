"""The stress suites in short: nothing missed, nothing invented; and each of their oracles can fail."""

import dataclasses
import json

import mpmath
import numpy as np
import pytest

import mpcam as mp
from mpcam.cli import main
from mpcam.stress import camera_triangle_bounds, distant, models, suite
from mpcam.stress.exact import DIGITS
from mpcam.stress.inputs import central_points, pixels
from mpcam.stress.lenses import domain_row, end_of_domain, exact_lens
from mpcam.stress.projections import image_rows, images, judge_images, judge_rays, ray_rows, rays
from mpcam.stress.regions import OUTLINE, bound_rows
from mpcam.stress.report import LIMIT, StressRow, as_dicts, joined, kind_of, run_cases

CURVED = (
    "radial",
    "kannala-brandt",
    "double-sphere",
    "unified-omni",
    "angle-polynomial",
    "scaramuzza",
    "field-of-view",
)
STRAIGHT = ("pinhole", "orthographic")


def cases(names) -> list[tuple[str, str]]:
    """Every camera of some suites."""
    return [(model, name) for model in names for name in suite(model).cameras()]


def lens(model: str, name: str):
    """A camera of a suite, its definition at 50 digits, and the end of its domain."""
    chosen = suite(model)
    camera = chosen.cameras()[name]
    definition = chosen.definition(camera)
    end = end_of_domain(definition)
    return camera, exact_lens(camera, definition, end), end


def test_every_model_has_a_suite():
    classes = [value for value in vars(mp.cameras).values() if isinstance(value, type) and issubclass(value, mp.Camera)]
    assert len(models()) == len(set(classes) - {mp.Camera})
    for model in models():
        chosen = suite(model)
        assert chosen.LIMIT == LIMIT and callable(chosen.run)


@pytest.mark.parametrize(("model", "name"), cases(CURVED))
def test_lenses_pass(model, name):
    camera, exact, end = lens(model, name)
    rows = [
        domain_row(name, camera, end),
        *image_rows(name, camera, exact, central_points(camera, float(end.limit), 1)),
        *ray_rows(name, camera, exact, pixels(camera, camera.domain.image_radius, 1)),
    ]
    assert [row for row in rows if not row.good()] == []
    assert sum(row.worst > 0 for row in rows) >= 8


@pytest.mark.parametrize(("model", "name"), cases(STRAIGHT))
def test_cameras_with_straight_lines_pass(model, name):
    chosen = suite(model)
    camera = chosen.cameras()[name]
    exact, points = chosen.definition(camera), central_points(camera, 0.5 * np.pi, 5)
    rows = image_rows(name, camera, exact, points | {"out of range": chosen.out_of_range(20)})
    rows += ray_rows(name, camera, exact, pixels(camera, None, 5))
    assert [row for row in rows if not row.good()] == []


@pytest.mark.parametrize("model", [*CURVED, "pinhole"])
def test_outlines_hold(model):
    for name, camera in list(suite(model).cameras().items())[::4]:
        row = bound_rows(name, camera, 3000, OUTLINE)[0]
        assert row.good() and row.count == 3000, row


def test_all_bounds_of_radial_cameras_hold():
    radial = suite("radial")
    camera = radial.cameras()["paraboloid 270"]
    rows = bound_rows("x", camera, 2000, radial.bounds(camera))
    assert len(rows) == 4 and all(row.good() for row in rows)


@pytest.mark.parametrize("model", models())
def test_distant_eyes_miss_nothing(model):
    sure, missed, invented = distant.distant(suite(model).narrow_view(1000.0, 0.3), 1000.0)
    assert (missed, invented) == (0, 0)
    assert sure > 0.99 * distant.SIZE**2


def test_camera_triangles_pass():
    for kind in camera_triangle_bounds.KINDS:
        for row in camera_triangle_bounds.bound_rows(kind, 1):
            assert row.good() and row.count == camera_triangle_bounds.FACES * camera_triangle_bounds.TRIANGLES, row


def test_parallel_rays_have_no_waist():
    pairs = 8 * camera_triangle_bounds.FACES * camera_triangle_bounds.TRIANGLES
    for row in camera_triangle_bounds.bound_rows("parallel", pairs):
        assert row.good(), row


def test_a_wrong_image_or_ray_would_be_found():
    """A principal point that is off by 1e-9 pixels, answers where there is none, and none where there is one."""
    camera, exact, end = lens("double-sphere", "real")
    off = dataclasses.replace(camera, cx=camera.cx + 1e-9)
    points = {"x": central_points(camera, float(end.limit), 10)["in the image"]}
    assert image_rows("x", off, exact, points)[0].worst > LIMIT
    places = {"x": pixels(camera, camera.domain.image_radius, 10)["near the rim"]}
    assert ray_rows("x", off, exact, places)[0].worst > LIMIT

    point = np.array([[1.0, 0, 0.05], [0.1, 0, -1.0]])
    pixel, depth, valid = images(camera, point, "float64")
    assert list(valid) == [True, False]
    judged = judge_images("x", "x", "float64", exact, point, (pixel, depth, ~valid))
    assert (judged.missed, judged.invented) == (1, 1)
    far = judge_images("x", "x", "float64", exact, point, (pixel, depth * (1 + 1e-12), valid))
    assert far.worst > LIMIT

    pixel = np.array([[200.0, 300.0], [-5000.0, 0.0]])
    origin, direction, valid = rays(camera, pixel, "float64")
    judged = judge_rays("x", "x", "float64", exact, pixel, (origin, direction, ~valid))
    assert (judged.missed, judged.invented) == (1, 1)
    longer = judge_rays("x", "x", "float64", exact, pixel, (origin, direction * (1 + 1e-12), valid))
    assert longer.worst > LIMIT


def test_a_wrong_domain_would_be_found():
    camera, _, end = lens("kannala-brandt", "folds in the image")
    assert domain_row("x", camera, end).good()
    narrower = dataclasses.replace(camera, max_angle=camera.limit - 1e-13)
    assert domain_row("x", narrower, end).worst > LIMIT
    endless = mp.UnifiedOmni(64, 64, 30, 30, 32, 32, 0.0)
    assert domain_row("x", endless, end).missed == 1


def test_the_other_branch_of_a_fold_would_be_found():
    """Its pixel is right, but the ray lies beyond the domain."""
    camera, exact, end = lens("kannala-brandt", "folds in the image")
    definition = suite("kannala-brandt").definition(camera)
    with mpmath.workdps(DIGITS):
        values = [mpmath.mpf(k) for k in camera.k]
        r = mpmath.mpf(0.99) * end.rim
        theta = mpmath.findroot(lambda t: definition.rim(t, *values) - r, (end.limit, 2 * end.limit), solver="anderson")
    pixel = np.array([[camera.cx + camera.fx * float(r), camera.cy]])
    direction = np.array([[float(mpmath.sin(theta)), 0, float(mpmath.cos(theta))]])
    judged = judge_rays("x", "x", "float64", exact, pixel, (0 * direction, direction, [True]))
    assert judged.invented == 1


def test_a_bound_too_small_would_be_found(monkeypatch):
    camera = suite("pinhole").cameras()["90 degrees"]
    whole = type(camera).local_bound

    def half(self, a, b, c):
        box = whole(self, a, b, c)
        return box._replace(high=0.5 * (box.low + box.high))

    monkeypatch.setattr(type(camera), "local_bound", half)
    assert bound_rows("x", camera, 500)[0].missed > 50


def test_a_lost_pixel_would_be_found(monkeypatch):
    from mpcam.rendering import general
    from mpcam_kernels.ray_cones import Cone

    narrow = Cone.may_meet
    general._pipeline.cache_clear()
    monkeypatch.setattr(Cone, "may_meet", lambda cone, ball: narrow(cone, type(ball)(*ball.xyz, 0.1 * ball.w)))
    missed = {row.case: row.missed for row in camera_triangle_bounds.bound_rows("positive", 1)}
    far = distant.distant(suite("camera-triangles").narrow_view(100.0, 0.3), 100.0)
    general._pipeline.cache_clear()
    assert missed["bounds, tight, positive"] > 10
    assert far[1] > 1000


def test_rows_are_json_and_add_up():
    rows = [
        StressRow("a", "images, x", "float32", 3, float("nan"), 0, 1),
        StressRow("b", "images, y", "float32", 4, 2.0, 1, 0),
    ]
    assert as_dicts("m", rows)[0]["worst"] is None
    assert as_dicts("m", rows)[1]["model"] == "m"
    assert joined(rows, kind_of) == [StressRow("b", "images", "float32", 7, 2.0, 1, 1)]
    told = []
    assert run_cases([("x", lambda: rows)], lambda *step: told.append(step)) == rows
    assert told == [(0, 1, "x"), (1, 1, "done")]


def test_on_the_command_line(capsys, monkeypatch):
    assert main(["stress", "orthographic", "--triangles", "10", "--points", "1", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert {row["model"] for row in rows} == {"orthographic"}
    assert {row["camera"] for row in rows} >= set(suite("orthographic").cameras())
    monkeypatch.setattr("mpcam.stress.models", lambda: ["pinhole", "orthographic"])
    assert main(["stress", "--triangles", "10", "--points", "1"]) == 0
    text = capsys.readouterr().out
    assert "pinhole" in text and "orthographic" in text and "distant eyes" in text
    monkeypatch.setattr(suite("pinhole"), "run", lambda **_: [StressRow("a", "images, x", "float64", 1, 99.0, 0, 0)])
    assert main(["stress", "pinhole"]) == 1
    assert "what failed" in capsys.readouterr().out


def test_mistakes_on_the_command_line(capsys):
    assert main(["stress", "fisheye"]) == 2
    assert main(["stress", "radial", "--triangles", "0"]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2
    assert "allowed are" in lines[0] and "double-sphere" in lines[0]
    assert "triangles=0: at least 1 is needed" in lines[1]
