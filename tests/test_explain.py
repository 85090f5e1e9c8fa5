"""What a picture takes and what it leaves out, told as it is."""

import numpy as np
import pytest

import mpcam as mp
from mpcam.cli import main


@pytest.fixture(scope="module")
def scene():
    return mp.builtin_scene("temple", 64, 64)


def test_small_triangles_need_no_lists():
    camera = mp.Radial.paraboloid(64, 64)
    small = mp.explain(camera, mp.builtin_mesh("sphere", triangles=20480))
    assert {"lists of blocks", "pixels through lists"} <= small.left_out.keys()
    large = mp.explain(camera, mp.builtin_mesh("sphere", triangles=80))
    assert {"lists of blocks", "pixels through lists"} <= set(large.ran)


def test_shading_takes_what_it_needs(scene):
    plain = mp.explain(scene.camera, scene, shading="color")
    assert "materials" in plain.ran
    assert {"textures", "normals", "lights", "shadow maps"} <= plain.left_out.keys()
    lit = mp.explain(scene.camera, scene, shadows=True)
    assert {"textures", "normals", "lights", "shadow maps", "places of the hits"} <= set(lit.ran)


def test_hidden_triangles_are_counted(scene):
    eye = scene.camera
    behind = (eye.local(scene.mesh.vertices.T)[2][scene.mesh.faces] < -1e-4).all(1).sum()
    (step,) = (step for step in mp.explain(eye, scene).steps if step.name == "triangles")
    assert f"left out: {behind:,} that" in step.why
    (step,) = (step for step in mp.explain(eye, scene, cull="back").steps if step.name == "triangles")
    assert "show their back" in step.why


def test_every_method_and_an_empty_mesh(scene):
    for method in ("vertex", "cubemap", "hemicube", "raytrace"):
        assert mp.explain(scene.camera, scene, method).ran
    empty = mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert "rasterization" in mp.explain(scene.camera, empty).left_out


def test_render_says_it_on_standard_error(scene, capsys):
    plain = mp.render(scene.camera, scene)
    explained = mp.render(scene.camera, scene, explain=True)
    np.testing.assert_array_equal(plain, explained)
    said = capsys.readouterr()
    assert said.out == "" and "left out  root finding" in said.err


def test_command_line(tmp_path, capsys):
    picture = tmp_path / "a.png"
    assert main(["render", "temple", "--size", "32", "--output", str(picture), "--explain", "--cull", "back"]) == 0
    assert "runs      vertices" in capsys.readouterr().out and picture.exists()
    assert main(["render", "temple", "--size", "32", "--output", str(picture), "--bound", "box"]) == 2
    assert "allowed are tight, triangle, quad" in capsys.readouterr().err


def test_mistakes(scene):
    with pytest.raises(mp.InputError, match="shading='glow'"):
        mp.explain(scene.camera, scene, shading="glow")
    with pytest.raises(mp.InputError, match="method='magic'"):
        mp.explain(scene.camera, scene, "magic")
