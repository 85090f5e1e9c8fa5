"""Choosing a decomposition: by number, angle and time, what is left out, and files of it in scenes."""

import dataclasses
import json
from typing import Any

import numpy as np
import pytest

import mpcam as mp
from mpcam.cli import main
from mpcam.errors import InputError
from mpcam.fitting.choose import sides_seen

BALL = mp.Surface.sphere(1.0).mesh(300)
POSE = mp.look_at((3, 1, 2.5), (0, 0, 0))
EYE = mp.Pinhole(97, 71, 90, 92, 48, 36, camera_from_world=POSE)
QUICK: Any = {"samples": 1500, "iterations": 6}
SCENE = """
[camera]
model = "pinhole"
size = [97, 71]
focal = [90, 92]
center = [48, 36]
eye = [3, 1, 2.5]
target = [0, 0, 0]

[mirror]
file = "ball.obj"
triangles = 30

[[mesh]]
builtin = "cube"
scale = 0.6
translate = [2.2, -0.8, 1.2]
"""


@pytest.fixture(scope="module")
def by_number():
    told = []
    found = mp.choose_decomposition(BALL, EYE, triangles=30, progress=told.append, **QUICK)
    assert told == [
        "30 camera triangles, decomposed",
        "30 camera triangles, fitted",
        "30 camera triangles, curved",
        "one general linear camera for all",
    ]
    return found


@pytest.fixture
def folder(tmp_path):
    lines = [f"v {x:.12f} {y:.12f} {z:.12f}" for x, y, z in BALL.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in BALL.faces + 1]
    (tmp_path / "ball.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def test_of_equally_many_the_fitted_ones_are_taken(by_number):
    best, other = by_number.best, by_number.others[-1]
    assert [one.kind for one in (best, *by_number.others)] == ["curved", "fitted", "decomposed"]
    assert best.camera.degree == 2 and best.angle < by_number.others[0].angle < 0.5 * other.angle
    assert 20 <= best.camera.count <= 30 and best.frame is None and best.seconds > 0
    for one in (best, other):
        off = 1e-3 * mp.ray_error(one.camera, BALL, EYE).angle_rms
        # What was not fitted lies anywhere in the pixels, and few rays at the rim decide.
        assert off == pytest.approx(one.angle, rel=1e-9) if one is other else 0.5 < off / one.angle < 1.5
    assert best.fit is not None and best.fit.camera is best.camera is by_number.camera and other.fit is None
    sides = np.asarray(best.camera.resolution)
    assert best.rays == sum(side * (side + 1) // 2 for side in sides.tolist())


def test_as_few_as_an_angle_allows(by_number):
    most = 0.8 * by_number.others[-1].angle
    found = mp.choose_decomposition(BALL, EYE, max_angle=most, **QUICK)
    assert found.best.kind in ("fitted", "curved") and all(one.angle <= most for one in (found.best, *found.others))
    decomposed = next(one for one in found.others if one.kind == "decomposed")
    assert decomposed.angle <= most and found.best.camera.count < 0.7 * decomposed.camera.count


def test_what_takes_too_long_is_left_out(monkeypatch):
    calls = []
    monkeypatch.setattr("mpcam.fitting.choose.LADDER", (12, 30, 60))

    def time_of(many):
        calls.append(len(many))
        return [1e-4 * cams.count for cams in many]

    found = mp.choose_decomposition(BALL, EYE, frame_time=40e-4, time_of=time_of, **QUICK)
    assert calls == [3, 2]
    assert found.best.kind == "curved" and 12 < found.camera.count <= 30 and (found.best.frame or 1) <= 40e-4
    assert [(one.frame or 0) > 40e-4 for one in found.others] == [False, False, False, True]
    with pytest.raises(InputError, match="frame_time=1e-05: the fastest of these takes 0.00"):
        mp.choose_decomposition(BALL, EYE, frame_time=1e-5, time_of=time_of, **QUICK)


def test_flat_mirrors_need_no_more_than_one_camera():
    flat = mp.Mesh(np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0.0)]), np.array([(0, 1, 2), (0, 2, 3)]))
    found = mp.choose_decomposition(flat, EYE, triangles=4, **(QUICK | {"iterations": 0}))
    assert found.single is not None and found.single.kind == "pinhole" and found.single_angle < 1e-6
    round_ = mp.choose_decomposition(mp.Surface.sphere(1.0).mesh(80), EYE, triangles=8, **(QUICK | {"iterations": 0}))
    assert round_.single is None and round_.single_angle == np.inf


def test_triangles_have_as_many_pixels_as_the_camera_has_there(by_number):
    cams = by_number.others[-1].camera
    pixel = np.asarray(EYE.project(cams.vertices).pixel)[:, 0]
    for side, face in zip(sides_seen(cams, EYE).tolist(), cams.faces, strict=True):
        a, b, c = pixel[face]
        legs = max(np.hypot(*(b - a)), np.hypot(*(c - a)), np.hypot(*(c - b)) / np.sqrt(2))
        (ux, uy), (vx, vy) = b - a, c - a
        assert side == max(np.ceil(min(legs, 1.5 * np.sqrt(abs(ux * vy - uy * vx)) + 1)) + 1, 2)
    near = mp.Pinhole(97, 71, 9e5, 9e5, 48, 36, camera_from_world=POSE)
    assert (
        sides_seen(cams, near).max() == 512 and sides_seen(cams, dataclasses.replace(EYE, fx=1e-3, fy=1e-3)).max() <= 3
    )


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, "give one of triangles, max_angle and frame_time, not none"),
        ({"triangles": 4, "max_angle": 0.1}, "not triangles and max_angle"),
        ({"max_angle": -1.0}, "max_angle=-1.0: give a finite number above 0"),
        ({"frame_time": 1.0}, "needs time_of="),
        ({"triangles": 0}, "triangles"),
    ],
)
def test_what_cannot_be_chosen_is_refused(settings, words):
    with pytest.raises(InputError, match=words):
        mp.choose_decomposition(BALL, EYE, **settings)


def test_the_command_writes_a_file_that_scenes_take(folder, capsys):
    output = folder / "fitted.npz"
    assert main(["fit", str(folder / "scene.toml"), "--output", str(output), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["best"]["kind"] == "curved" and told["best"]["triangles"] <= 30 and told["best"]["frame_ms"] > 0
    assert [one["kind"] for one in told["left_out"]] == ["fitted", "decomposed"] and told["single_camera"] is None
    saved = mp.read_fit(output)
    assert saved.camera.count == told["best"]["triangles"]

    fitted = folder / "fitted.toml"
    fitted.write_text(SCENE.replace("triangles = 30", 'triangles = 30\ncamera_triangles = "fitted.npz"'))
    scene = mp.load_scene(fitted).scene
    mirror = scene.mirror
    assert mirror is not None
    assert np.array_equal(mirror.camera_triangles.vertices, saved.camera.vertices)
    assert mp.ray_error(mirror.camera_triangles, BALL, EYE) == mp.ray_error(saved.camera, BALL, EYE)
    assert mp.Reflection(scene).cams is mirror.camera_triangles
    assert mp.Reflection(scene, triangles=8).cams is not mirror.camera_triangles

    fitted.write_text(fitted.read_text().replace("eye = [3, 1, 2.5]", "eye = [3, 1, 2.6]"))
    assert main(["render", str(fitted), "--output", str(folder / "x.png")]) == 2
    assert "bend rays of an eye at" in capsys.readouterr().err
    fitted.write_text(fitted.read_text().replace("fitted.npz", "none.npz"))
    assert main(["render", str(fitted), "--output", str(folder / "x.png")]) == 2
    assert "fitted.toml:13: mirror.camera_triangles" in capsys.readouterr().err
    with pytest.raises(InputError, match="mirror camera_triangles is a str: give CameraTriangles"):
        mp.Mirror(BALL, camera_triangles="fitted.npz")


def test_mistakes_on_the_command_line(folder, capsys):
    scene, output = str(folder / "scene.toml"), str(folder / "x.npz")
    for arguments, words in (
        (["--output", str(folder / "x.json")], "fits are written as .npz"),
        (["--output", output, "--triangles", "9", "--max-angle", "1deg"], "give one of them"),
        (["--output", output, "--budget-ms", "9", "--eye", "3,1,2"], "needs a picture to take the time of"),
        (["--output", output, "--max-angle", "-2"], "--max-angle -2: give an angle above 0"),
    ):
        assert main(["fit", scene, *arguments]) == 2
        assert words in capsys.readouterr().err
    assert not (folder / "x.npz").exists()
