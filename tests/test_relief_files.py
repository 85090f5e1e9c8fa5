"""Reliefs in scene files, on the command line, and their experiment."""

import numpy as np
import pytest

import mpcam as mp
from mpcam.experiments import run

TEXT = """
[[mesh]]
builtin = "plane"
scale = 12

[[relief]]
builtin = "cube"
size = 64
{more}

[camera]
model = "pinhole"
size = [40, 30]
fov = 50
eye = [4, -6, 5]
target = [0, 0, 0]
"""
PLAIN = list(mp.builtin_mesh("cube").materials[0].color)
COLORED = f"key = {PLAIN}\ncolors = [[1, 0, 0], [0, 1, 0]]\n"
GRID = "grid = { rows = 3, columns = 2, spacing = [2.5, 2] }"


def scene_of(tmp_path, more):
    path = tmp_path / "scene.toml"
    path.write_text(TEXT.replace("{more}", more))
    return mp.load_scene(path).scene


def test_a_grid_in_two_colors(tmp_path):
    (copies,) = scene_of(tmp_path, COLORED + GRID).reliefs
    assert len(copies) == 6
    assert copies.placements[:, 0, 3].tolist() == [-2.5, -2.5, 0, 0, 2.5, 2.5]
    assert copies.placements[:, 1, 3].tolist() == [-1, 1] * 3
    assert copies.colors.tolist() == [[1, 0, 0], [0, 1, 0]] * 3


def test_places_one_by_one_and_from_a_file(tmp_path):
    place = "[[relief.place]]\ntranslate = [1, 2, 3]\nscale = 2\n"
    place += "[[relief.place]]\nrotate = { axis = [0, 0, 1], degrees = 90 }"
    (copies,) = scene_of(tmp_path, place).reliefs
    assert copies.colors is None
    assert copies.placements[0] == pytest.approx(np.array([(2, 0, 0, 1), (0, 2, 0, 2), (0, 0, 2, 3), (0, 0, 0, 1)]))
    assert copies.placements[1, :2, :2] == pytest.approx(np.array([(0, -1), (1, 0)]), abs=1e-12)
    np.save(tmp_path / "places.npy", copies.placements)
    (again,) = scene_of(tmp_path, 'placements = "places.npy"\ncamera = "orthographic"\nlayers = 2').reliefs
    assert (again.placements == copies.placements).all() and len(again.relief.images) == 2


WRONG = {
    "no copies": ("", "give one of grid, placements"),
    "two ways": (GRID + '\nplacements = "x.npy"', "give one of grid, placements"),
    "no file": ('placements = "x.npy"', "scene.toml:9: relief.*placements.*cannot be read"),
    "layers": ("layers = 3\n" + GRID, "scene.toml:9: .*layers.*orthographic"),
    "key": ('key = "paint"\n' + GRID, "scene.toml:9: .*key.*no material"),
    "colors without a key": ("colors = [[1, 0, 0]]\n" + GRID, "no key color"),
    "some colors": (f"key = {PLAIN}\n[[relief.place]]\ncolor = 0.5\n[[relief.place]]", "this one too"),
    "unknown": ("copies = 3\n" + GRID, "there is no such key"),
}


@pytest.mark.parametrize("case", WRONG)
def test_mistakes_name_the_line(tmp_path, case):
    more, words = WRONG[case]
    with pytest.raises(mp.InputError, match=words):
        scene_of(tmp_path, more)


def test_compare_refuses_reliefs(tmp_path):
    with pytest.raises(mp.InputError, match="has reliefs"):
        mp.compare(scene_of(tmp_path, GRID))


def test_the_picture_of_a_file_is_that_of_the_meshes(tmp_path):
    scene = scene_of(tmp_path, GRID)
    image = mp.render(scene.camera, scene)
    cubes = [mp.builtin_mesh("cube").transformed(matrix) for matrix in scene.reliefs[0].placements]
    whole = mp.Scene((*scene.meshes, *cubes), scene.camera, scene.lights, scene.ambient, scene.background)
    assert np.median(np.abs(image - mp.render(scene.camera, whole)).max(-1)) < 1e-3
    explained = str(mp.explain(scene.camera, scene))
    assert "6 copies of" in explained


def test_the_experiment():
    report = run("rosen2011-relief", quick=True)
    pole, plain = report.table("errors").rows
    assert (pole["relief"], plain["relief"]) == ("single pole", "conventional")
    assert pole["missing"] < 0.4 * plain["missing"] and pole["rms"] < plain["rms"]
    (times,) = report.table("times").rows
    assert times["fps"] == pytest.approx(1e3 / times["frame_ms"])
    assert {picture.name for picture in report.pictures} >= {"cars-single-pole-boxes", "cars-conventional-texture"}
