"""Scenes seen through glass: rays through two interfaces against closed forms, and pictures against Mitsuba's rays."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import mpcam as mp
from mpcam.comparison.mirrors import mirror_plan
from mpcam.effects.refractor_rays import RefractorRays
from mpcam.effects.refractor_solid import solid_of
from mpcam.io.scenes import load_scene
from mpcam.math.optics import fresnel

EYE, CENTER = np.array((0.7, -3.1, 1.2)), np.array((0.2, 0.1, -0.3))
TURN = np.array([(0.36, 0.48, -0.8, 0.2), (-0.8, 0.6, 0.0, 0.1), (0.48, 0.64, 0.6, -0.3), (0, 0, 0, 1)])


def thing(shift=(0.0, 0.0, 0.0)) -> mp.Mesh:
    """An egg of many colors, far below and behind."""
    egg = mp.Surface.ellipsoid((0.8, 0.5, 0.6), np.array((-0.1, 2.2, -1.1)) + shift).mesh(3000)
    return dataclasses.replace(egg, colors=0.5 + 0.4 * np.sin(7 * (egg.vertices - shift)))


def floor(half: float = 4.0) -> mp.Mesh:
    corners = half * np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) - (0, 0, 2.2)
    colors = np.array([(0.1, 0.5, 0.6), (0.9, 0.5, 0.1), (0.2, 0.1, 0.9), (0.9, 0.9, 0.2)])
    return mp.Mesh(corners, [(0, 1, 2), (0, 2, 3)], colors=colors)


def scene(surface: Any = None, size=(72, 54), meshes=None, **settings) -> mp.Scene:
    """An egg above a floor, behind glass."""
    glass = mp.Surface.sphere(0.9, CENTER) if surface is None else surface
    camera = mp.Pinhole.from_fov(*size, 0.75, mp.look_at(EYE, CENTER, (0.1, 0.3, 0.9)))
    light = mp.DirectionalLight((0.3, 0.8, -1.0), (0.8, 0.8, 0.7))
    lens = mp.Refractor(glass, **settings)
    return mp.Scene(meshes or (thing(), floor()), camera, (light,), background=(0.5, 0.6, 0.8), refractor=lens)


def box(half) -> mp.Mesh:
    """With the normals of its facets."""
    return mp.builtin_mesh("cube").flat().transformed(np.diag([*half, 1.0]))


def pixel_ways(camera) -> np.ndarray:
    """By the pinhole's own numbers, not by the camera's code."""
    v, u = np.divmod(np.arange(camera.width * camera.height), camera.width)
    ways = np.stack([(u + 0.5 - camera.cx) / camera.fx, (v + 0.5 - camera.cy) / camera.fy, np.ones(len(u))], -1)
    ways = ways @ np.asarray(camera.camera_from_world)[:3, :3]
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def snell(ways, normals, index):
    """By angles: the sine behind is the sine before over the index; where there is none, mirrored by the angle."""
    facing = np.where((ways * normals).sum(1, keepdims=True) < 0, normals, -normals)
    along = (ways * facing).sum(1, keepdims=True)
    across = ways - along * facing
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    behind = sine / index
    out = across / np.maximum(sine, 1e-300) * behind - np.sqrt(np.maximum(1 - behind**2, 0)) * facing
    inside = behind[:, 0] > 1
    return np.where(inside[:, None], across - along * facing, out), ~inside


def part_of(before, after):
    """Fresnel's equations by sines and tangents of both angles."""
    s, p = np.sin(before - after) / np.sin(before + after), np.tan(before - after) / np.tan(before + after)
    return 0.5 * (s**2 + p**2)


def angle(a, b) -> np.ndarray:
    """Degrees, also for directions that are nearly the same."""
    return np.degrees(2 * np.arcsin(np.minimum(0.5 * np.linalg.norm(a - b, axis=1), 1.0)))


def rays_of(shown: mp.Scene, second: str, **settings) -> RefractorRays:
    """Those of a picture whose scene is cheap."""
    return mp.Refraction(shown, method="raytrace", second=second, **settings).rays


def through_a_ball(camera, radius, center, index):
    """Points of both interfaces, directions between and after, and the angle before."""
    ways = pixel_ways(camera)
    along = ((center - EYE) * ways).sum(1)
    foot = EYE + along[:, None] * ways
    half = radius**2 - ((foot - center) ** 2).sum(1)
    hit = half > 0
    first = EYE + (along - np.sqrt(np.where(hit, half, 0)))[:, None] * ways
    normal = (first - center) / radius
    inside, enters = snell(ways, normal, index)
    second = first - 2 * (inside * (first - center)).sum(1)[:, None] * inside
    after, _ = snell(inside, (second - center) / radius, 1 / index)
    return hit, enters, first, inside, second, after, np.arccos(np.clip(-(ways * normal).sum(1), -1, 1))


@pytest.mark.parametrize("index", [1.5, 1 / 1.33])
def test_a_ball_is_left_as_closed_forms_say(index):
    shown = scene(index=index)
    hit, enters, first, inside, second, after, _ = through_a_ball(shown.camera, 0.9, CENTER, index)
    good = hit & enters
    assert 0.3 < hit.mean() < 0.8 and (enters[hit].mean() == 1) == (index > 1)
    for name, most, typical in (("trace", 1e-4, 1e-9), ("march", 1.0, 0.05), ("wyman", 60.0, 4.0), ("none", 1.0, 0.05)):
        found = rays_of(shown, name)
        assert (found.ray.valid != good).mean() < 0.01
        assert name == "wyman" or not found.missing[good].any()
        both = found.ray.valid & good
        expected, place = (inside, first) if name == "none" else (after, second)
        off = angle(found.ray.direction[both], expected[both])
        assert np.median(off) < typical and np.quantile(off, 0.97) < most, (name, np.median(off), off.max())
        if name != "wyman":
            gap = np.linalg.norm(found.ray.origin[both] - place[both], axis=1)
            assert np.median(gap) < 1e-3 and np.quantile(gap, 0.97) < 0.02
        assert np.array_equal(np.isfinite(found.distance), hit) or (np.isfinite(found.distance) != hit).mean() < 0.01


def test_light_is_shared_out_by_fresnel():
    shown, index = scene(), 1.5
    hit, _, first, _, _, _, before = through_a_ball(shown.camera, 0.9, CENTER, index)
    part = part_of(before, np.arcsin(np.sin(before) / index))
    ways, normal = pixel_ways(shown.camera), (first - CENTER) / 0.9
    for name, most in (("trace", 1e-9), ("march", 0.004)):
        found = rays_of(shown, name, fresnel=True)
        both = found.ray.valid & hit & (before < 1.4)
        assert np.abs(found.part - part)[both].max() < most
        assert np.abs(found.share - (1 - part) ** 2)[both].max() < 2 * most
        assert found.reflected is not None
        mirrored = ways - 2 * (ways * normal).sum(1)[:, None] * normal
        assert np.median(angle(found.reflected.direction[both], mirrored[both])) < 0.05
    assert rays_of(shown, "march").reflected is None and (rays_of(shown, "march").share == 1).all()


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_fresnel_at_its_limits(kind):
    way = np.array([(0.0, 0.6, 1.0, 0.9), (0.0, 0.0, 0.0, 0.0), (-1.0, -0.8, 0.0, -np.sqrt(0.19))], kind)
    normal = np.array([(0.0,), (0.0,), (1.0,)], kind)
    within = 10 * float(np.finfo(kind).eps)
    assert fresnel(way, normal, 1.5)[0] == pytest.approx(0.04, abs=within)
    assert np.abs(fresnel(way[:, 2:3], normal, 1.5) - 1).max() < within
    assert fresnel(way[:, 3:], normal, 1 / 1.5)[0] == 1 and (fresnel(way[:, :2], normal, 1.0) < within).all()
    brewster = np.arctan(1.5)
    steep = np.array([[np.sin(brewster)], [0], [-np.cos(brewster)]], kind)
    after = np.arcsin(np.sin(brewster) / 1.5)
    assert fresnel(steep, -normal, 1.5)[0] == pytest.approx(0.5 * np.sin(brewster - after) ** 2, abs=within)


def test_a_pane_shifts_and_does_not_turn():
    """Light leaves a pane as it came; and Wyman's guess of the way inside is the one of his paper, to the letter."""
    half, index, (c, s) = 0.15, 1.4, (np.cos(0.3), np.sin(0.3))
    turn = np.array([(1, 0, 0, 0.2), (0, c, -s, 0.1), (0, s, c, -0.3), (0, 0, 0, 1)])
    shown = scene(box((6.0, half, 6.0)).transformed(turn), index=index)
    ways, normal = pixel_ways(shown.camera), turn[:3, 1]
    for name in ("trace", "march", "wyman"):
        found = rays_of(shown, name)
        assert found.ray.valid.mean() > 0.95 and not found.missing.any()
        assert angle(found.ray.direction, ways).max() < 0.02
    start = EYE + rays_of(shown, "none").distance[:, None] * ways
    before = np.arccos(np.abs(ways @ normal))
    after = np.arcsin(np.sin(before) / index)
    length = after / before * 2 * half / np.cos(before) + (1 - after / before) * 2 * half
    assert 0.2 < before.min() and np.ptp(before) > 0.3
    assert np.abs(np.linalg.norm(found.ray.origin - start, axis=1) - length).max() < 2e-3
    exact = np.linalg.norm(rays_of(shown, "march").ray.origin - start, axis=1)
    assert np.abs(exact - 2 * half / np.cos(after)).max() < 5e-3


def through_a_box(camera, half, index, inner):
    """By the slabs between its sides, in its own axes: where rays leave, whereto, and whether they do."""
    turn, shift = TURN[:3, :3], TURN[:3, 3]
    ways, start = pixel_ways(camera) @ turn, (EYE - shift) @ turn
    near, far = (np.sort([(side - start) / ways for side in (-half, half)], axis=0)[i] for i in (0, 1))
    hit = near.max(1) < far.min(1)
    rows, axis = np.arange(len(ways)), near.argmax(1)
    place, along = start + near.max(1)[:, None] * ways, snell(ways, np.eye(3)[axis], index)[0]
    left, out = np.zeros(len(ways), bool), along.copy()
    for _ in range(inner + 1):
        ends = np.where(along > 0, half - place, -half - place) / np.where(along == 0, 1e-30, along)
        ends[rows, axis] = np.where(np.abs(ends[rows, axis]) < 1e-12, np.inf, ends[rows, axis])
        axis = np.where(left, axis, ends.argmin(1))
        place = np.where(left[:, None], place, place + ends.min(1)[:, None] * along)
        turned, passes = snell(along, np.eye(3)[axis], 1 / index)
        out, along = np.where((passes & ~left)[:, None], turned, out), np.where(passes[:, None], along, turned)
        left |= passes
    return hit, place @ turn.T + shift, out @ turn.T, hit & left


@pytest.mark.parametrize("inner", [0, 1, 3])
def test_total_reflections_in_a_box_are_followed(inner):
    half = np.array((0.5, 0.7, 0.6))
    shown = scene(box(half).transformed(TURN), inner=inner)
    hit, place, out, left = through_a_box(shown.camera, half, 1.5, inner)
    assert 0.3 < left[hit].mean() < 1 or inner
    for name, share in (("trace", 0.995), ("march", 0.965)):
        found = rays_of(shown, name)
        same = (found.ray.valid == left)[hit]
        assert same.mean() > share
        both = found.ray.valid & left
        close = angle(found.ray.direction[both], out[both]) < 0.05
        near = np.linalg.norm(found.ray.origin[both] - place[both], axis=1) < 5e-3
        assert (close & near).mean() > share


def rmse(picture: mp.Refraction, truth: mp.Refraction) -> float:
    """In the glass."""
    return float(np.sqrt(((picture.image() - truth.image())[truth.mask] ** 2).mean()))


def test_pictures_are_what_traced_rays_see():
    shown = scene(mp.Surface.ellipsoid((0.9, 0.5, 0.7)).transformed(TURN), index=1.3, color=(0.7, 0.9, 0.8))
    truth = mp.Refraction(shown, method="raytrace")
    fine, coarse = (rmse(mp.Refraction(shown, size=size), truth) for size in (384, 24))
    others = {name: rmse(mp.Refraction(shown, size=384, second=name), truth) for name in ("wyman", "none")}
    around = rmse(mp.Refraction(shown, method="environment"), truth)
    assert fine < 0.02 and coarse > 3 * fine, (fine, coarse)
    assert 5 * fine < others["wyman"] < 0.7 * others["none"] and around > 5 * fine, (fine, others, around)
    both = (mp.Refraction(shown, fresnel=True, method=method) for method in ("depth_image", "raytrace"))
    assert rmse(*both) < 0.03
    picture = mp.Refraction(shown, size=64)
    beside = ~picture.mask
    assert np.array_equal(picture.image()[beside], mp.render(shown.camera, mp.Scene(**_plain(shown)))[beside])
    assert "second interface" in picture.explanation.ran and "reflection" in picture.explanation.left_out


def _plain(shown: mp.Scene) -> dict[str, Any]:
    names = ("meshes", "lights", "ambient", "background")
    return {name: getattr(shown, name) for name in names}


def test_each_pixel_of_glass_adds_up_what_it_lets_through_and_what_it_reflects():
    """Below one sky, all light comes from it: through is its share and color, reflected the rest of the first share."""
    empty = mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    shown = scene(meshes=(empty,), color=(0.5, 0.8, 1.0), fresnel=True)
    for method in ("depth_image", "raytrace", "environment"):
        picture = mp.Refraction(shown, method=method)
        part, share = picture.rays.part, picture.rays.share
        seen = (share[:, None] * (0.5, 0.8, 1.0) + part[:, None]) * (0.5, 0.6, 0.8)
        assert np.abs(picture.image().reshape(-1, 3) - seen)[picture.mask.ravel()].max() < 1e-5


def test_scenes_move_behind_the_glass():
    shown = scene()
    picture = mp.Refraction(shown, size=192)
    before = picture.image()
    other = dataclasses.replace(shown, meshes=(thing((0.3, 0.1, 0.2)), floor()))
    truth = mp.Refraction(other, method="raytrace")
    assert rmse(picture, truth) > 0.1
    picture.update([other.meshes[0].vertices, None])
    assert rmse(picture, truth) < 0.06
    picture.update(shown.mesh.vertices)
    assert np.abs(picture.image() - before).mean() < 1e-3


def test_hollow_things_are_seen_from_all_sides():
    """Rays leave a torus where one view alone would not see it."""
    shown = scene(mp.Surface.torus(0.7, 0.3).transformed(TURN))
    truth, found = rays_of(shown, "trace"), rays_of(shown, "march")
    glass = np.isfinite(truth.distance)
    alone = rays_of(shown, "march", inside=shown.camera)
    assert found.missing[glass].mean() < 0.02 and alone.missing[glass].mean() > 5 * found.missing[glass].mean()
    both = truth.ray.valid & found.ray.valid
    assert np.quantile(angle(truth.ray.direction, found.ray.direction)[both], 0.9) < 1.0
    assert solid_of(mp.Surface.sphere()).middle_sees_all and not solid_of(mp.Surface.torus(0.7, 0.3)).middle_sees_all


def test_the_inside_is_known_however_faces_run():
    mesh = mp.Surface.torus(0.7, 0.3, CENTER).mesh(2000)
    turned = mp.Mesh(mesh.vertices, np.ascontiguousarray(mesh.faces[:, ::-1]))
    for one in (mesh, turned):
        solid = solid_of(one)
        assert [solid.holds(CENTER + np.array(x)) for x in ((0, 0, 0), (0.7, 0, 0), (0, -0.8, 0.1), (2, 0, 0))] == [
            False,
            True,
            True,
            False,
        ]
        normals = np.asarray(solid.mesh.normals)
        outward = (solid.mesh.face_normals * normals[solid.mesh.faces[:, 0]]).sum(axis=1)
        assert outward.min() > 0.5 and np.median(solid.thickness) == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"second": "guess"}, "march, wyman, trace, none"),
        ({"inner": 9}, "inner=9"),
        ({"fresnel": 1}, "fresnel=1"),
        ({"inside": []}, "inside"),
        ({"inside": mp.Pinhole.from_fov(8, 8, 1.0), "second": "wyman"}, "goes with second='march'"),
        ({"inside": (3,)}, "camera is a int"),
        ({"inside": mp.Pinhole.from_fov(8, 8, 0.1, mp.look_at((9, 0, 0), (19, 0, 0)))}, "none of the cameras"),
        ({"size": 4}, "from 8"),
        ({"bounces": 2}, "no setting 'bounces'"),
        ({"method": "vertex"}, "environment, depth_image, raytrace"),
        ({"method": "raytrace", "size": 64}, "goes with method="),
        ({"refractor": mp.Surface.sphere()}, "is a Ellipsoid"),
        ({"refractor": mp.Refractor(mp.Surface.sphere(9.0))}, "inside of the refractor"),
        ({"refractor": mp.Refractor(mp.Surface.wave())}, "not closed"),
    ],
)
def test_mistakes_are_told(settings, words):
    with pytest.raises(mp.InputError, match=words):
        mp.refraction(scene(), **settings)


def test_mistakes_in_scenes_are_told():
    with pytest.raises(mp.InputError, match="no refractor"):
        mp.refraction((thing(),))
    for settings, words in (
        ({"index": 0.0}, "index=0"),
        ({"color": (1, 1)}, "refractor color"),
        ({"inner": -1}, "inner"),
    ):
        with pytest.raises(mp.InputError, match=words):
            mp.Refractor(mp.Surface.sphere(), **settings)
    with pytest.raises(mp.InputError, match="Mesh or a Surface"):
        mp.Refractor(3)
    with pytest.raises(mp.InputError, match="leave one of them out"):
        mp.Scene((thing(),), mirror=mp.Mirror(mp.Surface.wave()), refractor=mp.Refractor(mp.Surface.sphere()))
    with pytest.raises(mp.InputError, match="scene refractor is a Mirror"):
        mp.Scene((thing(),), refractor=mp.Mirror(mp.Surface.sphere()))


def test_a_scene_file_and_the_command_line_know_glass(tmp_path, capsys):
    from mpcam.cli import app, main

    file = tmp_path / "scene.toml"
    file.write_text(
        '[[mesh]]\nbuiltin = "cube"\nscale = 0.4\ntranslate = [0, 2, 0.1]\n'
        '[camera]\nmodel = "pinhole"\nsize = [40, 30]\nfov = 40\neye = [0.4, -3, 0.5]\ntarget = [0, 0, 0]\n'
        '[refractor]\nsurface = "ellipsoid"\nradii = [0.8, 0.5, 0.6]\nindex = 1.3\ncolor = [0.5, 1, 1]\n'
        'second = "wyman"\ninner = 1\nfresnel = true\n[refractor.depth_images]\nsize = 48\naside = 0.5\n'
        '[compare]\nmethods = ["depth_image", "raytrace"]\ndepth_image.sizes = [32, 64]\n'
    )
    loaded = load_scene(file)
    glass = loaded.scene.refractor
    assert glass is not None
    assert (glass.index, glass.color, glass.second, glass.inner) == (1.3, (0.5, 1, 1), "wyman", 1)
    picture = mp.Refraction(loaded.scene)
    assert (picture.choice.size, picture.choice.aside, picture.inside.second) == (48, 0.5, "wyman")
    assert picture.inside.fresnel and mp.Refraction(loaded.scene, method="raytrace").inside.second == "trace"
    arguments = [
        "render",
        str(file),
        "--second",
        "march",
        "--inner",
        "0",
        "--image-size",
        "64",
        "--explain",
        "--output",
    ]
    app([*arguments, str(tmp_path / "a.exr")], result_action="return_value")
    expected = mp.refraction(loaded.scene, second="march", inner=0, size=64)
    assert np.allclose(mp.read_image(tmp_path / "a.exr")[..., :3], expected, atol=2e-3)
    assert not np.allclose(expected, picture.image(), atol=0.05)
    assert "inner side" in capsys.readouterr().err
    for option in ("--method=vertex", "--second=guess", "--bounces=2"):
        assert main(["render", str(file), option, "--output", str(tmp_path / "b.png")]) == 2
    assert not (tmp_path / "b.png").exists()
    start = file.read_text()
    for old, new, words in (
        ("[compare]", '[mirror]\nsurface = "wave"\n[compare]', "a mirror or a refractor"),
        ("radii = [0.8, 0.5, 0.6]", "radius = 2", "refractor.radius = 2"),
        ('"wyman"', '"guess"', "refractor.second"),
        ('surface = "ellipsoid"\nradii = [0.8, 0.5, 0.6]', 'builtin = "plane"', None),
    ):
        file.write_text(start.replace(old, new))
        with pytest.raises(mp.InputError, match=words or "not closed"):
            mp.refraction(load_scene(file).scene)


def test_comparisons_tell_what_the_second_interface_costs(tmp_path):
    shown = scene(mp.Surface.ellipsoid((0.9, 0.5, 0.7)).transformed(TURN), size=(48, 36), index=1.3)
    plan = {"depth_image": [{"size": 256}, {"size": 256, "second": "none"}], "environment": [64]}
    found = mp.compare(shown, settings=plan, repeats=1, output=tmp_path / "out")
    rows = {(row.method, row.setting): row for row in found.rows}
    assert list(rows) == [
        ("environment", "64"),
        ("depth_image", "256"),
        ("depth_image", "256 second=none"),
        ("raytrace", ""),
    ]
    assert rows["raytrace", ""].rmse == 0 < 3 * rows["depth_image", "256"].rmse < rows["environment", "64"].rmse
    assert 3 * rows["depth_image", "256"].rmse < rows["depth_image", "256 second=none"].rmse
    assert "0 % of the rays" in rows["depth_image", "256"].note and found.scene["refractor"] == "Ellipsoid, index 1.3"
    assert len(mirror_plan(shown, None, None)) == 3 + 4 + 2 + 1
    with pytest.raises(mp.InputError, match="shows no refractor"):
        mp.compare(shown, methods="camera_triangles")
