"""Shadow maps: against traced rays, against plane geometry, and in the shading kernel."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

import mpcam as mp
from mpcam.cli import main
from mpcam.effects import shadows as module
from mpcam.math import PI
from mpcam.rendering import shade as shade_module
from mpcam.tracing.meshes import mitsuba_mesh
from mpcam.tracing.variant import mitsuba

LAMPS = {"facade": (3.0, 1.0, 3.0), "temple": (2.0, 1.0, 3.0), "characters": (0.5, 0.5, 3.0)}


def to_light(points: np.ndarray, light) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions to the light, and how far it is away (for parallel light: far)."""
    if isinstance(light, mp.DirectionalLight):
        return np.broadcast_to(-np.array(light.direction), points.shape), np.full(len(points), 1e3)
    away = np.array(light.position) - points
    distance = np.linalg.norm(away, axis=-1)
    return away / distance[:, None], distance


def traced(mesh: mp.Mesh, points: np.ndarray, normals: np.ndarray, light) -> np.ndarray:
    """Whether rays from points on surfaces reach the light."""
    direction, _ = to_light(points, light)
    side = np.sign((direction * normals).sum(-1, keepdims=True))
    start = points + 1e-5 * np.ptp(mesh.bounds, axis=0).max() * side * normals
    direction, distance = to_light(start, light)
    with mitsuba() as mi:
        scene = mi.load_dict({"type": "scene", "mesh": mitsuba_mesh(mi, "mesh", mesh.vertices, mesh.faces)})
        ray = mi.Ray3f(mi.Point3f(start.T.astype(np.float32)), mi.Vector3f(direction.T.astype(np.float32)))
        ray.maxt = mi.Float((0.99999 * distance).astype(np.float32))
        return ~np.array(scene.ray_test(ray))


class View:
    """What a camera sees, and which of it is turned to the light."""

    def __init__(self, camera, mesh: mp.Mesh, light, size: int):
        self.hits = mp.rasterize(camera, mesh)
        self.mask = self.hits.mask
        self.points, self.normals = self.hits.points[self.mask], mesh.face_normals[self.hits.triangle[self.mask]]
        towards = self.normals * np.sign((self.normals * (camera.eye - self.points)).sum(-1, keepdims=True))
        direction, distance = to_light(self.points, light)
        self.cosine = (towards * direction).sum(-1)
        self.use = self.cosine > 1e-3
        self.truth = traced(mesh, self.points, self.normals, light)
        if isinstance(light, mp.PointLight):
            self.texel = distance * (1 + np.abs(direction[:, 0])) / (0.5 * size - 2)
        else:
            self.texel = np.full(len(distance), 1 / mp.shadow_map(mesh, light, size).cameras[0].scale)

    def near_edges(self) -> np.ndarray:
        """Pixels within a texel and a half, as it lies on the surface, of where light and shadow meet in the image."""
        image: Any = np.full(self.mask.shape, -1)
        image[self.mask] = self.truth
        edge: Any = np.zeros(image.shape, bool)
        for one, other in ((image, edge), (image.T, edge.T)):
            changes = (one[1:] != one[:-1]) & (one[1:] >= 0) & (one[:-1] >= 0)
            other[1:] |= changes
            other[:-1] |= changes
        pixel = PI / image.shape[1] * self.hits.depth[self.mask]
        reach = 1.5 + 1.5 * self.texel / np.maximum(self.cosine, 0.05) / pixel
        distance: Any = distance_transform_edt(~edge)
        return distance[self.mask] <= reach

    def wrong(self, visible: np.ndarray) -> tuple[float, float]:
        """Share of the pixels that differ from the truth, of all and of those that are not near an edge."""
        differs = (visible != self.truth) & self.use
        return differs.sum() / self.use.sum(), (differs & ~self.near_edges()).sum() / self.use.sum()


def lights(name: str) -> dict[str, mp.DirectionalLight | mp.PointLight]:
    return {"sun": mp.builtin_scene(name, 8, 8).lights[0], "lamp": mp.PointLight(LAMPS[name])}


@pytest.mark.parametrize("kind", ["sun", "lamp"])
@pytest.mark.parametrize("name", LAMPS)
def test_light_and_shadow_are_those_of_traced_rays(name, kind, monkeypatch):
    scene, light = mp.builtin_scene(name, 256, 256), lights(name)[kind]
    view = View(scene.camera, scene.mesh, light, 1024)
    assert 0.2 < view.truth[view.use].mean() < 0.995
    made = mp.shadow_map(scene, light, 1024)
    whole, inside = view.wrong(made.visible(view.points, view.normals))
    assert whole < (0.045 if kind == "sun" else 0.008)
    assert inside < 4e-4
    coarse, coarse_inside = view.wrong(made.visible(view.points))
    assert coarse < 2.5 * whole
    assert coarse_inside < 3e-3
    # The plane and the slack are what makes it so.
    monkeypatch.setattr(module, "SLACK_WITHOUT_NORMALS", 0.0)
    assert view.wrong(made.visible(view.points))[1] > 0.02


def test_more_texels_make_sharper_shadows():
    scene = mp.builtin_scene("facade", 256, 256)
    light = scene.lights[0]
    wrong = []
    for size in (512, 2048):
        view = View(scene.camera, scene.mesh, light, size)
        wrong.append(view.wrong(mp.shadow_map(scene, light, size).visible(view.points, view.normals))[0])
    assert wrong[1] < 0.4 * wrong[0]


@pytest.mark.parametrize("angle", [0, 30, 60, 80, 88])
@pytest.mark.parametrize("parts", [2, 20_000])
def test_a_flat_surface_does_not_shade_itself(angle, parts):
    mesh, rng = mp.builtin_mesh("plane", triangles=parts), np.random.default_rng(angle)
    points = np.concatenate([rng.uniform(-0.45, 0.45, (5000, 2)), np.zeros((5000, 1))], axis=1)
    along = np.array([np.sin(np.radians(angle)) * 0.8, np.sin(np.radians(angle)) * 0.6, np.cos(np.radians(angle))])
    for light in (mp.DirectionalLight(-along), mp.PointLight(3 * along), mp.PointLight(0.3 * along + (0, 0, 0.05))):
        made = mp.shadow_map(mesh, light, 128)
        for normal in ((0, 0, 1), (0, 0, -5)):
            assert made.visible(points, np.broadcast_to(normal, points.shape)).all()


def floor_and_tile(matrix: np.ndarray) -> mp.Mesh:
    """A floor of 4 x 4 and a tile of 1 x 1 one above it."""
    x, y = np.array([-1, 1, 1, -1.0]), np.array([-1, -1, 1, 1.0])
    corners = np.concatenate([np.stack([2 * x, 2 * y, 0 * x], -1), np.stack([0.5 * x, 0.5 * y, 0 * x + 1], -1)])
    return mp.Mesh(corners, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).transformed(matrix)


def placed(scale: float, shift: float) -> np.ndarray:
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = scale * shift
    return matrix


@pytest.mark.parametrize(("scale", "shift"), [(1, 0), (1e-6, 1e4), (1e6, 1e4), (1, -1e5)])
@pytest.mark.parametrize("kind", ["sun", "lamp"])
def test_the_shadow_of_a_tile_is_where_it_belongs(kind, scale, shift):
    """Up to a texel from the edge, wherever the scene lies and however large it is."""
    size = 256
    matrix = placed(scale, shift)
    rng = np.random.default_rng(7)
    points = np.concatenate([rng.uniform(-1.9, 1.9, (20_000, 2)), np.zeros((20_000, 1))], axis=1)
    if kind == "sun":
        light, center, half, texel = mp.DirectionalLight((0.3, -0.2, -1)), np.array([0.3, -0.2]), 0.5, 4.3 / (size - 4)
    else:  # twice as high as the tile: a shadow twice as large, of texels seen from the front view's side
        light = mp.PointLight(matrix[:3, :3] @ (0, 0, 2) + matrix[:3, 3])
        center, half, texel = np.zeros(2), 1.0, 3.5 * 2 / (0.5 * size - 2)
    inside = half - np.abs(points[:, :2] - center).max(-1)
    world = points @ matrix[:3, :3].T + matrix[:3, 3]
    made = mp.shadow_map(floor_and_tile(matrix), light, size)
    found = made.visible(world, np.broadcast_to((0, 0, 1), points.shape))
    clear = np.abs(inside) > texel
    assert 0.5 < clear.mean() < 1
    assert np.array_equal(found[clear], inside[clear] < 0)
    assert np.isfinite(made.depths[0]).any()


def test_both_sides_of_a_thin_sheet_are_reached_and_what_is_behind_is_not():
    tile = mp.Mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]], [[0, 1, 2], [0, 2, 3]])
    for light in (mp.PointLight((0, 0, 2)), mp.DirectionalLight((0, 0, -1))):
        made = mp.shadow_map(tile, light, 64)
        points = [(0.2, 0.1, 0.0), (0.2, 0.1, 0.5), (0.2, 0.1, -0.5), (5.0, 0.1, -0.5), (0.2, 0.1, 9.0)]
        assert made.visible(points).tolist() == [True, True, False, True, True]
        assert made.visible(points[0], (0, 0, -1)) and made.visible(points[0], (0, 0, 1))
        assert made.visible([points] * 2).shape == (2, 5)
        assert made.visible(np.zeros((0, 3))).shape == (0,)


def test_nothing_casts_no_shadow():
    corners = [[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]]
    for mesh in (mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), mp.Mesh(corners, [[0, 1, 2]])):
        for light in (mp.PointLight((0, 0, 1)), mp.DirectionalLight((0, 1, -1))):
            made = mp.shadow_map(mesh, light, 16)
            assert made.visible(np.random.default_rng(0).normal(size=(50, 3))).all()
            assert np.isinf(made.depths[0]).all()


# In images


def lamp_lit(name: str, size: int = 128) -> mp.Scene:
    """A built-in scene without ambient light, all white, with a sun and a lamp."""
    scene = mp.builtin_scene(name, size, size)
    mesh = mp.Mesh(scene.mesh.vertices, scene.mesh.faces, materials=mp.Material((1, 1, 1)))
    both = (scene.lights[0], mp.PointLight(LAMPS[name], (4, 4, 4)))
    return replace(scene, meshes=(mesh,), lights=both, ambient=(0, 0, 0), background=(0, 0, 0))


@pytest.mark.parametrize("name", ["facade", "temple"])
def test_the_kernel_shades_as_the_maps_say(name):
    scene = lamp_lit(name)
    for camera in (
        scene.camera,
        mp.Radial.equisolid(128, 128, scene.camera.camera_from_world, fov=1.8 * PI),
        mp.Orthographic(128, 128, 9, camera_from_world=mp.look_at((-15, -20, 30), (0, 0, 1))),
    ):
        hits = mp.rasterize(camera, scene)
        mask = hits.mask
        points, normals = hits.points[mask], scene.mesh.face_normals[hits.triangle[mask]]
        expected = np.zeros((mask.sum(), 3))
        for light in scene.lights:
            alone = mp.shade(hits, replace(scene, lights=(light,)))[mask]
            expected += alone * mp.shadow_map(scene, light, 512).visible(points, normals)[:, None]
        image = mp.render(camera, scene, shadows=True, shadow_size=512)
        assert np.allclose(image[~mask], 0)
        close = np.isclose(image[mask], expected, atol=1e-3).all(-1)
        assert close.mean() > 0.999  # the kernel's own float32 places, where a texel decides
        assert (np.abs(mp.shade(hits, scene)[mask] - expected) > 0.05).any(-1).mean() > 0.01


def test_smooth_normals_do_not_change_what_is_in_shadow():
    """Shading normals light a surface; its own plane decides on the shadow."""
    ball = mp.builtin_mesh("sphere", triangles=320)
    smooth = mp.Mesh(ball.vertices, ball.faces, normals=ball.vertices)
    camera = mp.Radial.equidistant(96, 96, mp.look_at((0, -3, 0), (0, 0, 0)), fov=1.0)
    scene = mp.Scene((smooth,), lights=(mp.DirectionalLight((0.7, 0.7, -0.1)),), ambient=(0, 0, 0))
    hits = mp.rasterize(camera, smooth)
    reached = mp.shadow_map(smooth, scene.lights[0]).visible(hits.points, ball.face_normals[hits.triangle])
    with_shadows, without = mp.render(camera, scene, shadows=True), mp.render(camera, scene)
    bright = without[..., 0] > 1e-3
    assert bright.sum() > 500
    assert np.array_equal(with_shadows[bright, 0] > 0, (reached & hits.mask)[bright])


def test_shadows_that_are_off_are_not_in_the_kernel(monkeypatch):
    scene, asked = lamp_lit("temple", 32), []
    kernel = shade_module._kernel

    def watched(*kind):
        def run(triangle, weights, data):
            asked.append(set(data))
            return kernel(*kind)(triangle, weights, data)

        return run

    monkeypatch.setattr(shade_module, "_kernel", watched)
    monkeypatch.setattr(module, "shadow_map", lambda *_: pytest.fail("a shadow map was made"))
    image = mp.render(scene.camera, scene)
    assert np.array_equal(image, mp.shade(mp.rasterize(scene.camera, scene), scene))
    assert asked and all("shadows" not in data for data in asked)
    monkeypatch.undo()
    monkeypatch.setattr(shade_module, "_kernel", watched)
    mp.render(scene.camera, scene, shadows=True, shadow_size=32)
    assert "shadows" in asked[-1]


def test_maps_are_made_once_for_many_frames():
    scene = lamp_lit("temple", 64)
    maps = module.shadow_maps(scene, 256)
    for turn in range(3):
        eye = np.array([0.1 * turn, 0.2, 1.6])
        camera = scene.camera.with_pose(mp.look_at(eye, eye + (1, turn, 0)))
        image = mp.shade(mp.rasterize(camera, scene), scene, shadows=maps)
        assert np.array_equal(image, mp.render(camera, scene, shadows=True, shadow_size=256))


@pytest.mark.parametrize("method", ["vertex", "cubemap", "raytrace"])
def test_every_method_has_shadows(method):
    scene = lamp_lit("temple", 48)
    plain = mp.render(scene.camera, scene, method)
    shadowed = mp.render(scene.camera, scene, method, shadows=True)
    assert (shadowed <= plain + 1e-6).all()
    assert (shadowed < plain - 0.05).mean() > 0.02
    empty = replace(scene, meshes=(mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)),))
    assert not mp.render(scene.camera, empty, shadows=True).any()


def test_the_command_line_renders_shadows(tmp_path, capsys):
    files = [str(tmp_path / name) for name in ("a.exr", "b.exr")]
    assert main(["render", "temple", "--size", "64", "--output", files[0]]) == 0
    options = ["--shadows", "--shadow-size", "256"]
    assert main(["render", "temple", "--size", "64", "--output", files[1], *options]) == 0
    scene = mp.builtin_scene("temple", 64, 64)
    assert np.allclose(mp.read_image(files[0]), mp.render(scene.camera, scene), atol=2e-3)
    expected = mp.render(scene.camera, scene, shadows=True, shadow_size=256)
    assert np.allclose(mp.read_image(files[1]), expected, atol=2e-3)
    assert not np.allclose(expected, mp.render(scene.camera, scene), atol=0.05)
    for wrong, said in (
        (["--shadow-size", "64"], "goes with --shadows"),
        (["--shadows", "--shadow-size", "0"], "shadow_size=0"),
        (["--shadows", "--shading", "color"], "shading='light'"),
    ):
        assert main(["render", "cube", "--output", str(tmp_path / "c.png"), *wrong]) == 2
        error = capsys.readouterr().err
        assert said in error and error.count("\n") == 1
    assert not (tmp_path / "c.png").exists()


SUN = mp.DirectionalLight((0, 0, -1))


def lit(mesh, *lights) -> mp.Scene:
    return mp.Scene((mesh,), lights=lights)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c, m: mp.shadow_map(m, "sun"), "light is a str: give a PointLight or a DirectionalLight"),
        (lambda c, m: mp.shadow_map(m, SUN, 4), "size=4: a whole number of pixels from 8 to 16384"),
        (lambda c, m: mp.shadow_map("m", SUN), "a str is not a scene"),
        (lambda c, m: mp.shadow_map(m, SUN).visible((0, 1)), r"points has shape \(2,\)"),
        (lambda c, m: mp.shadow_map(m, SUN).visible((0, 1, np.nan)), "points is .*nan.*: finite numbers"),
        (lambda c, m: mp.shadow_map(m, SUN).visible([(0, 1, 2)], (0, 0, 1)), r"normals have shape \(3,\) and points"),
        (lambda c, m: mp.shadow_map(m, SUN).visible((0, 1, 2), (0, 0, 0)), "normals is .*: give a direction"),
        (lambda c, m: mp.render(c, m, shadows=True), "shadows: the scene has no lights; give it a DirectionalLight"),
        (
            lambda c, m: mp.render(c, lit(m, SUN), shadows=True, shading="normal"),
            "with shading='light', not with 'norm",
        ),
        (lambda c, m: mp.render(c, lit(m, SUN), shadows=True, shadow_size=1), "shadow_size=1: a whole number"),
        (lambda c, m: mp.shade(mp.rasterize(c, m), lit(m, SUN), shadows=[1]), "1 shadow maps that are not those of"),
        (
            lambda c, m: mp.shade(mp.rasterize(c, m), lit(m, SUN, SUN), shadows=[mp.shadow_map(m, SUN, 8)]),
            "1 shadow maps that are not those of the scene's 2 lights",
        ),
        (
            lambda c, m: mp.shade(mp.rasterize(c, m), lit(m, SUN), "color", [mp.shadow_map(m, SUN, 8)]),
            "with shading='light', not with 'color'",
        ),
    ],
)
def test_mistakes_are_named(call, words):
    with pytest.raises(mp.InputError, match=words) as caught:
        call(mp.Radial.paraboloid(8, 8), mp.builtin_mesh("cube"))
    assert "\n" not in str(caught.value)
