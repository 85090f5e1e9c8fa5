"""Textures that cannot be drawn are said, in Python and in the shell, and what is drawn then."""

import subprocess
import sys

import numpy as np
import pytest

import mpcam as mp

CORNERS = [[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]
UV = [[0.0, 0], [1, 0], [0, 1]]
GREEN = mp.Material((1, 1, 1), np.tile(np.float32([0, 1, 0]), (2, 2, 1)), "skin")


def picture(scene, shading="color"):
    camera = mp.Pinhole(32, 32, 20, 20, camera_from_world=mp.look_at((0, 0, 2), (0, 0, 0), (0, 1, 0)))
    return mp.render(camera, scene, shading=shading)[18, 16]


def test_a_texture_without_texture_coordinates():
    bare = mp.Mesh(CORNERS, [[0, 1, 2]], materials=GREEN, name="bare")
    whole = mp.Mesh(CORNERS, [[0, 1, 2]], uv=UV, materials=GREEN, name="whole").transformed(np.diag([1, 1, 1, 1.0]))
    with pytest.warns(UserWarning, match="mesh 'bare' has a texture, but no texture coordinates"):
        np.testing.assert_array_equal(picture(bare, "light")[[0]], picture(bare, "light")[[2]])
    # put together with one that has them, it has none still
    behind = whole.transformed([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]])
    with pytest.warns(UserWarning, match="mesh 'bare'"):
        np.testing.assert_allclose(picture(mp.Scene((bare, behind)), "texture"), 1)
    np.testing.assert_allclose(picture(whole, "texture"), [0, 1, 0], atol=1e-6)


def test_shading_by_textures_that_are_not_there():
    plain = mp.Mesh(CORNERS, [[0, 1, 2]], materials=mp.Material((0.5, 0.25, 1)), name="plain")
    with pytest.warns(UserWarning, match="shading='texture': 'plain' has no texture, so this is 'color'"):
        np.testing.assert_allclose(picture(plain, "texture"), [0.5, 0.25, 1])
    for shading in ("color", "normal", "light"):
        picture(plain, shading)


def test_the_shell_says_it_in_a_line(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl x\nf 1 2 3\n")
    options = ["a.obj", "--output", "a.png", "--shading", "texture", "--size", "8"]
    done = subprocess.run(
        [sys.executable, "-m", "mpcam", "render", *options], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[:2] == [
        "mpcam: warning: a.obj: material x is in no material file (usemtl, mtllib): its faces are gray",
        "mpcam: warning: shading='texture': 'a' has no texture, so this is 'color'",
    ]
