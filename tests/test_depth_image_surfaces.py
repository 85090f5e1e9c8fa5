"""Surfaces of depth images, their gaps and colors; scenes that move, several images, and the limits."""

import drjit.llvm as device
import numpy as np
import pytest
from catalog import soup
from depth_image_kit import EYE, HEIGHT, MESH, MIDDLE, POSE, SIZE, WIDTH, apart, at, cameras, embree, rays, unit

import mpcam as mp

# Surfaces and gaps


def two_walls() -> mp.DepthImage:
    """Orthographic, looking along +z at a square at depth 1 before a wall at depth 3."""
    depth = np.full((64, 64), 3.0)
    depth[20:44, 20:44] = 1.0
    return mp.DepthImage(mp.Orthographic(64, 64, 32.0), depth)


def test_nothing_is_spanned_between_surfaces():
    """Rays between the square and the wall, sideways and aslant, pass; those that go down meet the wall."""
    image, rng = two_walls(), np.random.default_rng(0)
    start = np.stack([rng.uniform(-1.2, -0.95, 500), rng.uniform(-0.3, 0.3, 500), rng.uniform(1.3, 1.7, 500)], -1)
    way = unit(np.stack([np.ones(500), rng.uniform(-0.1, 0.1, 500), rng.uniform(-0.1, 0.5, 500)], -1))
    for coarse in (None, 6.0):
        assert not image.intersect(start, way, coarse=coarse).hit.any()
    down = unit(way + (0, 0, 3.0))
    found = image.intersect(start, down)
    exact = (3.0 - start[:, 2]) / down[:, 2]
    assert found.hit.all() and found.front.all()
    assert np.abs(found.distance - exact).max() < 1e-5


def test_both_sides_are_met_and_told_apart():
    image, rng = two_walls(), np.random.default_rng(1)
    point = np.stack([rng.uniform(-0.3, 0.3, 500), rng.uniform(-0.3, 0.3, 500), np.full(500, 1.0)], -1)
    way = unit(np.stack([rng.normal(size=500), rng.normal(size=500), rng.uniform(0.3, 2, 500)], -1))
    for sign in (1.0, -1.0):
        found = image.intersect(point - 0.4 * sign * way, sign * way)
        assert found.hit.all() and (found.front == (sign > 0)).all()
        assert np.abs(found.distance - 0.4).max() < 1e-5


def test_slanted_planes_are_exact():
    """A plane of an image of a pinhole, by depths alone: hits where the plane is."""
    camera = mp.Pinhole(64, 48, 40.0, 41.0, 30.0, 25.0, POSE)
    ray = camera.ray(np.stack(np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5), -1))
    normal, point = unit(np.array([0.3, -0.8, 0.4])), MIDDLE
    depth = ((point - ray.origin) @ normal) / (ray.direction @ normal)
    image = mp.DepthImage(camera, np.where(depth > 0, depth, np.nan))
    origins, directions = rays(2000, 4)
    exact = ((point - origins) @ normal) / (directions @ normal)
    target = at(origins, directions, exact)
    seen = camera.project(target)
    inside = seen.valid[:, 0] & (exact > 0) & (np.abs(seen.pixel[:, 0] - (32, 24)) < (30, 22)).all(-1)
    found = image.intersect(origins, directions)
    assert inside.sum() > 200 and found.hit[inside].mean() > 0.995
    good = inside & found.hit
    off = np.abs((at(origins, directions, found.distance) - point) @ normal)[good]
    assert off.max() < 5e-4 * SIZE and np.median(off) < 3e-4 * SIZE


def test_rays_do_not_hit_where_they_start():
    """From true points of the surface away from it: the first hit is another one, or none."""
    camera, (origins, directions) = cameras()["pinhole"], rays(20_000)
    distance, triangle = embree(MESH, origins, directions)
    points, image = at(origins, directions, distance), mp.DepthImage.render(camera, MESH, color=False)
    normal = MESH.face_normals[triangle]
    normal = normal * np.where((normal * directions).sum(-1, keepdims=True) < 0, 1, -1)
    away = unit(normal + 0.8 * unit(np.random.default_rng(2).normal(size=normal.shape)))
    use = (triangle >= 0) & (((EYE - points) * normal).sum(-1) > 0.2 * np.linalg.norm(EYE - points, axis=-1))
    found = image.intersect(points[use], away[use])
    truth, _ = embree(MESH, points[use] + 1e-4 * SIZE * normal[use], away[use])
    early = found.hit & (found.distance < truth - 0.02 * SIZE)
    assert early.mean() < 0.01


def test_rays_along_the_cameras_own_find_its_depths():
    """Their images are points: they are met in steps of any length."""
    for camera in cameras().values():
        if hasattr(camera, "pieces_per_ray"):
            continue  # whose own rays are bent
        image = mp.DepthImage.render(camera, MESH, color=False)
        ray = camera.ray(np.stack(np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5), -1)[::3, ::3])
        found, depth = image.intersect(ray.origin, ray.direction), image.depth[::3, ::3]
        seen = np.isfinite(depth)
        assert found.hit.shape == depth.shape and (found.hit == seen)[ray.valid].mean() > 0.998
        both = seen & found.hit
        assert np.abs(found.distance[both] - depth[both]).max() < 1e-4 * SIZE
        assert found.steps.mean() < 20


# Colors


def test_colors_are_those_of_the_pixels():
    camera = cameras()["pinhole"]
    image = mp.DepthImage.render(camera, MESH, normals=True, shading="color")
    ray = camera.ray(np.stack(np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5), -1))
    found, hits = image.intersect(ray.origin, ray.direction), mp.rasterize(camera, MESH)
    color, normal = mp.shade(hits, MESH, "color"), 2 * mp.shade(hits, MESH, "normal") - 1
    both = found.hit & hits.mask
    assert np.abs(found.color - color)[both].max() < 1e-3
    assert np.abs(found.normal - normal)[both].max() < 2e-3
    assert (found.color[~found.hit] == 0).all() and (found.normal[~found.hit] == 0).all()
    assert np.abs(image.color - color)[hits.mask].max() < 1e-6


def test_colors_of_other_surfaces_are_not_mixed_in():
    walls = two_walls()
    red = np.where(np.isclose(walls.depth, 1.0)[..., None], (1.0, 0, 0), (0, 0, 1.0))
    image = mp.DepthImage(walls.camera, walls.depth, color=red)
    x = np.linspace(-0.9, 0.9, 301)
    found = image.intersect(np.stack([x, 0 * x + 0.01, 0 * x], -1), (0, 0, 1.0))
    assert found.hit.all()
    assert np.array_equal(found.color[:, 0] > 0.5, found.distance < 2)
    assert np.minimum(found.color, 1 - found.color).max() < 1e-6
    blend = np.repeat(np.linspace(0, 1, 64)[None, :, None], 64, 0).repeat(3, -1)
    smooth = mp.DepthImage(walls.camera, np.ones((64, 64)), color=blend)
    found = smooth.intersect(np.stack([x, 0 * x, 0 * x], -1), (0, 0, 1.0))
    exact = np.clip((32 * x + 31.5) / 63, 0, 1)
    assert np.abs(found.color[:, 1] - exact).max() < 1e-3


def test_facing_is_the_cosine_to_the_surface():
    camera = cameras()["pinhole"]
    image, hits = mp.DepthImage.render(camera, MESH, color=False), mp.rasterize(camera, MESH)
    ray = camera.ray(np.stack(np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5), -1))
    found = image.intersect(ray.origin, ray.direction)
    cosine = np.abs((MESH.face_normals[hits.triangle] * ray.direction).sum(-1))
    both = found.hit & hits.mask
    assert np.median(np.abs(found.facing - cosine)[both]) < 0.05
    assert (np.abs(found.facing - cosine)[both] < 0.2).mean() > 0.9
    assert (found.facing[~found.hit] == 0).all()
    fade, angle = found.fade(0.5, 1.2), np.arccos(np.clip(cosine, 0, 1))
    assert (fade[both & (angle < 0.4)] == 1).mean() > 0.95 and (fade[~found.hit] == 0).all()
    assert np.median(np.abs(fade - np.clip((1.2 - angle) / 0.7, 0, 1))[both]) < 0.05


def test_layers_are_the_surfaces_behind_each_other():
    """Two balls, one behind the other: four layers, at the depths of the closed form; more of true hits are held."""
    ball, other = mp.builtin_mesh("sphere", triangles=20480), np.eye(4)
    other[1, 3] = 3.0
    mesh = mp.Mesh.concatenate([ball, ball.transformed(other)])
    camera = mp.Pinhole.from_fov(80, 80, 0.6, mp.look_at((0, -5, 0), (0, 0, 0)))
    image = mp.LayeredDepthImage.render(camera, mesh, layers=4, shading="color")
    direction = camera.ray(np.stack(np.meshgrid(np.arange(80) + 0.5, np.arange(80) + 0.5), -1)).direction
    exact = []
    for center in ((0, 5, 0), (0, 8, 0)):
        axis = np.linalg.inv(np.asarray(camera.camera_from_world))[:3, 3] * 0 + np.array(center)
        along = direction @ axis
        half = 1 - (axis @ axis - along**2)
        root = np.sqrt(np.where(half > 0, half, np.nan))
        exact += [along - root, along + root]
    inner = np.isfinite(exact).all(0) & (exact[1] > exact[0] + 1)
    for layer, depth in zip(image.layers, exact, strict=True):
        assert np.abs(layer.depth[inner] - depth[inner]).max() < 0.01
    origins, directions = rays(5000, 3)
    origins, directions = (origins - MIDDLE) / SIZE * 2 + (0, 1.5, 0), directions
    distance, _ = embree(mesh, origins, directions)
    close = []
    for one in (image, image.layers[0]):
        found = one.intersect(origins, directions)
        both = found.hit & np.isfinite(distance)
        close.append(np.abs(found.distance[both] - distance[both]) < 0.05)
    assert close[0].sum() > 2.5 * close[1].sum() > 200


# Scenes that move, several images, devices


def test_update_is_a_fresh_image_to_the_bit():
    camera, (origins, directions) = cameras()["paraboloid"], rays(3000)
    image = mp.DepthImage.render(camera, MESH)
    turn = np.eye(4)
    turn[:3, :3] = [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]
    image.intersect(origins, directions)
    for change in ({"transform": turn}, {"vertices": MESH.vertices + 0.02 * SIZE * np.sin(MESH.vertices)}):
        image.update(**change)
        moved = MESH.transformed(turn) if "transform" in change else mp.Mesh(change["vertices"], MESH.faces)
        fresh = mp.DepthImage.render(camera, moved, color=False)
        found, exact = image.intersect(origins, directions), fresh.intersect(origins, directions)
        assert found.hit.any() and np.array_equal(image.depth, fresh.depth)
        for name in ("hit", "distance", "pixel", "steps"):
            assert np.array_equal(getattr(found, name), getattr(exact, name))
    other = camera.with_pose(mp.look_at(EYE + 0.1 * SIZE, MIDDLE))
    image.aim(other)
    assert np.array_equal(image.depth, mp.DepthImage.render(other, moved, color=False).depth)


def test_of_several_images_the_nearest_hit_wins():
    (origins, directions), pose = rays(20_000), mp.look_at(2 * MIDDLE - EYE, MIDDLE)
    first = mp.DepthImage.render(cameras()["pinhole"], MESH, shading="color")
    second = mp.DepthImage.render(mp.Radial.equisolid(WIDTH, HEIGHT, pose), MESH, shading="color")
    found = mp.intersect([first, second], origins, directions)
    each = [image.intersect(origins, directions) for image in (first, second)]
    best = np.minimum(*(one.distance for one in each))
    assert np.array_equal(found.hit, np.isfinite(best)) and {-1, 0, 1} == set(np.unique(found.image))
    assert (np.abs(found.distance[found.hit] - best[found.hit]) < 1e-4 * SIZE).mean() > 0.999
    clear = (each[0].hit != each[1].hit) | (apart(*each) > 1e-3 * SIZE)
    nearer = np.where(each[0].distance <= each[1].distance, 0, 1)
    assert (found.image == nearer)[clear & found.hit].mean() > 0.999
    for number, one in enumerate(each):
        mine = clear & (found.image == number)
        assert (np.abs(found.color - one.color)[mine].max(-1) < 1e-3).mean() > 0.999
    same = mp.intersect([first, first], origins, directions)
    assert (same.image[same.hit] == 0).mean() > 0.997 and np.array_equal(same.hit, each[0].hit)


def test_far_ends_rays():
    image, (origins, directions) = mp.DepthImage.render(cameras()["pinhole"], MESH, color=False), rays(3000)
    found = image.intersect(origins, directions)
    half = np.where(np.arange(3000) % 2, 0.999, 1.001) * np.where(found.hit, found.distance, 1.0)
    short = image.intersect(origins, directions, far=half)
    assert np.array_equal(short.hit[0::2], found.hit[0::2])
    assert not short.hit[1::2].any()
    assert not image.intersect(origins, directions, far=0.0).hit.any()


def test_device_arrays_give_what_host_arrays_give():
    image, (origins, directions) = mp.DepthImage.render(cameras()["pinhole"], MESH), rays(3000)
    found = image.intersect(origins.reshape(30, 100, 3), directions.reshape(30, 100, 3))
    device_rays = (device.Array3f(np.ascontiguousarray(x.T, np.float32)) for x in (origins, directions))
    again = image.intersect(*device_rays)
    assert found.hit.shape == (30, 100) and found.color.shape == (30, 100, 3) and found.pixel.shape == (30, 100, 2)
    assert (found.hit.ravel() == again.hit).mean() > 0.999
    both = found.hit.ravel() & again.hit
    assert np.abs(found.distance.ravel()[both] - again.distance[both]).max() < 1e-3 * SIZE
    assert isinstance(again.device_distance, device.Float)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_any_unit_serves(scale):
    """Scenes and rays in other units: the same pixels."""
    camera, (origins, directions) = cameras()["pinhole"], rays(3000)
    found = mp.DepthImage.render(camera, MESH, color=False).intersect(origins, directions)
    pose = POSE.copy()
    pose[:3, 3] *= scale
    mesh = mp.Mesh(MESH.vertices * scale, MESH.faces)
    again = mp.DepthImage.render(camera.with_pose(pose), mesh, color=False).intersect(scale * origins, directions)
    assert (found.hit == again.hit).mean() > 0.999
    both = found.hit & again.hit
    assert (np.abs(found.pixel - again.pixel)[both].max(-1) < 0.05).mean() > 0.999


# Limits


def test_images_of_one_pixel():
    image = mp.DepthImage(mp.Orthographic(1, 1, 1.0), [[2.0]])
    found = image.intersect([[0, 0, 0], [0.4, -0.4, 0], [0.6, 0, 0], [0, 0, 3]], [[0, 0, 1.0]] * 4)
    assert found.hit.tolist() == [True, True, False, False]
    assert np.allclose(found.distance[:2], 2.0)


def test_empty_images_and_rays_that_mean_nothing():
    camera = mp.Pinhole(40, 30)
    empty = mp.DepthImage(camera, np.full((30, 40), np.inf))
    assert not empty.intersect(*rays(100)).hit.any()
    nothing = mp.DepthImage.render(camera, mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), color=False)
    assert not nothing.intersect(*rays(100)).hit.any()
    wall = mp.DepthImage(camera, np.full((30, 40), 2.0))
    bad = wall.intersect(
        [[np.nan, 0, 0], [0, 0, 0], [0, 0, np.inf], [0, 0, 0], [0, 0, -1]],
        [[0, 0, 1.0], [0, 0, 0], [0, 0, 1], [np.inf, 0, 1], [0, 0, 1]],
    )
    assert bad.hit.tolist() == [False, False, False, False, True]
    assert bad.steps[:4].tolist() == [0, 0, 0, 0] and np.isinf(bad.distance[:4]).all()
    away = wall.intersect([[0, 0, -1], [50, 0, 0]], [[0, 0, -1], [0, 1, 0]])
    assert not away.hit.any() and (away.steps == 0).all()
    none = wall.intersect(np.zeros((0, 3)), np.zeros((0, 3)))
    assert none.hit.shape == (0,) and none.pixel.shape == (0, 2)


def test_depths_that_mean_nothing_are_empty():
    image = mp.DepthImage(mp.Orthographic(2, 2, 1.0), [[np.nan, -1.0], [np.inf, 2.0]])
    assert np.isinf(image.depth).tolist() == [[True, True], [True, False]]


WALL = np.ones((30, 40))
MISTAKES = {
    "shape": (lambda c: mp.DepthImage(c, np.ones((40, 30))), r"depth has shape \(40, 30\): \(30, 40\) is needed"),
    "text": (lambda c: mp.DepthImage(c, "near"), "depth: numbers of shape"),
    "color": (lambda c: mp.DepthImage(c, WALL, color=WALL), "color has shape"),
    "no color": (
        lambda c: mp.DepthImage(c, WALL).intersect((0, 0, 0), (0, 0, 1)).color,
        "has no color: give it color=",
    ),
    "no camera": (lambda c: mp.DepthImage("cam", WALL), "camera is a str"),
    "update": (lambda c: mp.DepthImage(c, WALL).update(), "made from arrays"),
    "coarse": (
        lambda c: mp.DepthImage(c, WALL).intersect((0, 0, 0), (0, 0, 1), coarse=0.5),
        "coarse=0.5: pixels from 1",
    ),
    "fine": (lambda c: mp.DepthImage(c, WALL).intersect((0, 0, 0), (0, 0, 1), fine=0), "fine=0: pixels from"),
    "walk": (lambda c: mp.DepthImage(c, WALL).intersect((0, 0, 0), (0, 0, 1), walk="run"), "walk='run'"),
    "rays": (lambda c: mp.DepthImage(c, WALL).intersect((0, 0), (0, 0, 1)), "origins has shape"),
    "counts": (lambda c: mp.DepthImage(c, WALL).intersect(np.zeros((2, 3)), np.ones((3, 3))), "a direction for each"),
    "far": (lambda c: mp.DepthImage(c, WALL).intersect((0, 0, 0), (0, 0, 1), far="far"), "far='far'"),
    "images": (lambda c: mp.intersect([], (0, 0, 0), (0, 0, 1)), "at least one"),
    "method": (lambda c: mp.DepthImage.render(c, MESH, method="magic"), "method='magic'"),
}


@pytest.mark.parametrize("name", list(MISTAKES))
def test_mistakes_are_named(name):
    call, words = MISTAKES[name]
    with pytest.raises(mp.InputError, match=words):
        call(mp.Pinhole(40, 30))


def test_cameras_with_many_images_are_refused_by_name():
    ball = mp.builtin_mesh("sphere", triangles=80)
    with pytest.raises(mp.InputError, match="CameraTriangles"):
        mp.DepthImage.render(mp.CameraTriangles(ball.vertices, ball.faces, directions=ball.vertices), soup(3))
