"""Cameras as Mitsuba sensors, and shading, against what Mitsuba renders by itself."""

import subprocess
import sys

import mitsuba as mi
import numpy as np
import pytest
from kit import depth_image
from triangle_cameras import CAMERAS, around

import mpcam as mp
from mpcam.cameras.serialize import camera_to_json
from mpcam.tracing.meshes import mitsuba_mesh

EYE = mp.look_at((0.12, 0.07, 0.31), (0.5, 1.0, 0.7))


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")
    mp.truth.register()


@pytest.mark.parametrize("name", ["direct", "mirror", "sizes", "lens", "mixed signs"])
def test_sensor_traces_the_rays_of_camera_triangles(name):
    camera = CAMERAS[name]()
    mesh = around(camera, 150, 0.8)
    hits = mp.rasterize(camera, mesh)
    image = depth_image(mp.truth.sensor(camera, 1, centered=True), mesh)
    # At the edges of triangles either answer is right in float32.
    assert ((image > 0) != hits.mask).sum() <= 3
    both = hits.mask & (image > 0)
    assert both.sum() > 300
    off = np.abs(image - np.where(both, hits.depth, 0))[both] / np.ptp(mesh.bounds)
    assert (off > 1e-4).sum() <= 6 and np.median(off) < 1e-6


def test_pinhole_sensor_is_mitsubas_own():
    """Same field of view, orientation and pixel grid as the plugin `perspective`, which has x left and y up."""
    camera = mp.Pinhole.from_fov(80, 60, 1.3, EYE)
    to_world = mi.ScalarTransform4f((np.linalg.inv(EYE) @ np.diag([-1, -1, 1, 1.0])).tolist())
    film = {"type": "hdrfilm", "width": 80, "height": 60, "rfilter": {"type": "box"}}
    own = {"type": "perspective", "fov": np.degrees(1.3), "fov_axis": "x", "to_world": to_world, "film": film}
    own["near_clip"] = 1e-5  # where Mitsuba's rays start
    mesh = mp.builtin_mesh("quad_room")
    ours = depth_image(mp.truth.sensor(camera, 256), mesh, 256)
    theirs = depth_image(own, mesh, 256)
    assert np.abs(ours - theirs).max() < 0.05 * theirs.max()
    assert np.abs(ours - theirs).mean() < 0.002 * theirs.mean()


def test_orthographic_sensor_is_mitsubas_own():
    camera = mp.Orthographic(64, 64, 32, camera_from_world=mp.look_at((0, -4, 1), (0, 0, 0)))
    pose = np.asarray(camera.camera_from_world)
    to_world = mi.ScalarTransform4f((np.linalg.inv(pose) @ np.diag([-1, -1, 1, 1.0])).tolist())
    film = {"type": "hdrfilm", "width": 64, "height": 64, "rfilter": {"type": "box"}}
    mesh = mp.builtin_mesh("sphere", triangles=1280).transformed(np.diag([0.7, 0.7, 0.7, 1]))
    ours = depth_image(mp.truth.sensor(camera, 256), mesh, 256)
    theirs = depth_image({"type": "orthographic", "to_world": to_world, "film": film}, mesh, 256)
    assert np.abs(ours - theirs).mean() < 0.02


def test_ray_differentials_are_a_step_of_one_pixel():
    camera = mp.Radial.equidistant(64, 64, EYE)
    sensor = mi.load_dict(mp.truth.sensor(camera))
    ray, _ = sensor.sample_ray_differential(0.0, 0.5, mi.Point2f(0.4, 0.6), mi.Point2f(0, 0))
    for direction, pixel in ((ray.d, (25.6, 38.4)), (ray.d_x, (26.6, 38.4)), (ray.d_y, (25.6, 39.4))):
        assert np.allclose(np.array(direction).ravel(), camera.ray(pixel).direction, atol=2e-6)


def test_pixels_outside_of_the_view_are_black():
    camera = mp.Radial.paraboloid(64, 64)
    scene = {"type": "scene", "light": {"type": "constant"}, "sensor": mp.truth.sensor(camera, 1, centered=True)}
    image = np.array(mi.render(mi.load_dict(scene | {"integrator": {"type": "direct"}}), spp=1)).sum(-1)
    u, v = np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5)
    assert np.array_equal(image > 0, camera.ray(np.stack([u, v], -1)).valid)


def test_sensor_from_a_scene_file(tmp_path):
    (tmp_path / "camera.json").write_text(camera_to_json(mp.Radial.equisolid(32, 24, EYE)))
    (tmp_path / "scene.xml").write_text(
        f"""<scene version="3.0.0"><integrator type="depth"/>
        <shape type="sphere"><float name="radius" value="9"/></shape>
        <sensor type="mpcam"><string name="camera" value="{tmp_path / "camera.json"}"/>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/></film></sensor>
        </scene>"""
    )
    image = np.array(mi.render(mi.load_file(str(tmp_path / "scene.xml")), spp=4))
    assert image.shape[:2] == (24, 32)
    assert image.max() > 5


def test_mistakes_in_a_sensor_are_named():
    camera = mp.Pinhole(32, 24)
    with pytest.raises(mp.InputError, match="samples=0"):
        mp.truth.sensor(camera, 0)
    with pytest.raises(mp.InputError, match="camera=str"):
        mp.truth.sensor("camera")
    broken = mp.truth.sensor(camera) | {"film": {"type": "hdrfilm", "width": 10, "height": 10}}
    with pytest.raises((mp.InputError, RuntimeError), match="film is 10x10 pixels, the camera 32x24"):
        mi.load_dict(broken)
    with pytest.raises((mp.InputError, RuntimeError), match="neither JSON nor a file"):
        mi.load_dict(mp.truth.sensor(camera) | {"camera": "no such file"})


def test_a_users_variant_stays():
    script = (
        "import mitsuba as mi; mi.set_variant('scalar_rgb'); import mpcam as mp;"
        "mp.rasterize(mp.Pinhole(8, 8), mp.builtin_mesh('cube'), method='raytrace'); print(mi.variant())"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.strip() == "scalar_rgb"


@pytest.mark.parametrize("smooth", [False, True])
def test_shading_is_mitsubas_direct_light(smooth):
    """Point light at the viewer (so that nothing is in shadow) and a sun from behind, on a convex body."""
    eye = np.array([0.3, -2.5, 0.8])
    camera = mp.Radial.equidistant(96, 96, mp.look_at(eye, (0, 0, 0)), fov=1.2)
    body = mp.builtin_mesh("sphere", triangles=1280)
    body = mp.Mesh(body.vertices, body.faces, normals=body.vertices if smooth else None,
                   materials=(mp.Material((0.7, 0.4, 0.2)),))  # fmt: skip
    sun, lamp = mp.DirectionalLight((0.2, 1.0, -0.3), (0.6, 0.7, 0.8)), mp.PointLight(eye, (3.0, 2.0, 1.0))
    scene = mp.Scene((body,), lights=(sun, lamp), ambient=(0, 0, 0))
    bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.4, 0.2]}}}
    reference = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
            "body": mitsuba_mesh(mi, "body", body.vertices, body.faces, normals=body.normals, bsdf=bsdf),
            # Radiance of a white surface is irradiance / pi there, and irradiance here.
            "sun": {
                "type": "directional",
                "direction": [0.2, 1.0, -0.3],
                "irradiance": {"type": "rgb", "value": [0.6 * np.pi, 0.7 * np.pi, 0.8 * np.pi]},
            },
            "lamp": {
                "type": "point",
                "position": eye.tolist(),
                "intensity": {"type": "rgb", "value": [3 * np.pi, 2 * np.pi, np.pi]},
            },
            "sensor": mp.truth.sensor(camera, 256, centered=True),
        }
    )
    # The integrator picks one of the two lights at random: the mean over samples converges to their sum.
    expected = np.array(mi.render(reference, spp=1024))
    ours = mp.render(camera, scene)
    inside = mp.rasterize(camera, scene).mask
    grazing = ours.sum(-1) < 0.2  # near the terminator Mitsuba shadows smooth normals, and we cast no shadows
    use = inside & ~grazing
    assert use.mean() > 0.3
    assert np.abs(ours - expected)[use].mean() < 0.02 * ours[use].mean()


def test_shading_modes():
    scene = mp.builtin_scene("facade", 64, 64)
    images = {mode: mp.render(scene.camera, scene, shading=mode) for mode in ("color", "normal", "texture", "light")}
    mask = mp.rasterize(scene.camera, scene).mask
    for image in images.values():
        assert image.shape == (64, 64, 3)
        assert image.dtype == np.float32
        assert np.allclose(image[~mask], scene.background, atol=1e-6)
    normals = images["normal"][mask] * 2 - 1
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 1e-3
    assert (np.abs(images["texture"] - images["color"])[mask] > 0.05).any()
    assert (images["light"][mask] > 0).all()


def test_texture_look_up_is_bilinear_and_repeats():
    texture = np.random.default_rng(2).uniform(size=(4, 8, 3)).astype(np.float32)
    corners = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1.0]])
    uv = np.array([[-0.5, 2.25], [2.5, 2.25], [2.5, -0.75], [-0.5, -0.75]])
    mesh = mp.Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), uv=uv, materials=(mp.Material((1, 1, 1), texture),))
    camera = mp.Pinhole(64, 64, 32, 32)
    ours = mp.render(camera, mesh, shading="texture")
    at = mp.interpolate(mp.rasterize(camera, mesh), uv)
    u, v = (at[..., 0] % 1) * 8 - 0.5, (1 - at[..., 1] % 1) * 4 - 0.5
    x, y = np.floor(u).astype(int), np.floor(v).astype(int)
    fx, fy = (u - x)[..., None], (v - y)[..., None]

    def texel(i, j):
        return texture[(y + j) % 4, (x + i) % 8]

    expected = (texel(0, 0) * (1 - fx) + texel(1, 0) * fx) * (1 - fy) + (texel(0, 1) * (1 - fx) + texel(1, 1) * fx) * fy
    assert np.abs(ours - expected).max() < 1e-3


def test_interpolation_reproduces_linear_functions():
    mesh = mp.builtin_mesh("quad_room")
    camera = mp.Radial.equisolid(48, 48, EYE, fov=1.7 * np.pi)
    hits = mp.rasterize(camera, mesh)
    linear = mesh.vertices @ np.array([[1.0, 2], [0.5, -1], [3, 0]]) + [1, 2]
    expected = hits.points @ np.array([[1.0, 2], [0.5, -1], [3, 0]]) + [1, 2]
    assert np.allclose(mp.interpolate(hits, linear)[hits.mask], expected[hits.mask])
    per_corner = mp.interpolate(hits, linear[mesh.faces])
    assert np.array_equal(per_corner, mp.interpolate(hits, linear))
