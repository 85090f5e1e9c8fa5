"""Screen-space ambient occlusion against closed forms, traced rays and brute force."""

import math

import numpy as np
import pytest

import mpcam as mp
from mpcam.effects.horizon_occlusion import screen_occlusion_device
from mpcam.experiments.rosen2011_scenes import statue_scene

KINDS = ("quadratic", "linear", "none")
NADIR = mp.look_at((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))


def quad(*corners) -> mp.Mesh:
    return mp.Mesh(corners, [[0, 1, 2], [0, 2, 3]])


def ground(half: float = 60.0) -> mp.Mesh:
    return quad((-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0))


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("eye", "fov"), [((0, 0, 2), 1.0), ((1, -3, 2), 1.9), ((0.3, 4, 0.7), 0.6)])
def test_a_plane_covers_nothing_of_itself(eye, fov, scale):
    """Anywhere in the image, however it is tilted, without a bias, for lines turned at random."""
    turned = np.diag([scale, scale, scale, 1.0])
    turned[:3, :3] = scale * np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    pose = mp.look_at(turned[:3, :3] @ np.array(eye, float), turned[:3, :3] @ np.array((0.1, 0.2, 0.0)))
    hits = mp.rasterize(mp.Pinhole.from_fov(70, 50, fov, camera_from_world=pose), ground().transformed(turned))
    assert hits.mask.mean() > 0.5
    for radius, falloff in ((0.5 * scale, "quadratic"), (math.inf, "none")):
        exposure = mp.screen_occlusion(hits, radius, falloff=falloff, bias=1e-3, blur=1, directions=5, steps=9)
        np.testing.assert_allclose(exposure, 1.0, atol=2e-5)


@pytest.mark.parametrize("height", [0.3, 1.0, 2.5])
def test_a_long_wall_at_right_angles(height):
    """Seen from the side: A = 1 - atan(H / d) / pi, one half for a wall without end."""
    wall = quad((1.0, -200, 0), (1.0, 200, 0), (1.0, 200, height), (1.0, -200, height))
    pose = mp.look_at((-5.0, 0.0, 6.0), (-5.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = mp.Pinhole(180, 200, 120.0, 25.0, cx=-40.0, cy=104.0, camera_from_world=pose)
    hits = mp.rasterize(camera, mp.Mesh.concatenate([ground(200.0), wall]))
    exposure = mp.screen_occlusion(hits, math.inf, falloff="none", blur=1, bias=0.0, directions=32, steps=300)
    place = hits.points
    floor = np.abs(place[..., 2]) < 1e-3
    near = floor & (place[..., 0] > -0.6) & (place[..., 0] < 0.95) & (np.abs(place[..., 1]) < 1.0)
    exact = 1.0 - np.arctan2(height, 1.0 - place[..., 0]) / np.pi
    assert near.sum() > 100
    off = (exposure - exact)[near]
    # The top of the wall is met to within a pixel, of which the lowest one has six.
    low = min(height, 1.0)
    assert abs(off.mean()) < 0.006 / low and np.abs(off).max() < 0.02 / low
    # Farther than the wall reaches, nothing of it counts.
    short = mp.screen_occlusion(hits, 0.3, falloff="none", blur=1, directions=16, steps=60)
    assert (short[floor & (place[..., 0] < 0.65)] == 1.0).all()
    assert short[floor & (place[..., 0] > 0.9) & (place[..., 0] < 0.98)].max() < 0.9


def test_an_endless_wall_covers_half():
    wall = quad((0.02, -200, 0), (0.02, 200, 0), (0.02, 200, 3), (0.02, -200, 3))
    camera = mp.Pinhole(151, 101, 750.0, camera_from_world=NADIR)
    hits = mp.rasterize(camera, mp.Mesh.concatenate([ground(200.0), wall]))
    exposure = mp.screen_occlusion(hits, math.inf, falloff="none", blur=1, bias=0.0, directions=64, steps=150)
    assert exposure[50, 75] == pytest.approx(1 - math.atan(3 / 0.02) / math.pi, abs=0.025)


def bump() -> mp.Mesh:
    """A smooth hill on a plane, all of it seen from above: what the camera sees is all that there is."""
    mesh = mp.builtin_mesh("plane", 20_000).transformed(np.diag([3.0, 3.0, 1.0, 1.0]))
    x, y = mesh.vertices[:, :2].T
    up = 0.7 * np.exp(-((x - 0.2) ** 2 + 2 * y**2) / 0.18) + 0.25 * np.cos(2.5 * x) * np.cos(3 * y)
    return mp.Mesh(np.stack([x, y, up], 1), mesh.faces)


@pytest.mark.parametrize("falloff", KINDS)
def test_a_hilly_ground_is_as_traced(falloff):
    pose = mp.look_at((0.4, -0.5, 7.0), (0.1, 0.1, 0.0))
    hits = mp.rasterize(mp.Pinhole.from_fov(100, 80, 0.5, camera_from_world=pose), bump())
    assert hits.mask.all()
    inner = (slice(18, -18), slice(18, -18))
    truth = mp.traced_occlusion(hits, 0.8, falloff=falloff, rays=200)[inner]
    exposure = mp.screen_occlusion(hits, 0.8, falloff=falloff, blur=1, bias=0.0, directions=32, steps=64)[inner]
    assert truth.min() < 0.75 and truth.max() > 0.97
    assert np.abs(exposure - truth).mean() < 0.012
    assert abs((exposure - truth).mean()) < 0.004
    others = [
        mp.traced_occlusion(hits, 0.8, falloff=other, rays=64)[inner] for other in ("quadratic", "linear", "none")
    ]
    closest = int(np.argmin([np.abs(exposure - other).mean() for other in others]))
    assert ("quadratic", "linear", "none")[closest] == falloff


def test_traced_rays_are_right():
    """Against the exact share of the solid angle, by counting pixels, and a closed form with each falloff."""
    pose = mp.look_at((0.0, 0.0, 8.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = mp.Pinhole.from_fov(9, 7, 0.4, camera_from_world=pose)
    roof = quad((-400, -400, 10.0), (-400, 400, 10.0), (400, 400, 10.0), (400, -400, 10.0))
    hits = mp.rasterize(camera, mp.Mesh.concatenate([ground(), roof]))
    hits_floor = hits.depth > 7
    assert hits_floor.all()
    # A roof at height h: it is h / cos away, so the share within the radius is 1 - h / R, and with weights
    # the integral of W(h / c) over the cosine c from h / R to 1.
    h, radius = 10.0, 16.0
    a = h / radius
    exact = {
        "none": a,
        "linear": 1 - (1 - a + a * math.log(a)),
        "quadratic": 1 - ((1 - a) - a * a * (1 / a - 1)),
    }
    for falloff, value in exact.items():
        found = mp.traced_occlusion(hits, radius, falloff=falloff, rays=800)
        np.testing.assert_allclose(found, value, atol=0.004)
    statue = statue_scene(8_000, 0.1, 40, 30)
    seen = mp.rasterize(statue.camera, statue.mesh)
    found = mp.traced_occlusion(seen, math.inf, falloff="none", rays=600)
    chosen = np.argwhere(seen.mask)[::61]
    normals = statue.mesh.face_normals[seen.triangle[tuple(chosen.T)]]
    points = seen.points[tuple(chosen.T)]
    eye = np.linalg.inv(np.asarray(statue.camera.camera_from_world))[:3, 3]
    normals = normals * np.sign(((eye - points) * normals).sum(1))[:, None]
    exact_share = mp.ambient_occlusion(statue.mesh, points, normals, 64, "uniform")
    np.testing.assert_allclose(found[tuple(chosen.T)], exact_share, atol=0.02)


def test_a_statue_is_near_to_traced():
    """Where what is seen is not all: on the mean within a few percent, for both of the paper's settings."""
    scene = statue_scene(8_000, 0.0, 120, 90)
    hits = mp.rasterize(scene.camera, scene.mesh)
    truth = mp.traced_occlusion(hits, 0.6, rays=64)
    near = hits.mask & (truth < 0.99)
    for directions, steps in ((6, 6), (32, 20)):
        exposure = mp.screen_occlusion(hits, 0.6, directions=directions, steps=steps, blur=5)
        assert np.abs(exposure - truth)[near].mean() < 0.08
        assert np.corrcoef(exposure[near], truth[near])[0, 1] > 0.6
        assert (exposure[~hits.mask] == 1.0).all()
        again = mp.screen_occlusion(hits, 0.6, directions=directions, steps=steps, blur=5)
        np.testing.assert_array_equal(exposure, again)
        on_device = screen_occlusion_device(hits, mp.Occlusion(0.6, directions=directions, steps=steps, blur=5))
        np.testing.assert_array_equal(np.asarray(on_device.numpy()).reshape(90, 120), exposure)


def test_another_z_buffer_is_walked():
    """The camera's own changes nothing; a wider one knows what is beside the picture."""
    scene = statue_scene(8_000, 0.0, 96, 72)
    camera = scene.camera
    assert isinstance(camera, mp.Pinhole)
    hits = mp.rasterize(camera, scene.mesh)
    settings: dict = {"directions": 16, "steps": 12, "blur": 1}
    own = mp.screen_occlusion(hits, 0.6, **settings)
    same = mp.screen_occlusion(hits, 0.6, zbuffer=hits, **settings)
    assert np.abs(own - same).max() < 0.05 and np.abs(own - same).mean() < 1e-3
    narrow = mp.Pinhole(24, 18, camera.fx, camera.fy, 12 + 8, 9 - 5, camera.camera_from_world)
    close = mp.rasterize(narrow, scene.mesh)
    crop = (slice(36 + 5 - 9 + 0, 36 + 5 + 9), slice(48 - 8 - 12, 48 - 8 + 12))
    shifted = mp.Pinhole(100, 80, camera.fx, camera.fy, 50, 40, camera.camera_from_world)
    wide = mp.screen_occlusion(close, 0.6, zbuffer=mp.rasterize(shifted, scene.mesh), **settings)
    alone = mp.screen_occlusion(close, 0.6, **settings)
    off = [np.abs(found - own[crop]).mean() for found in (wide, alone)]
    # Other pixels have other numbers by chance, so the same lines are not walked.
    assert off[0] < 0.02 and off[0] < 0.6 * off[1]
    fisheye = mp.Radial.paraboloid(200, 200, camera_from_world=camera.camera_from_world)
    far = mp.screen_occlusion(hits, 0.6, zbuffer=mp.rasterize(fisheye, scene.mesh), **settings)
    near = hits.mask & (own < 0.99)
    assert np.corrcoef(far[near], own[near])[0, 1] > 0.8
    with pytest.raises(mp.InputError, match="another mesh"):
        mp.screen_occlusion(hits, 0.6, zbuffer=mp.rasterize(camera, ground()))
    with pytest.raises(mp.InputError, match="zbuffer is a Mesh"):
        mp.screen_occlusion(hits, 0.6, zbuffer=ground())  # pyright: ignore[reportArgumentType]


def test_a_graph_camera_walks_past_the_thing():
    """A plane through all three frusta covers nothing of itself; a statue stays as near to traced as by its own."""
    pose = mp.look_at((0.5, -6.0, 3.0), (0.0, 0.0, 0.5))
    camera = mp.Pinhole.from_fov(80, 60, 0.8, camera_from_world=pose)
    plane = ground(9.0)
    hits = mp.rasterize(camera, plane)
    bent = mp.rasterize(mp.GraphCamera.around((0.0, 0.0, 0.5), camera, shift=2.0), plane)
    exposure = mp.screen_occlusion(hits, 0.8, zbuffer=bent, directions=8, steps=8, bias=2e-3, blur=1)
    np.testing.assert_allclose(exposure, 1.0, atol=1e-4)
    scene = statue_scene(8_000, 0.0, 96, 72)
    seen = mp.rasterize(scene.camera, scene.mesh)
    truth = mp.traced_occlusion(seen, 0.6, rays=48)
    near = seen.mask & (truth < 0.99)
    graph = mp.GraphCamera.around((-0.3, 0.0, 0.95), scene.camera, shift=2.0)
    found = mp.screen_occlusion(seen, 0.6, zbuffer=mp.rasterize(graph, scene.mesh), directions=16, steps=12, blur=3)
    assert np.abs(found - truth)[near].mean() < 0.08
    assert np.corrcoef(found[near], truth[near])[0, 1] > 0.6


def test_the_blur_evens_out_noise_and_keeps_edges():
    """Two boards, one before the other: the noise falls on both, and nothing runs over the edge between them."""
    back = quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0))
    # a trench under the left half, so that the left is noisy and the right is white
    front = quad((0, -9, 1.5), (9, -9, 1.5), (9, 9, 1.5), (0, 9, 1.5))
    posts = [quad((-x, -9, 0), (-x, 9, 0), (-x, 9, 0.4), (-x, -9, 0.4)) for x in np.arange(0.4, 4, 0.4)]
    pose = mp.look_at((-0.3, 0.0, 9.0), (-0.3, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    hits = mp.rasterize(
        mp.Pinhole.from_fov(120, 90, 0.5, camera_from_world=pose), mp.Mesh.concatenate([back, front, *posts])
    )
    sharp, soft = (mp.screen_occlusion(hits, 0.5, directions=4, steps=5, blur=blur) for blur in (1, 21))
    high = np.abs(hits.points[..., 2] - 1.5) < 1e-3
    low = np.abs(hits.points[..., 2]) < 1e-3
    assert high.sum() > 1_000 and low.sum() > 1_000
    assert (soft[high] > 0.9995).all() and (sharp[high] > 0.9995).all()
    # What varies along a column of pixels, along the posts, is noise alone.
    rough, even = (np.nanstd(np.where(low, image, np.nan)[:, low.all(axis=0)], axis=0) for image in (sharp, soft))
    assert len(rough) > 10 and even.mean() < 0.35 * rough.mean()
    assert soft[low].mean() == pytest.approx(sharp[low].mean(), abs=0.02)


def test_exposure_dims_ambient_light_alone():
    scene = statue_scene(8_000, 0.0, 48, 36)
    hits = mp.rasterize(scene.camera, scene.mesh)
    exposure = mp.screen_occlusion(hits, 0.6)
    plain, dark = mp.shade(hits, scene), mp.shade(hits, scene, exposure=np.zeros_like(exposure))
    found = mp.shade(hits, scene, exposure=exposure)
    np.testing.assert_allclose(found, dark + exposure[..., None] * (plain - dark), atol=2e-6)
    np.testing.assert_array_equal(mp.render(scene.camera, scene, occlusion=0.6), found)
    assert found[hits.mask].mean() < plain[hits.mask].mean()
    for wrong in (exposure[1:], exposure.astype(int)):
        with pytest.raises(mp.InputError, match="exposure has shape"):
            mp.shade(hits, scene, exposure=wrong)
    with pytest.raises(mp.InputError, match="shading='light'"):
        mp.shade(hits, scene, "color", exposure=exposure)


def test_nothing_and_one_pixel():
    empty = mp.rasterize(mp.Pinhole(7, 5), mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)))
    assert (mp.screen_occlusion(empty, 1.0) == 1).all() and (mp.traced_occlusion(empty, 1.0) == 1).all()
    one = mp.rasterize(mp.Pinhole(1, 1, camera_from_world=NADIR), ground())
    np.testing.assert_allclose(mp.screen_occlusion(one, 1.0), 1.0)
    nan = mp.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0]], [[0, 1, 2], [0, 1, 3]])
    hits = mp.rasterize(mp.Pinhole(16, 12, camera_from_world=NADIR), nan)
    assert hits.mask.any() and np.isfinite(mp.screen_occlusion(hits, 1.0)).all()
    np.testing.assert_allclose(mp.traced_occlusion(hits, 1.0, rays=8), 1.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"radius": 0.0}, "radius=0.0"),
        ({"radius": math.nan}, "radius=nan"),
        ({"radius": math.inf}, "falloff='none'"),
        ({"falloff": "cubic"}, "quadratic, linear, none"),
        ({"directions": 0}, "directions"),
        ({"steps": 2000}, "steps"),
        ({"bias": 2.0}, "bias=2.0"),
        ({"blur": 4}, "odd"),
    ],
)
def test_wrong_settings(settings, words):
    hits = mp.rasterize(mp.Pinhole(8, 6, camera_from_world=NADIR), ground())
    with pytest.raises(mp.InputError, match=words) as caught:
        mp.screen_occlusion(hits, **{"radius": 1.0, **settings})
    assert "\n" not in str(caught.value)


def test_wrong_cameras():
    hits = mp.rasterize(mp.Orthographic(8, 6, 1.0, camera_from_world=NADIR), ground())
    with pytest.raises(mp.InputError, match="Orthographic"):
        mp.screen_occlusion(hits, 1.0)
    with pytest.raises(mp.InputError, match="Radial"):
        mp.render(mp.Radial.paraboloid(8, 8), ground(), occlusion=1.0)
    with pytest.raises(mp.InputError, match="Mesh"):
        mp.screen_occlusion(ground(), 1.0)  # pyright: ignore[reportArgumentType]
    with pytest.raises(mp.InputError, match="hits"):
        mp.traced_occlusion(ground(), 1.0)  # pyright: ignore[reportArgumentType]
