"""Depth images of what a mirror shows: against Mitsuba's rays, and the cameras that are chosen for them."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import mpcam as mp
from mpcam.comparison.metrics import image_rmse
from mpcam.effects.depth_image_choice import choice_of
from mpcam.effects.depth_image_views import ball_of, still_holds, used_vertices, views_of
from mpcam.effects.mirror_rays import mirror_rays
from mpcam.effects.missing_samples import held, on_device, true_hits
from mpcam.experiments import run
from mpcam.io.scenes import load_scene

SIZE = (96, 72)


def painted(mesh: mp.Mesh, color) -> mp.Mesh:
    return dataclasses.replace(mesh, materials=(mp.Material(color),), face_material=None)


def ring() -> mp.Mesh:
    pose = mp.look_at((0.0, 0.0, 0.0), (0.3, -1.0, 0.4))
    pose[:3, 3] = 0.1, -0.2, 1.0
    return painted(mp.Surface.torus(0.5, 0.17).mesh(3000).transformed(pose), (0.8, 0.3, 0.2))


def floor(half: float = 3.0) -> mp.Mesh:
    corners = half * np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    return painted(mp.Mesh(corners, [(0, 1, 2), (0, 2, 3)]), (0.3, 0.5, 0.6))


def scene(mirror=None, meshes=None, **settings) -> mp.Scene:
    """A ring above a floor, before a wavy mirror that leans back."""
    if mirror is None:
        pose = np.array([(1.0, 0, 0, 0.0), (0, 0.1, -1, 1.3), (0, 1, 0.1, 1.2), (0, 0, 0, 1)])
        pose[:3, :3] /= np.sqrt((1, 1.01, 1.01))[:, None]
        mirror = mp.Surface.wave(2.6, 0.05, 1.0).transformed(pose)
    camera = mp.Pinhole.from_fov(*SIZE, 0.8, mp.look_at((1.2, -3.2, 2.2), (0.1, 0.3, 1.0)))
    light = mp.DirectionalLight((0.3, 0.8, -1.0), (0.8, 0.8, 0.7))
    lens = mp.Mirror(mirror, **settings)
    return mp.Scene(meshes or (ring(), floor()), camera, (light,), background=(0.5, 0.6, 0.8), mirror=lens)


def part(picture: mp.Reflection) -> Any:
    """What its method consists of."""
    return picture.part


def off(picture: mp.Reflection, truth: mp.Reflection, limit: float = 0.05) -> float:
    """Share of the mirror's pixels that differ clearly."""
    return float((np.abs(picture.image() - truth.image()).max(-1) > limit)[truth.mask].mean())


def test_a_mirror_shows_what_traced_rays_see_and_larger_images_show_it_better():
    shown = scene()
    truth = mp.Reflection(shown, method="raytrace")
    errors = {size: off(mp.Reflection(shown, method="depth_image", size=size), truth) for size in (24, 256)}
    assert errors[256] < 0.012 and errors[24] > 3 * errors[256]
    pinholes = mp.Reflection(shown, method="depth_image", size=256, aside=0)
    assert off(pinholes, truth) > 1.5 * errors[256]
    by_name = mp.render(shown.camera, shown, method="depth_image", size=256)
    assert np.array_equal(by_name, mp.Reflection(shown, method="depth_image", size=256).image())


def test_each_mesh_gets_the_camera_that_fits_it():
    shown = scene(meshes=(ring(), floor(), mp.Surface.sphere(8.0).mesh(500)))
    ray = mirror_rays(shown.camera, shown.mirror).ray
    origins, ways = ray.origin[ray.valid], ray.direction[ray.valid]
    views = {view.meshes: view for view in views_of(shown, origins, ways, 64, 1.0)}
    assert {numbers: view.kind for numbers, view in views.items()} == {(1,): "flat", (0,): "thing", (2,): "around"}
    (thing,), (flat,) = views[0,].cameras, views[1,].cameras
    assert isinstance(thing, mp.SinglePoleOcclusion) and isinstance(flat, mp.Orthographic)
    assert len(views[2,].cameras) == 2
    for number, camera in ((0, thing), (1, flat)):
        points = used_vertices(shown.meshes[number])
        pixel = camera.project(points).pixel[..., 0, :]
        assert (pixel > 0).all() and (pixel < (camera.width, camera.height)).all()
        assert np.ptp(pixel, axis=0).max() > 0.7 * camera.width
    # From above, since the mirror is.
    assert flat.ray(np.array((32.0, 32.0))).direction[2] == pytest.approx(-1.0)
    assert isinstance(views_of(shown, origins, ways, 64, 0.0)[1].cameras[0], mp.Pinhole)
    center, radius = ball_of(used_vertices(ring()))
    assert still_holds(views[0,], used_vertices(ring()))
    assert not still_holds(views[0,], used_vertices(ring()) + 0.1 * radius)


def test_scenes_move_and_cameras_follow_them():
    shown = scene()
    picture = mp.Reflection(shown, method="depth_image", size=192)
    before, held_camera = picture.image(), part(picture).shown[-1].view.cameras[0]
    for shift, follows in (((0.0, 0.0, 0.004), False), ((0.4, -0.3, 0.3), True)):
        vertices = [shown.meshes[0].vertices + shift, None]
        picture.update(vertices)
        other = dataclasses.replace(shown, meshes=(dataclasses.replace(ring(), vertices=vertices[0]), floor()))
        truth = mp.Reflection(other, method="raytrace")
        assert off(picture, truth) < 0.02
        assert (part(picture).shown[-1].view.cameras[0] is not held_camera) == follows
        assert not np.array_equal(picture.image(), before)
    picture.update(shown.mesh.vertices)
    assert off(picture, mp.Reflection(shown, method="raytrace")) < 0.02


def test_second_orders_by_stored_normals():
    shown = scene()
    settings = {"bounces": 2, "reflectance": (0.6, 0.2)}
    truth = mp.Reflection(shown, method="raytrace", **settings)
    once = mp.Reflection(shown, method="raytrace")
    picture = mp.Reflection(shown, method="depth_image", size=384, **settings)
    assert off(picture, truth) < 0.03
    assert off(once, truth) > 0.2
    unequal = mp.Reflection(shown, method="depth_image", size=384, bounces=2, reflectance=(0.2, 0.6))
    assert off(unequal, truth) > 0.2


def test_a_hollow_mirror_is_seen_in_itself():
    """In a deep bowl rays meet the mirror again; without its own depth image they see the sky there."""
    pose = np.array([(1.0, 0, 0, 0), (0, 0, -1, 1.6), (0, 1, 0, 1.0), (0, 0, 0, 1)])
    bowl = mp.Surface.paraboloid(1.6, 1.2).transformed(pose)
    shown = scene(bowl, meshes=(ring(),), bounces=3, own=True, color=(0.5, 0.9, 0.7))
    truth = mp.Reflection(shown, method="raytrace")
    own = mp.Reflection(shown, method="depth_image", size=256)
    without = mp.Reflection(shown, method="depth_image", size=256, bounces=1, own=False)
    assert off(without, truth) > 0.2
    assert off(own, truth) < 0.1 * off(without, truth)


def test_given_images_are_taken_and_the_rest_is_chosen():
    shown = scene()
    picture = mp.Reflection(shown, method="depth_image", size=192)
    by_kind = {image.view.kind: image.view.cameras[0] for image in part(picture).shown}
    same = mp.Reflection(shown, method="depth_image", size=192, images=[(by_kind["thing"], 0), (by_kind["flat"], 1)])
    filled = mp.Reflection(shown, method="depth_image", size=192, images=[(by_kind["thing"], 0)])
    assert image_rmse(same.image(), picture.image()) < 0.02
    assert image_rmse(filled.image(), picture.image()) < 0.02
    alone = mp.DepthImage.render(by_kind["flat"], (floor(),), color=True)
    only = mp.Reflection(shown, method="depth_image", images=[alone])
    assert part(only).images == [alone]
    whole = mp.Reflection(shown, method="depth_image", images=by_kind["thing"])
    assert [view.view.meshes for view in part(whole).shown] == [(0, 1)]


def test_missing_samples_are_those_behind_what_a_camera_sees():
    """Of a ball's points, a pinhole holds those before its horizon, and a camera that reaches around holds a half."""
    ball = mp.Surface.sphere(1.0).mesh(20_000)
    rng = np.random.default_rng(1)
    points = rng.standard_normal((4000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    eye = np.array((0.0, -2.0, 0.0))
    device, middle = on_device(points)
    for aside, horizon in ((0.0, -0.5), (1.0, 0.0)):
        camera = mp.SinglePoleOcclusion.around(256, 256, (0, 0, 0), 1.0, eye, aside)
        image = mp.DepthImage.render(camera, ball, "vertex", level=1, color=False)
        found = np.asarray(held(image, device, middle, 0.02).numpy())
        sure = np.abs(points[:, 1] - horizon) > 0.05
        assert (found == (points[:, 1] < horizon))[sure].mean() > 0.98


def test_a_search_leaves_few_samples_missing():
    shown = scene()
    found = mp.choose_occlusion_camera(shown, size=128, evaluations=40)
    assert found.missing < 0.5 * found.before and found.evaluations <= 45
    ray = mirror_rays(shown.camera, shown.mirror).ray
    hits = true_hits(shown, shown.camera, ray, (0,))
    traced = part(mp.Reflection(shown, method="raytrace")).prepared.frame()
    assert np.array_equal(hits.number, np.flatnonzero((traced.triangle >= 0) & (traced.triangle < len(ring().faces))))
    image = mp.DepthImage.render(found.camera, (ring(),), "vertex", level=1)
    met = image.intersect(ray.origin[hits.number], ray.direction[hits.number])
    distance = np.linalg.norm(hits.points - ray.origin[hits.number], axis=1)
    assert (np.abs(met.distance - distance) < 0.02).mean() > 0.95


def given_images(file) -> Any:
    mirror = load_scene(file).scene.mirror
    return mirror and mirror.depth_images["images"]


def test_a_scene_file_and_the_command_line_know_depth_images(tmp_path):
    from mpcam.cameras.serialize import camera_to_json
    from mpcam.cli import app

    (tmp_path / "camera.json").write_text(camera_to_json(mp.Pinhole.from_fov(32, 32, 1.0)))
    file = tmp_path / "scene.toml"
    file.write_text(
        '[[mesh]]\nbuiltin = "cube"\nscale = 0.4\ntranslate = [0, 0, 0.9]\n'
        '[camera]\nmodel = "pinhole"\nsize = [40, 30]\nfov = 50\neye = [0.4, -3, 2]\ntarget = [0, 0, 0.3]\n'
        '[mirror]\nsurface = "wave"\nbounces = 2\nreflectance = [0.25]\n'
        "[mirror.depth_images]\nsize = 48\naside = 0.5\n"
        '[compare]\nmethods = ["depth_image"]\ndepth_image.sizes = [32, 64]\n'
    )
    loaded = load_scene(file)
    assert loaded.compare.settings["depth_image"] == ({"size": 32}, {"size": 64})
    picture = mp.Reflection(loaded.scene, method="depth_image")
    choice = part(picture).choice
    assert (choice.size, choice.aside, choice.bounces, choice.reflectance) == (48, 0.5, 2, (0.25,))
    arguments = ["render", str(file), "--method", "depth_image", "--image-size", "48", "--output"]
    app([*arguments, str(tmp_path / "a.exr")], result_action="return_value")
    assert np.allclose(mp.read_image(tmp_path / "a.exr")[..., :3], picture.image(), atol=2e-3)
    file.write_text(file.read_text().replace("aside = 0.5", 'cameras = ["camera.json"]'))
    assert type(given_images(file)[0]) is mp.Pinhole


def test_the_experiment_tells_what_is_missing_by_camera():
    report = run("rosen2011-fig1", quick=True)
    table = report.table("missing")
    missing = {row["method"]: row["missing_percent"] for row in table.rows}
    assert missing["single pole, chosen"] < missing["single pole"] < 0.5 * missing["pinhole"]
    assert missing["single pole"] < missing["2 layers"] <= missing["pinhole"]
    errors = {row["method"]: row["rmse"] for row in table.rows}
    assert errors["Mitsuba"] == 0 < errors["single pole, chosen"] < errors["pinhole"] < errors["environment"]
    assert "wanted" in report.reading and len(report.pictures) == 12


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"size": 4}, "from 8"),
        ({"aside": -1}, "from 0"),
        ({"fine": 9.0}, "fine=9"),
        ({"bounces": 0}, "from 1"),
        ({"own": True}, "give bounces=2"),
        ({"reflectance": 0.5}, "give bounces=2"),
        ({"reflectance": (0.5,), "bounces": 2}, "2 meshes"),
        ({"images": []}, "give cameras"),
        ({"images": [3]}, "give cameras"),
        ({"images": [(mp.Pinhole.from_fov(8, 8, 1.0), 2)]}, "from 0 to 1"),
        ({"images": [(mp.Pinhole.from_fov(8, 8, 1.0), ())]}, "no mesh"),
    ],
)
def test_mistakes_are_told(settings, words):
    with pytest.raises(mp.InputError, match=words):
        choice_of(scene(), **settings)


def test_nothing_to_see_is_sky():
    empty = mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    shown = scene(meshes=(empty,))
    picture = mp.Reflection(shown, method="depth_image")
    assert np.allclose(picture.image(), shown.background)
    with pytest.raises(mp.InputError, match="not seen in the mirror"):
        mp.choose_occlusion_camera(shown)
    with pytest.raises(mp.InputError, match="no mirror"):
        mp.choose_occlusion_camera(mp.Scene((ring(),), camera=shown.camera))
