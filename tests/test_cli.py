"""The command line: what it prints, what it returns, and that mistakes cost one line and status 2."""

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

import mpcam
from mpcam.cameras.serialize import camera_to_json
from mpcam.cli import main
from mpcam.comparison import driver

COMMANDS = ("compare", "render", "project", "experiment", "doctor")


def start(*arguments: str, **options) -> subprocess.Popen:
    command = [sys.executable, "-m", "mpcam", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def test_help_names_every_command(capsys):
    for arguments in ([], ["--help"]):
        assert main(arguments) == 0
        out = capsys.readouterr().out
        assert all(name in out for name in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command(command, capsys):
    assert main([command, "--help"]) == 0
    out = capsys.readouterr().out
    assert f"mpcam {command}" in out
    assert "--no-" not in out
    if command != "render":
        assert "--json" in out


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == mpcam.__version__


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("frobnicate", "compare, render, decompose, fit, caustics, surround, project"),
        ("render", "SCENE"),
        ("render cube", "--output"),
        ("render cube --output a.png --frobnicate", "--frobnicate"),
        ("render cube --output a.gif", ".png"),
        ("render cube --output a.png --size 0", "640x480"),
        ("render cube --output a.png --size 64xx64", "640x480"),
        ("render cube --output a.png --projection mercator", "paraboloid"),
        ("render cube --output a.png --method magic", "invert"),
        ("render cube --output a.png --shading magic", "normal"),
        ("render cube --output a.png --level many", "--level"),
        ("render no-such-scene --output a.png", "facade"),
        ("render cube --output no-such-folder/a.png", "no-such-folder"),
        ("compare", "--demo"),
        ("compare cube --demo", "--demo"),
        ("compare --demo --methods invert", "--demo"),
        ("compare --demo --size 64x32", "square"),
        ("compare cube --methods magic", "invert"),
        ("compare cube --repeats 0", "repeats"),
        ("compare cuba", "cube"),
        ("project cube", "POINTS"),
        ("project --jsn cube no-such-file", "--jsn is no option"),
        ("project cube no-such-file", "no-such-file"),
        ("project no-such-camera.json no-such-file", "no-such-camera.json"),
        ("doctor --jsn", "--json"),
    ],
)
def test_mistakes_cost_one_line(arguments, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("mpcam: ")
    assert err.count("\n") == 1
    assert said in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("points", ["x,y,z\n0,0,0.5\n1e9,0,0\nnan,0,0\n", "# points\n0 0 .5\n\n1e9;0;0; note\nnan 0 0"])
def test_project_prints_a_row_per_point(points, tmp_path, capsys):
    camera = mpcam.Radial.equidistant(64, 48, camera_from_world=mpcam.look_at((3, 0, 0), (0, 0, 0)))
    (tmp_path / "camera.json").write_text(camera_to_json(camera))
    (tmp_path / "points.csv").write_text(points)
    arguments = ["project", str(tmp_path / "camera.json"), str(tmp_path / "points.csv")]
    assert main(arguments) == 0
    header, *rows = [line.split(",") for line in capsys.readouterr().out.splitlines()]
    assert header == ["point", "u", "v", "depth", "valid"]
    expected = camera.project(np.array([0, 0, 0.5]))
    assert rows[0] == ["0", *map(str, (*map(float, expected.pixel[0]), float(expected.depth[0]))), "1"]
    assert rows[1][4] == "0"  # behind the camera
    assert rows[2] == ["2", "", "", "", "0"]
    assert main([*arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer[0] == [dict(zip(("u", "v", "depth"), map(float, rows[0][1:4]), strict=True))]
    assert answer[1:] == [[None], [None]]


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ("", "no points"),
        ("x,y,z\n", "no points"),
        ("0,0,0\n1,2\n", ":2: '1,2' is too short"),
        ("1,2,3\na,b,c\n", ":2: 'a,b,c'"),
    ],
)
def test_bad_points_are_named_by_line(points, said, tmp_path, capsys):
    path = tmp_path / "points.csv"
    path.write_text(points)
    assert main(["project", "cube", str(path)]) == 2
    assert said in capsys.readouterr().err


def test_project_reads_standard_input():
    child = start("project", "cube", "-", stdin=subprocess.PIPE)
    out, err = child.communicate("0 0 0\n", timeout=60)
    assert (child.returncode, err) == (0, "")
    assert out.splitlines()[1].startswith("0,256.0,256.0,")


def test_render_png_and_exr(tmp_path, capsys):
    for name in ("a.png", "a.exr"):
        arguments = ["render", "cube", "--output", str(tmp_path / name), "--size", "48x32", "--shading", "normal"]
        assert main(arguments) == 0
        assert mpcam.read_image(tmp_path / name).shape == (32, 48, 3)
    assert capsys.readouterr().out == ""
    camera = mpcam.read_camera(tmp_path / "a.exr")
    assert isinstance(camera, mpcam.Radial)
    assert (camera.width, camera.height, camera.radius) == (48, 32, 16)
    depth = mpcam.read_channels(tmp_path / "a.exr")["ray.distance"]
    hits = mpcam.rasterize(camera, mpcam.builtin_mesh("cube"))
    np.testing.assert_array_equal(depth, hits.depth)
    assert np.isfinite(depth).any()


def test_image_and_scene_give_project_its_camera(tmp_path, capsys):
    (tmp_path / "points.txt").write_text("0.1 0.2 0.3\n")
    target = str(tmp_path / "cube.exr")
    assert main(["render", "cube", "--output", target, "--projection", "equisolid"]) == 0
    rows = []
    for source in (target, "cube"):
        assert main(["project", source, str(tmp_path / "points.txt")]) == 0
        rows.append(capsys.readouterr().out.splitlines()[1].split(","))
    assert rows[0][3:] == rows[1][3:]  # the same depth from the same place
    assert rows[0][1:3] != rows[1][1:3]  # at another pixel in another projection


def test_compare_writes_and_prints(tmp_path, monkeypatch, capsys):
    folder, kept = tmp_path / "out", []
    arguments = ["compare", "cube", "--output", str(folder), "--methods", "invert,raytrace", "--repeats", "1"]
    arguments += ["--size", "32"]
    measure = driver.compare
    monkeypatch.setattr(driver, "compare", lambda *given, **named: kept.append(measure(*given, **named)) or kept[-1])
    assert main([*arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["method"] for row in answer["rows"]] == ["invert", "raytrace"]
    assert (folder / "report.html").is_file()
    # The other ways to print it need nothing measured anew.
    asked = []
    monkeypatch.setattr(driver, "compare", lambda *_, **named: asked.append(named["output"]) or kept[0])
    assert main([*arguments, "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "raytrace" in out
    assert "report.html" in out
    assert list(map(str, asked)) == [str(folder)] * 2


def test_unfit_machine_is_told_what_to_install(tmp_path):
    environment = {**os.environ, "DRJIT_LIBLLVM_PATH": str(tmp_path / "libLLVM.so")}
    child = start("render", "cube", "--output", str(tmp_path / "a.png"), env=environment)
    err = child.communicate(timeout=60)[1]
    assert child.returncode == 1
    assert "libllvm19" in err.splitlines()[-1]
    assert "Traceback" not in err
    assert not list(tmp_path.iterdir())


def test_interrupt_costs_one_line(tmp_path):
    pipe = tmp_path / "points"
    os.mkfifo(pipe)
    child = start("project", "cube", str(pipe))
    with open(pipe, "w"):  # opens when the child does, which then waits for points
        child.send_signal(signal.SIGINT)
        err = child.communicate(timeout=60)[1]
    assert child.returncode == 130
    assert err == "mpcam: interrupted\n"


def test_reader_that_leaves_early_is_no_failure_with_traceback(tmp_path):
    (tmp_path / "points.txt").write_text("0 0 0\n" * 20_000)
    child = start("project", "cube", str(tmp_path / "points.txt"))
    assert child.stdout is not None and child.stderr is not None
    child.stdout.readline()
    child.stdout.close()
    assert "Traceback" not in child.stderr.read()
    child.stderr.close()
    assert child.wait(timeout=60) == 1
