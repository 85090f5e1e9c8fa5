"""The truth of analytic mirrors: points and directions against closed forms that share nothing with it."""

import mpmath
import numpy as np
import pytest

import mpcam as mp
from mpcam.decomposition.chaining import chained
from mpcam.decomposition.ray_error import in_world
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.resolve import Resolver
from mpcam.decomposition.shooting import Locator
from mpcam.effects.caustic_photons import photons
from mpcam.effects.mirror_rays import mirror_rays
from mpcam.geometry.surfaces import Surface

TURN = np.array([[0.36, 0.48, -0.8, 3.0], [-0.8, 0.6, 0.0, -1.0], [0.48, 0.64, 0.6, 2.0], [0, 0, 0, 1]])
RNG = np.random.default_rng(3)


def looking(target, eye, size=64, focal=70.0):
    pose = mp.look_at(eye, target, (0.1, 0.3, 0.9))
    height = size * 7 // 8
    return mp.Pinhole(size, height, fx=focal, fy=focal, cx=size / 2 + 0.3, cy=height / 2 - 0.2, camera_from_world=pose)


def pixel_directions(camera):
    """By the pinhole's own numbers, not by the camera's code."""
    v, u = np.divmod(np.arange(camera.width * camera.height), camera.width)
    ways = np.stack([(u + 0.5 - camera.cx) / camera.fx, (v + 0.5 - camera.cy) / camera.fy, np.ones(len(u))], -1)
    ways = ways @ np.asarray(camera.camera_from_world)[:3, :3]
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def mirrored(ways, normals):
    return ways - 2 * (ways * normals).sum(1, keepdims=True) * normals


def snell(ways, normals, index):
    """By angles: the sine behind is the sine before over the index."""
    facing = np.where((ways * normals).sum(1, keepdims=True) < 0, normals, -normals)
    across = ways - (ways * facing).sum(1, keepdims=True) * facing
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    behind = np.minimum(sine / index, 1.0)
    return across / np.maximum(sine, 1e-300) * behind - np.sqrt(1 - behind**2) * facing


def sphere_hits(origin, ways, center, radius):
    """By the foot of the perpendicular from the center."""
    along = ((center - origin) * ways).sum(1)
    foot = origin + along[:, None] * ways
    half = radius**2 - ((foot - center) ** 2).sum(1)
    hit = half > 0
    points = origin + (along - np.sqrt(np.where(hit, half, 0)))[:, None] * ways
    return hit, points, (points - center) / radius


@pytest.mark.parametrize("far", [2.5, 40.0, 4000.0])
@pytest.mark.parametrize("index", [None, 1.5])
def test_sphere(index, far):
    center, radius = np.array([1.0, 2.0, 3.0]), 2.0
    eye = center + far * radius * np.array([0.6, -0.64, 0.48])
    camera = looking(center, eye, focal=28.0 * far)
    truth = mirror_rays(camera, mp.Mirror(Surface.sphere(radius, center), index=index))
    ways = pixel_directions(camera)
    hit, points, normals = sphere_hits(eye, ways, center, radius)
    assert 0.3 < hit.mean() < 0.95
    assert np.array_equal(np.isfinite(truth.distance), hit) and np.array_equal(truth.ray.valid, hit)
    after = mirrored(ways, normals) if index is None else snell(ways, normals, index)
    assert np.abs(truth.ray.origin - points)[hit].max() < 1e-6 * radius
    assert np.abs(truth.ray.direction - after)[hit].max() < 1e-6
    assert np.abs(truth.distance - np.linalg.norm(points - eye, axis=1))[hit].max() < 1e-6 * radius


def test_plane():
    """A paraboloid of no height is a disc."""
    camera = looking((0.2, 0.1, 0.0), (0.5, -2.0, 1.5))
    truth = mirror_rays(camera, mp.Mirror(Surface.paraboloid(1.0, 0.0)))
    eye, ways = np.array([0.5, -2.0, 1.5]), pixel_directions(camera)
    points = eye - (eye[2] / ways[:, 2])[:, None] * ways
    hit = (ways[:, 2] < 0) & (points[:, 0] ** 2 + points[:, 1] ** 2 <= 1)
    assert 0.05 < hit.mean() < 0.95 and np.array_equal(np.isfinite(truth.distance), hit)
    assert np.abs(truth.ray.origin - points)[hit].max() < 1e-12
    assert np.abs(truth.ray.direction - ways * [1, 1, -1])[hit].max() < 1e-12


def test_paraboloid():
    """Points with 50 digits; and rays along the axis meet in the focus, which needs no normals."""
    bowl = Surface.paraboloid(1.0, 0.5)
    camera = looking((0.0, 0.0, 0.2), (0.4, -1.6, 1.9), size=24, focal=26.0)
    truth, ways = mirror_rays(camera, mp.Mirror(bowl)), pixel_directions(camera)
    seen = 0
    with mpmath.workdps(50):
        for way, point, after, distance in zip(
            ways, truth.ray.origin, truth.ray.direction, truth.distance, strict=True
        ):
            (x, y, z), (a, b, c) = map(mpmath.mpf, (0.4, -1.6, 1.9)), map(mpmath.mpf, map(float, way))
            roots = mpmath.polyroots(
                [(x * x + y * y) / 2 - z, a * x + b * y - c, (a * a + b * b) / 2], extraprec=200, asc=True
            )
            real = [t for t in roots if not t.imag and t > 0 and (x + t * a) ** 2 + (y + t * b) ** 2 <= 1]
            assert bool(real) == bool(np.isfinite(distance))
            if real:
                t, seen = min(real), seen + 1
                exact = np.array([float(x + t * a), float(y + t * b), float(z + t * c)])
                normal = np.array([[-exact[0], -exact[1], 1.0]])
                normal = normal / np.linalg.norm(normal)
                assert np.abs(point - exact).max() < 1e-12 and abs(distance - float(t)) < 1e-12
                assert np.abs(after - mirrored(way[None], normal)[0]).max() < 1e-12
    assert seen > 100
    above = np.concatenate([RNG.uniform(-0.6, 0.6, (500, 2)), np.full((500, 1), 3.0)], axis=1)
    down = np.tile([0.0, 0.0, -1.0], (500, 1))
    found = reflector_of(bowl).first_hits(above, down)
    after = mirrored(down, found.normals)
    to_focus = np.array([0.0, 0.0, 0.5]) - found.points
    assert found.hit.all() and np.linalg.norm(np.cross(after, to_focus), axis=1).max() < 1e-12


def outside(name, x):
    """A function that changes its sign across each surface, written anew."""
    a, b, c = np.moveaxis(x, -1, 0)
    return {
        "ellipsoid": lambda: (a / 1.0) ** 2 + (b / 2.0) ** 2 + (c / 0.5) ** 2 - 1,
        "torus": lambda: (np.hypot(a, b) - 1.0) ** 2 + c**2 - 0.4**2,
        "patch": lambda: a**2 + b**2 - 1,
        "saddle": lambda: c - 0.5 * (a**2 - b**2),
        "wave": lambda: c - 0.1 * np.sin(1.5 * np.pi * a) * np.sin(1.5 * np.pi * b),
    }[name]()


def inside(name, x):
    a, b, c = np.moveaxis(x, -1, 0)
    if name == "patch":
        return (np.abs(c) <= 1) & (np.abs(np.arctan2(b, a)) <= 1)
    return np.maximum(np.abs(a), np.abs(b)) <= 1 if name in ("saddle", "wave") else np.ones(a.shape, bool)


SURFACES = {
    "ellipsoid": Surface.ellipsoid((1, 2, 0.5)),
    "torus": Surface.torus(1.0, 0.4),
    "patch": Surface.cylinder(1.0, 2.0, 2.0),
    "saddle": Surface.saddle(2.0, 0.5),
    "wave": Surface.wave(2.0, 0.1, 1.5),
}


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", SURFACES)
def test_first_hits_by_steps_along_the_rays(name, turned):
    pose = TURN if turned else np.eye(4)
    surface = SURFACES[name].transformed(pose)
    count, steps = 400, 4000
    origin = RNG.normal(size=(count, 3))
    origin *= 3.0 / np.linalg.norm(origin, axis=1, keepdims=True)
    way = RNG.uniform(-0.9, 0.9, (count, 3)) - origin
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    t = np.linspace(0, 6, steps)
    x = origin[:, None] + t[:, None] * way[:, None]
    value = outside(name, x)
    low, high = np.full(count, np.nan), np.full(count, np.nan)
    crossing = (value[:, :-1] * value[:, 1:] <= 0) & inside(name, x[:, :-1])
    met = crossing.any(1)
    first = crossing.argmax(1)
    low, high = t[first], t[first + 1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = outside(name, origin + middle[:, None] * way) * value[np.arange(count), first] > 0
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    world = [v @ pose[:3, :3].T for v in (origin, way)]
    found = reflector_of(surface).first_hits(world[0] + pose[:3, 3], 2.5 * world[1])
    # Only what grazes the surface or its border may be told otherwise by steps.
    assert (found.hit != met).sum() <= 2 and met.sum() > 60
    both = found.hit & met
    gap = np.abs(found.distance - high)[both]
    assert np.sort(gap)[-3] < 1e-9 and (gap > 1e-9).sum() <= 2
    at = origin + high[:, None] * way
    gradient = np.stack([outside(name, at + 1e-6 * e) - outside(name, at - 1e-6 * e) for e in np.eye(3)], -1)
    normal = gradient / np.linalg.norm(gradient, axis=1, keepdims=True) @ pose[:3, :3].T
    assert (
        np.abs(np.abs((normal * found.normals).sum(1)) - 1)[both & (np.abs(found.distance - high) < 1e-9)].max() < 1e-8
    )


def test_a_second_bend():
    """From a sphere to a disc below it."""
    ball, floor = Surface.sphere(1.0, (0, 0, 1.5)), Surface.paraboloid(6.0, 0.0)
    eye = np.array([0.3, -4.0, 2.5])
    cams = mp.decompose(ball, eye, 200, resolution=4)
    found = chained(cams, floor, reflector=ball, most=1, tolerance=10.0).camera
    points, after = np.asarray(found.vertices), np.asarray(found.directions)
    before = after / np.linalg.norm(after, axis=1, keepdims=True) * [1, 1, -1]
    assert len(points) > 50 and np.abs(points[:, 2]).max() < 1e-12
    # Back to the sphere, where the angles to the eye and to the floor must be the same. Triangles at the outline have
    # corners that the eye does not see: to those the line leads through the sphere.
    center, misses = np.array([0, 0, 1.5]), []
    for start, way in ((points, -before), (points - 50 * before, before)):
        hit, on_ball, normals = sphere_hits(start, way, center, 1.0)
        from_eye = (on_ball - eye) / np.linalg.norm(on_ball - eye, axis=1, keepdims=True)
        misses.append(np.where(hit, np.abs(mirrored(from_eye, normals) - before).max(1), np.inf))
    assert np.minimum(*misses).max() < 1e-6 and (misses[0] < 1e-6).mean() > 0.5


@pytest.mark.parametrize("index", [None, 1 / 1.33])
def test_light_and_pictures_start_on_the_surface(index):
    """Photons leave, and pictures are made, where the rays of a light or a camera meet the sphere."""
    center, eye = np.array([0.5, 0.0, 0.2]), np.array([0.5, -3.0, 0.8])
    ball = Surface.sphere(1.0, center)
    sent = photons(eye, reflector_of(ball), mp.decompose(ball, eye, 104, resolution=8, index=index), 64)
    hit, points, _ = sphere_hits(eye, sent.camera.ray(pixel_centers(sent.camera)).direction, center, 1.0)
    reach = np.where(hit, np.linalg.norm(points - eye, axis=1), 0.0).reshape(sent.reach.shape)
    assert np.abs(sent.reach - reach)[sent.reach > 0].max() < 1e-9 and (sent.reach > 0).sum() > 1000
    camera = looking(center, eye)
    cams = mp.decompose(ball, camera, 104, resolution=8, index=index)
    picture, ways = Resolver(cams, ball, camera), pixel_directions(camera)
    hit, points, normals = sphere_hits(eye, ways, center, 1.0)
    assert np.array_equal(picture.mask.ravel(), hit)
    assert np.abs(picture.points[picture.mask] - points[hit]).max() < 1e-9
    after = mirrored(ways, normals) if index is None else snell(ways, normals, index)
    got = picture.direction[picture.mask]
    passed = np.linalg.norm(got, axis=1) > 0
    assert np.abs(got - after[hit])[passed].max() < 1e-6 and passed.mean() > (0.99 if index is None else 0.5)


def pixel_centers(camera):
    v, u = np.divmod(np.arange(camera.width * camera.height), camera.width)
    return np.stack([u + 0.5, v + 0.5], -1)


MIRRORS = {
    "sphere": (Surface.sphere(1.0), (0, -3.2, 1.0)),
    "wave": (Surface.wave(height=0.05, waves=1.0), (0.2, -1.5, 3.0)),
}


def check_falls(name, counts):
    surface, eye = MIRRORS[name]
    camera = looking((0, 0, 0), eye, size=256, focal=266.0)
    truth, errors = mirror_rays(camera, mp.Mirror(surface)), []
    whole = truth.ray.valid
    for triangles in counts:
        cams = in_world(mp.decompose(surface, camera, triangles, resolution=4))
        assert cams.normals is not None
        normals = surface.normal_at(truth.ray.origin[whole])
        place = Locator(cams.vertices, cams.normals, cams.faces).locate(truth.ray.origin[whole], normals)
        along = np.stack(cams.ray_at(place.face, place.second, place.third)[1], axis=1)
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        errors.append(np.sqrt((np.linalg.norm(along - truth.ray.direction[whole], axis=1) ** 2).mean()))
    falls = np.array(errors[:-1]) / errors[1:]
    assert (falls > 3.2).all() and (falls < 4.8).all(), falls


@pytest.mark.parametrize("name", MIRRORS)
def test_error_falls_with_the_area_of_camera_triangles(name):
    """Rays interpolated between vertices are off by the square of the edges: a fourth at four times as many."""
    check_falls(name, (104, 416))


@pytest.mark.slow
@pytest.mark.parametrize("name", MIRRORS)
def test_error_falls_down_to_thousands_of_camera_triangles(name):
    check_falls(name, (104, 416, 1664, 6656))
