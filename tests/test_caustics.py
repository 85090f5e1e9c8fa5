"""Caustics: a flat mirror against the light behind it, curved ones against paths traced over the true surface."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_erosion, gaussian_filter

import mpcam as mp
from mpcam.decomposition.ray_error import bent
from mpcam.decomposition.reflector import pixel_hits, reflector_of
from mpcam.effects import caustic_photons
from mpcam.effects.caustic_settings import Settings
from mpcam.effects.caustics import Caustics, caustics
from mpcam.geometry.surfaces import Surface
from mpcam.math import PI
from mpcam.tracing.meshes import mitsuba_mesh
from mpcam.tracing.variant import mitsuba

LIGHT = mp.PointLight((0.2, -1.0, 2.5), (3.0, 2.0, 1.0))
VIRTUAL = (0.2, 5.0, 2.5)
EYE = mp.Pinhole(160, 120, 150, camera_from_world=mp.look_at((0, -5, 5), (0, 0.5, 0)))


def rectangle(low, high, z: float = 0.0) -> mp.Mesh:
    (a, b), (c, d) = low, high
    return mp.Mesh([(a, b, z), (c, b, z), (c, d, z), (a, d, z)], [(0, 1, 2), (0, 2, 3)])


def box(low, high) -> mp.Mesh:
    low, high = np.array(low), np.array(high)
    return mp.builtin_mesh("cube").transformed(
        np.block([[np.diag(high - low), 0.5 * (low + high)[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])
    )


FLOOR = rectangle((-4, -4), (4, 4))
WALL = mp.Mesh([(-1, 2, 0.5), (1, 2, 0.5), (1, 2, 1.5), (-1, 2, 1.5)], [(0, 1, 2), (0, 2, 3)])


def flat(scene=FLOOR, camera=EYE, **settings) -> Caustics:
    return caustics(scene, WALL, LIGHT, camera, **{"photons": 128, "resolution": 32, **settings})


def behind_the_wall(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance that the light's mirror image gives on z = 0, and whether its rays come through the wall."""
    way = np.array(VIRTUAL) - points
    through = points + ((2 - points[..., 1]) / way[..., 1])[..., None] * way
    inside = (abs(through[..., 0]) < 1) & (through[..., 2] > 0.5) & (through[..., 2] < 1.5) & (points[..., 1] < 2)
    return way[..., 2] / np.linalg.norm(way, axis=-1) ** 3, inside


def shrunk(mask: np.ndarray, steps: int = 4) -> np.ndarray:
    return np.asarray(binary_erosion(mask, iterations=steps))


# Parts


def test_solid_angles():
    x, y, z = np.eye(3)
    assert np.isclose(caustic_photons.solid_angle(x, y, z), PI / 2)
    camera = mp.Pinhole(40, 30, 20)
    whole = 4 * np.arcsin(1 / np.sqrt((1 + 1 / 1.0**2) * (1 + 1 / 0.75**2)))  # a rectangle seen from above its middle
    assert np.isclose(caustic_photons.pixel_solid_angles(camera).sum(), whole, rtol=1e-12)
    around = mp.Radial.equisolid(200, 200, fov=PI)
    assert np.isclose(caustic_photons.pixel_solid_angles(around).sum(), 2 * PI, rtol=0.02)


def test_fresnel():
    assert np.isclose(caustic_photons.transmitted(np.array(1.0), 1.5), 4 * 1.5 / 2.5**2)
    assert caustic_photons.transmitted(np.array(0.0), 1.5) == 0
    assert caustic_photons.transmitted(np.array(0.5), 1 / 1.5) == 0  # total reflection
    angle = np.radians(30)
    beyond = np.arcsin(np.sin(angle) / 1.5)
    there, back = (caustic_photons.transmitted(np.cos(a), n) for a, n in ((angle, 1.5), (beyond, 1 / 1.5)))
    assert np.isclose(there, back)


@pytest.mark.parametrize("eye", [(0.0, -3.0, 4.0), (0.0, 0.1, 1.2)], ids=["narrow", "wide"])
def test_light_camera_holds_the_reflector(eye):
    surface = caustic_photons.Reflector(Surface.sphere(1.0))
    camera = caustic_photons.light_camera(np.array(eye), surface, 64)
    image = camera.project(surface.vertices)
    assert image.valid.all() and image.pixel.min() >= 0.99 and image.pixel.max() <= 63.01
    seen = mp.rasterize(camera, surface.mesh).mask
    covered = (caustic_photons.pixel_solid_angles(camera) * seen).sum()
    assert np.isclose(covered, 2 * PI * (1 - np.sqrt(1 - 1 / np.dot(eye, eye))), rtol=0.01)


# A flat mirror


def test_flat_mirror_is_a_light_behind_it():
    found = flat()
    exact, inside = behind_the_wall(found.hits.points)
    inside &= found.hits.mask
    middle, beside = shrunk(inside), shrunk(~inside)
    share = found.irradiance[..., 0][middle] / (3 * exact[middle])
    assert middle.sum() > 200 and abs(share.mean() - 1) < 2e-3 and share.std() < 0.01
    assert found.irradiance[beside].max() < 5e-3 * found.irradiance.max()
    assert np.allclose(found.irradiance[..., 1] * 1.5, found.irradiance[..., 0])


def test_energy_is_conserved():
    found = flat()
    landed = found.photon_map.flux.sum()
    assert np.isclose((found.irradiance[..., 0] * found.area).sum(), 3 * landed, rtol=1e-3)
    energy = found.energy
    assert np.allclose(energy.view, energy.receivers, rtol=1e-3) and np.allclose(energy.reflector, energy.receivers)
    exact = caustic_photons.solid_angle(
        *((c := WALL.vertices - LIGHT.position) / np.linalg.norm(c, axis=1)[:, None])[:3]
    )
    other = caustic_photons.solid_angle(*(c / np.linalg.norm(c, axis=1)[:, None])[[0, 2, 3]])
    assert np.isclose(energy.reflector[0], 3 * (exact + other), rtol=0.01)


def test_photons_lie_where_the_mirror_image_shines():
    found = flat().photon_map
    landed = found.receiver >= 0
    assert landed.mean() > 0.8
    assert abs(found.position[landed][:, 2]).max() < 1e-5
    assert behind_the_wall(found.position[landed])[1].mean() > 0.99


def test_concentration_is_the_ratio_of_irradiances():
    found = flat()
    map_, ratio = found.photon_map, found.concentration()
    middle = (map_.position[:-1, :-1] + map_.position[1:, :-1] + map_.position[:-1, 1:]) / 3
    way = np.array(LIGHT.position) - middle
    direct = way[..., 2] / np.linalg.norm(way, axis=-1) ** 3
    landed = ratio[0] > 0
    assert landed.mean() > 0.8
    assert np.allclose(ratio[0][landed], (behind_the_wall(middle)[0] / direct)[landed], rtol=1e-2)


def test_render_adds_what_a_second_light_would():
    found = flat(show=False)
    image = found.render(shadows=False)
    lights = (LIGHT, mp.PointLight(VIRTUAL, LIGHT.intensity))
    wanted = mp.shade(found.hits, mp.Scene((FLOOR,), lights=lights))
    _, inside = behind_the_wall(found.hits.points)
    middle = shrunk(inside & found.hits.mask)
    assert np.allclose(image[middle], wanted[middle], rtol=0.02)
    assert abs(image[middle] / wanted[middle] - 1).mean() < 4e-3


def test_reflector_casts_a_shadow_shown_or_not():
    ball = Surface.sphere(0.4, (0, 0, 0.8))
    light = mp.PointLight((0.0, 0.0, 3.0), (5.0, 5.0, 5.0))
    found = caustics(FLOOR, ball, light, EYE, index=1.5, back=ball, triangles=60, photons=64, resolution=8)
    plain, shadowed = found.render(shadows=False), found.render()
    under = np.linalg.norm(found.hits.points[..., :2], axis=-1) < 0.5
    below = under & found.hits.mask
    direct = mp.shade(found.hits, found.seen_scene)
    assert np.allclose((plain - shadowed)[below], (direct - 0.15 * 0.8)[below], atol=1e-3)
    # What the ball takes away, it gives back, but for what its faces reflect: rays at the angle a from its middle meet
    # both faces at the angle b with sin b = 2.2 / 0.4 sin a.
    across = (np.arange(10_000) + 0.5) / 10_000
    part = caustic_photons.transmitted(np.sqrt(1 - across**2), 1.5) ** 2
    angle = across / np.sqrt((2.2 / 0.4) ** 2 - across**2)  # of sin a da
    share = found.energy.receivers[0] / found.energy.reflector[0]
    assert abs(share - (part * angle).sum() / angle.sum()) < 0.015


def test_far_from_the_origin_and_small():
    shift, size = np.array([1e4, -2e4, 3e3]), 1e-2

    def moved(mesh):
        return dataclasses.replace(mesh, vertices=mesh.vertices * size + shift)

    eye = dataclasses.replace(
        EYE, camera_from_world=mp.look_at(np.array([0, -5, 5]) * size + shift, np.array([0, 0.5, 0]) * size + shift)
    )
    light = mp.PointLight(tuple(np.array(LIGHT.position) * size + shift), LIGHT.intensity)
    far = caustics(moved(FLOOR), moved(WALL), light, eye, photons=128, resolution=32)
    near = flat()
    assert np.allclose(far.irradiance * size**2, near.irradiance, atol=0.02 * near.irradiance.max())
    assert np.allclose(far.energy.view, near.energy.view, rtol=1e-3)


def test_mirrors_may_take_a_color_away():
    color = (1.0, 0.0, 0.5)
    assert Settings(reflectance=0).reflectance == (0.0, 0.0, 0.0)
    found, white = flat(reflectance=color), flat()
    assert white.irradiance.max() > 0.01
    assert np.allclose(found.irradiance, white.irradiance * color, rtol=1e-5, atol=1e-9)


# What hides light


def test_what_the_eye_does_not_see_gets_nothing_elsewhere():
    screen = box((-0.2, -4.05, 3.3), (0.2, -4.0, 3.8))  # between the eye and the lit patch, off all light paths
    alone, hidden = flat(), flat(mp.Scene((FLOOR, screen)))
    triangle = hidden.hits.triangle
    assert np.allclose(hidden.energy.receivers, alone.energy.receivers, rtol=1e-3)
    on_screen = triangle >= 2
    assert on_screen.sum() > 100 and hidden.irradiance[on_screen & (triangle < 14)].max() < 1e-3
    kept = shrunk(~on_screen)
    assert np.allclose(hidden.irradiance[kept], alone.irradiance[kept], atol=0.02 * alone.irradiance.max())
    lost = alone.energy.view[0] - hidden.energy.view[0]
    behind = (alone.irradiance[..., 0] * alone.area)[on_screen].sum()
    assert lost > 0.02 * alone.energy.view[0] and abs(lost - behind) < 0.01 * alone.energy.view[0]


def test_what_stands_before_the_mirror_shades_it():
    assert flat(mp.Scene((FLOOR, box((-3, 0.4, 0.1), (3, 0.5, 4))))).energy.receivers.max() == 0


def test_borders_of_objects_lose_nothing():
    halves = mp.Scene((rectangle((-4, -4), (0.03, 4)), rectangle((0.03, -4), (4, 4))))
    split, whole = flat(halves), flat()
    assert set(np.unique(split.photon_map.receiver)) == {-1, 0, 1}
    assert np.allclose(split.energy.view, whole.energy.view, rtol=2e-3)


def test_mirror_met_again_stops_light():
    found = caustics(FLOOR, Surface.cylinder(1.0, 1.5, 5.5, (0, 0, 0.75)), LIGHT, EYE, photons=128, resolution=16)
    assert 0 < found.energy.receivers[0] < 0.9 * found.energy.reflector[0]


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_light_leaves_a_lens_of_any_size(size):
    """From one point of an ellipsoid to another, by the angle at the other."""
    radii, index = size * np.array([1.0, 0.6, 0.8]), 1 / 1.5
    ends = np.random.default_rng(2).normal(size=(2, 200, 3)) * radii
    start, end = ends / np.linalg.norm(ends / radii, axis=-1, keepdims=True)
    ways = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    normals = end / radii**2 / np.linalg.norm(end / radii**2, axis=1, keepdims=True)
    expected = caustic_photons.transmitted((ways * normals).sum(1), index)
    clear = np.linalg.norm(end - start, axis=1) > 0.1 * size
    found = caustic_photons._leaving(reflector_of(Surface.ellipsoid(radii)), start, ways, index)
    assert np.abs(found - expected)[clear].max() < 1e-6 and 50 < (expected > 0.5).sum() < 190
    assert not caustic_photons._leaving(reflector_of(Surface.ellipsoid(radii)), 2 * end, normals, index).any()


def test_where_a_mirror_of_any_size_is_met_again():
    """In a ring all light that comes from within crosses it once more, which ends below or above, or on it."""
    place = np.array(LIGHT.position)
    ring = Surface.cylinder(1.0, 1.5, 2 * PI, (0, 0, 0.75))
    cams = mp.decompose(ring, place, 20, resolution=4)
    for size in (1e-3, 1e3):
        ring = reflector_of(Surface.cylinder(size, 1.5 * size, 2 * PI, (0, 0, 0.75 * size)))
        bigger = dataclasses.replace(cams, vertices=size * cams.vertices, eye=size * cams.eye)
        found = caustic_photons.photons(size * place, ring, bigger, 64)
        first = pixel_hits(found.camera, ring)
        points = first.points / size
        outwards = points * (1, 1, 0)
        ways = first.along - 2 * (first.along * outwards).sum(1, keepdims=True) * outwards
        reach = -2 * (ways * outwards).sum(1) / (ways[:, :2] ** 2).sum(1)
        again = (reach > 1e-9) & (abs(points[:, 2] + reach * ways[:, 2] - 0.75) < 0.75)
        assert np.array_equal(found.share.ravel() > 0, first.hit & ~again) and 500 < again[first.hit].sum() < 1000


# What moves


def test_moved_receivers_eye_and_light_are_as_made_anew():
    found = flat()
    first = found.irradiance
    lifted = FLOOR.vertices + (0, 0, 0.3)
    found.update(lifted)
    anew = flat(dataclasses.replace(FLOOR, vertices=lifted))
    assert np.allclose(found.irradiance, anew.irradiance, atol=1e-4 * first.max())
    found.update(FLOOR.vertices)
    assert np.allclose(found.irradiance, first, atol=1e-5 * first.max())
    other = dataclasses.replace(EYE, camera_from_world=mp.look_at((1, -5, 4), (0, 0.5, 0)))
    found.aim(other)
    assert np.allclose(found.irradiance, flat(camera=other).irradiance, atol=1e-4 * first.max())
    light = mp.PointLight((0.5, -1.2, 2.2), (1.0, 1.0, 1.0))
    found.move_light(light)
    moved = caustics(FLOOR, WALL, light, other, photons=128, resolution=32)
    assert found.photons.lost < 1e-9
    assert np.allclose(found.irradiance, moved.irradiance, atol=1e-3 * first.max())


# Curved reflectors, against paths over the true surface


def nearest(meshes: list[mp.Mesh], origin: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether rays hit, and how far away."""
    with mitsuba() as mi:
        shapes = {f"m{i}": mitsuba_mesh(mi, f"m{i}", m.vertices, m.faces) for i, m in enumerate(meshes)}
        scene: Any = mi.load_dict({"type": "scene", **shapes})
        start, along = (np.ascontiguousarray(v.T, np.float32) for v in np.broadcast_arrays(origin, way))
        found = scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(start), mi.Vector3f(along)))
        hit = found.is_valid().numpy()
        return hit, np.where(hit, np.array(found.t, np.float64), np.inf)


def traced(surface: Surface, light, floor: mp.Mesh, camera, index=None, back=False, count: int = 640):
    """Flux that lands on the floor, and its picture: count^2 light paths, spread over a cone around the surface."""
    random, mesh, eye = np.random.default_rng(1), surface.mesh(60_000), np.array(light.position)
    ways = mesh.vertices - eye
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    axis = ways.mean(axis=0) / np.linalg.norm(ways.mean(axis=0))
    least = float((ways @ axis).min()) - 1e-4
    u, v = (np.indices((count, count)) + random.random((2, count, count))).reshape(2, -1) / count
    cosine, turn = least + (1 - least) * u, 2 * PI * v
    right = np.linalg.qr(np.stack([axis, *np.eye(3)[:2]], axis=1))[0].T[1:]
    across = np.cos(turn)[:, None] * right[0] + np.sin(turn)[:, None] * right[1]
    way = cosine[:, None] * axis + np.sqrt(1 - cosine**2)[:, None] * across
    flux = np.full(len(way), 2 * PI * (1 - least) / count**2)
    start = np.broadcast_to(eye, way.shape)
    for face in range(2 if back else 1):
        hit, far = nearest([mesh], start, way)
        if face == 0:
            hit &= far < nearest([floor], start, way)[1]
        place = surface.snap(start[hit] + far[hit, None] * way[hit], way[hit])
        normal, way, flux = surface.normal_at(place), way[hit], flux[hit]
        ratio = index if index is None or face == 0 else 1 / index
        if ratio is not None:
            flux = flux * caustic_photons.transmitted(abs((way * normal).sum(1)), ratio)
        way, goes = bent(way, normal, ratio)
        way, flux = way[goes], flux[goes]
        start = place[goes] + 1e-3 * way
    hit, far = nearest([floor], start, way)
    if index is None:
        hit &= far < nearest([mesh], start, way)[1]
    place, flux = (start + np.where(hit, far, 0)[:, None] * way)[hit], flux[hit]
    image = camera.project(place)
    pixel, seen = image.pixel[:, 0], image.valid[:, 0] & camera.contains(image.pixel[:, 0])
    way = place - np.asarray(camera.eye)
    far = np.linalg.norm(way, axis=1)
    if index is None:
        seen &= nearest([mesh], np.asarray(camera.eye), way / far[:, None])[1] > far * (1 - 1e-3)
    picture = np.zeros((camera.height, camera.width))
    column, row = pixel[seen].astype(int).T
    np.add.at(picture, (row, column), flux[seen])
    return flux.sum(), picture


BALL = Surface.sphere(0.7, (0, 0, 1.0))
CASES = {
    "ring": (
        Surface.cylinder(1.0, 0.5, 1.2 * PI, (0, 0, 0.25)),
        (-2.5, 0.3, 2.2),
        ((-2.2, -2.2, 3.2), (0.2, 0.1, 0)),
        {},
        45.0,
    ),
    "ball": (
        BALL,
        (-1.0, 0.5, 4.0),
        ((0, -3.5, 3.0), (0.2, 0, 0)),
        {"index": 1.5, "back": BALL, "triangles": 120},
        44.0,
    ),
    "interface": (
        Surface.paraboloid(1.2, -0.35, (0, 0, 1.2)),
        (0.3, 0.2, 4.5),
        ((0, -2.5, 3.5), (0, 0, 0)),
        {"index": 1.4},
        35.0,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_as_paths_over_the_true_surface(name):
    surface, place, (eye, target), settings, ratio = CASES[name]
    light = mp.PointLight(place)
    camera = mp.Pinhole(160, 120, 210, camera_from_world=mp.look_at(eye, target))
    found = caustics(FLOOR, surface, light, camera, **{"photons": 256, "resolution": 32, "triangles": 300, **settings})
    landed, picture = traced(surface, light, FLOOR, camera, settings.get("index"), "back" in settings)
    assert abs(found.energy.receivers[0] / landed - 1) < 0.01
    assert abs(found.energy.view[0] / picture.sum() - 1) < 0.01
    irradiance = found.irradiance[..., 0]
    assert np.isclose((irradiance * found.area).sum(), found.energy.view[0], rtol=1e-4)
    true = picture / np.where(found.area > 0, found.area, 1)
    mine, true = gaussian_filter(irradiance, 2), gaussian_filter(true, 2)
    assert 10 * np.log10(true.max() ** 2 / ((mine - true) ** 2).mean()) > ratio


# Mistakes


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"light": mp.DirectionalLight((0, 0, -1))}, "PointLight"),
        ({"photons": 1}, "photons"),
        ({"radius": -1}, "radius"),
        ({"radius": np.nan}, "radius"),
        ({"reflectance": (1, 2, 3)}, "reflectance"),
        ({"back": BALL}, "back"),
        ({"camera": mp.Orthographic(8, 8, 1.0)}, "center"),
        ({"camera": None}, "camera"),
        ({"scene": mp.Mesh([], [])}, "receivers"),
        ({"triangles": 0}, "triangles"),
        ({"reflector": None}, "reflector"),
    ],
)
def test_mistakes_are_told(settings, word):
    given = {"scene": FLOOR, "reflector": WALL, "light": LIGHT, "camera": EYE, "photons": 16, "resolution": 4}
    with pytest.raises(mp.InputError, match=word):
        caustics(**{**given, **settings})
