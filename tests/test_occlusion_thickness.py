"""Screen-space occlusion by surfaces with an end, by several z-buffers, and in scene files."""

import math

import numpy as np
import pytest

import mpcam as mp
from mpcam.cli import main

NADIR = mp.look_at((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))


def quad(*corners) -> mp.Mesh:
    return mp.Mesh(corners, [[0, 1, 2], [0, 2, 3]])


def ground(half: float = 60.0) -> mp.Mesh:
    return quad((-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0))


def box(low, high) -> mp.Mesh:
    """A closed box, its faces wound outwards."""
    (a, b, c), (d, e, f) = low, high
    corners = [(x, y, z) for x in (a, d) for y in (b, e) for z in (c, f)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mp.Mesh(corners, [t for i, j, k, m in sides for t in ((i, j, k), (i, k, m))])


def shelf(low: float, high: float) -> mp.Mesh:
    """A long board over the ground beside x = 1, seen from above."""
    return mp.Mesh.concatenate([ground(200.0), box((1.0, -200.0, low), (200.0, 200.0, high))])


@pytest.mark.parametrize("given", ["thickness", "backs"])
def test_the_gap_below_a_board_is_open(given):
    """Seen from above, a board is its upper side: it covers as far down as it is thick, and no farther."""
    low, high = 1.0, 1.5
    mesh = shelf(low, high)
    camera = mp.Pinhole(100, 80, 40.0, 40.0, cx=38.0, cy=40.0, camera_from_world=NADIR)
    hits = mp.rasterize(camera, mesh)
    settings: dict = {"falloff": "none", "blur": 1, "bias": 0.0, "directions": 24, "steps": 48}
    more = {"thickness": {"thickness": high - low}}
    more["backs"] = {"thickness": 50.0, "backs": mp.rasterize(camera, mesh, cull="front")}
    radius = 3.0
    exposure = mp.screen_occlusion(hits, radius, **settings, **more[given])
    solid = mp.screen_occlusion(hits, radius, **settings)
    truth = mp.traced_occlusion(hits, radius, falloff="none", rays=150)
    place = hits.points
    near = (place[..., 2] < 1e-3) & (place[..., 0] > 0.2) & (place[..., 0] < 0.7) & (np.abs(place[..., 1]) < 0.5)
    assert near.sum() > 20
    # Within the radius are parts of its lower side whose upper side is not.
    assert abs((exposure - truth)[near].mean()) < 0.05
    assert (solid - truth)[near].mean() < -0.1  # all is dark below, which is wrong


def test_the_thickest_is_without_end():
    """A thickness far beyond the scene gives what none gives, to a sector."""
    scene = mp.builtin_scene("statue", triangles=8_000)
    pose = mp.look_at((4.1, -5.2, 2.6), (-0.3, 0.0, 0.95))
    hits = mp.rasterize(mp.Pinhole.from_fov(80, 60, 0.75, camera_from_world=pose), scene)
    settings: dict = {"directions": 16, "steps": 12, "blur": 1, "thickness": 1e4}
    thick = mp.screen_occlusion(hits, 0.6, **settings)
    thin = mp.screen_occlusion(hits, 0.6, **{**settings, "thickness": 1e-3})
    solid = mp.screen_occlusion(hits, 0.6, **{**settings, "thickness": None, "steps": 24})
    assert np.abs(thick - solid).mean() < 0.02
    assert thin[hits.mask].mean() > thick[hits.mask].mean() + 0.03
    assert (thin[~hits.mask] == 1).all()


def test_what_is_held_already_adds_nothing():
    """The same view twice is one view; a view from the other side of a wall adds what stands behind it."""
    wall = box((-0.05, -3.0, 0.0), (0.05, 3.0, 1.0))
    post = box((0.5, -3.0, 0.0), (0.6, 3.0, 0.8))
    mesh = mp.Mesh.concatenate([ground(20.0), wall, post])
    eye, target = (-5.0, 0.0, 1.6), (0.0, 0.0, 0.4)
    camera = mp.Pinhole.from_fov(120, 90, 0.6, camera_from_world=mp.look_at(eye, target))
    other = mp.Pinhole.from_fov(120, 90, 0.6, camera_from_world=mp.look_at((5.0, 0.0, 1.6), target))
    hits, behind = mp.rasterize(camera, mesh), mp.rasterize(other, mesh)
    settings: dict = {"directions": 24, "steps": 24, "blur": 1, "thickness": 0.1}
    once = mp.screen_occlusion(hits, 0.8, **settings)
    twice = mp.screen_occlusion(hits, 0.8, zbuffer=[hits, mp.rasterize(camera, mesh)], **settings)
    np.testing.assert_allclose(twice, once, atol=1e-6)
    both = mp.screen_occlusion(hits, 0.8, zbuffer=[hits, behind], **settings)
    truth = mp.traced_occlusion(hits, 0.8, rays=200)
    place = hits.points
    ahead = hits.mask & (place[..., 0] < -0.1) & (place[..., 2] < 1e-3)
    np.testing.assert_allclose(both[ahead], once[ahead], atol=0.03)
    # The top of the wall sees the post, whose far side the camera sees not at all.
    off = [np.abs(found - truth)[hits.mask & (truth < 0.99)].mean() for found in (once, both)]
    assert off[1] <= off[0] + 0.002


def test_occlusion_in_a_scene_file(tmp_path):
    """The table, the command line in its place, and the default of `render`."""
    path = tmp_path / "scene.toml"
    text = """
[[mesh]]
builtin = "statue"
triangles = 8000

[camera]
model = "pinhole"
fov = 40
size = [48, 36]
eye = [4.1, -5.2, 2.6]
target = [-0.3, 0, 0.95]

[occlusion]
radius = 0.6
thickness = 0.1
blur = 3
"""
    path.write_text(text)
    scene = mp.load_scene(path).scene
    assert scene.occlusion == mp.Occlusion(0.6, 0.1, blur=3)
    image = mp.render(scene.camera, scene)
    np.testing.assert_array_equal(image, mp.render(scene.camera, scene, occlusion=scene.occlusion))
    hits = mp.rasterize(scene.camera, scene.mesh)
    exposure = mp.screen_occlusion(hits, 0.6, thickness=0.1, blur=3)
    np.testing.assert_allclose(image, mp.shade(hits, scene, exposure=exposure), atol=1e-6)
    plain = mp.render(scene.camera, scene, occlusion=0.6)
    assert np.abs(plain - image).max() > 0.01
    out = tmp_path / "a.exr"
    assert main(["render", str(path), "--output", str(out), "--thickness", "0.3"]) == 0
    wanted = mp.render(scene.camera, scene, occlusion=mp.Occlusion(0.6, 0.3, blur=3))
    np.testing.assert_allclose(mp.read_image(out)[..., :3], wanted, atol=2e-3)
    path.write_text(text.replace("radius = 0.6", "radius = -1"))
    with pytest.raises(mp.InputError, match="radius"):
        mp.load_scene(path)
    path.write_text(text.replace("blur = 3", "blur = 4"))
    with pytest.raises(mp.InputError, match="odd"):
        mp.load_scene(path)


def test_mistakes(capsys):
    pose = mp.look_at((0.0, -3.0, 3.0), (0.0, 0.0, 0.0))
    hits = mp.rasterize(mp.Pinhole.from_fov(16, 12, 0.7, camera_from_world=pose), ground(5.0))
    for settings, words in (
        ({"thickness": 0.0}, "above 0"),
        ({"thickness": math.nan}, "above 0"),
        ({"zbuffer": [hits, hits]}, "several need thickness="),
        ({"zbuffer": []}, "empty"),
        ({"backs": hits}, "backs need thickness="),
        ({"backs": [hits, hits], "thickness": 1.0}, "2 entries for 1"),
        ({"backs": 3, "thickness": 1.0}, "cull='front'"),
    ):
        with pytest.raises(mp.InputError, match=words):
            mp.screen_occlusion(hits, 1.0, **settings)
    with pytest.raises(mp.InputError, match="scene occlusion"):
        mp.Scene((ground(),), occlusion=0.5)  # pyright: ignore[reportArgumentType]
    with pytest.raises(mp.InputError, match="Occlusion|radius"):
        mp.Occlusion(0.0)
    assert main(["render", "patio", "--output", "a.png", "--thickness", "0.2", "--size", "16"]) == 2
    assert "--occlusion" in capsys.readouterr().err
