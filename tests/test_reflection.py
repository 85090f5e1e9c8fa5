"""Pictures of scenes with a mirror: against mirrored scenes, windows, and rays of the true surface."""

import dataclasses

import numpy as np
import pytest

import mpcam as mp
from mpcam.comparison import metrics
from mpcam.effects.mirror_methods import MIRROR_METHODS as METHODS
from mpcam.effects.reflection import Reflection

SIZE = (96, 72)


def at(mesh: mp.Mesh, place, scale=0.3, color=(0.8, 0.3, 0.2)) -> mp.Mesh:
    matrix = np.diag([*np.broadcast_to(scale, 3), 1.0])
    matrix[:3, 3] = place
    return dataclasses.replace(mesh.transformed(matrix), materials=(mp.Material(color),), face_material=None)


def things() -> tuple[mp.Mesh, ...]:
    cube = mp.builtin_mesh("cube", triangles=12)
    return (
        at(cube, (0.7, -0.2, 0.6)),
        at(cube, (-0.8, 0.1, 0.7), (0.2, 0.2, 0.5), (0.2, 0.6, 0.9)),
        at(mp.builtin_mesh("sphere", triangles=320), (0.1, 0.9, 0.8), 0.35, (0.3, 0.8, 0.3)),
    )


def scene(surface, **settings) -> mp.Scene:
    camera = mp.Pinhole.from_fov(*SIZE, 0.8, mp.look_at((0.2, -3.4, 2.4), (0, 0, 0.2)))
    light = mp.PointLight((0.5, -3, 5), (25, 25, 25))
    mirror = mp.Mirror(surface, **settings)
    return mp.Scene(things(), camera=camera, lights=(light,), background=(0.5, 0.6, 0.8), mirror=mirror)


def flat(size: float = 2.4) -> mp.Mesh:
    corners = 0.5 * size * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return mp.Mesh(corners, [[0, 1, 2], [0, 2, 3]])


def different(a: np.ndarray, b: np.ndarray, limit: float = 0.05) -> float:
    """Share of the pixels that differ clearly."""
    return float((np.abs(a - b).max(-1) > limit).mean())


WAVE = mp.Surface.wave(2.4, 0.1, 1.0)


def test_a_flat_mirror_shows_the_mirrored_scene():
    shown = scene(flat(), resolution=160)
    picture = mp.render(shown.camera, shown, shading="color")
    under = [mesh.transformed(np.diag([1.0, 1.0, -1.0, 1.0])) for mesh in things()]
    # Everything below the plane is seen through the mirror's own outline.
    window = Reflection(shown).mask
    both = mp.Scene((*things(), *under), background=shown.background)
    expected = mp.render(shown.camera, both, shading="color")
    beside = mp.render(shown.camera, mp.Scene(things(), background=shown.background), shading="color")
    truth = np.where(window[..., None], expected, beside)
    assert (different(expected, beside) > 0.03) and different(picture, truth) < 0.02
    assert np.median(np.abs(picture - truth)) < 1e-6


def test_an_interface_that_bends_nothing_is_a_window():
    shown = scene(WAVE, index=1.0, resolution=128)
    below = tuple(mesh.transformed(np.diag([1.0, 1.0, -1.0, 1.0])) for mesh in things())
    shown = dataclasses.replace(shown, meshes=below)
    seen = mp.render(shown.camera, shown, shading="color")
    bare = mp.render(shown.camera, dataclasses.replace(shown, mirror=None), shading="color")
    # Things reach up to z = -0.1, so the surface stands before them or not, and nothing is bent either way.
    assert different(seen, bare) < 0.03


@pytest.mark.parametrize(
    "surface",
    [
        WAVE,
        mp.Surface.paraboloid(1.2, 0.3),
        mp.Surface.paraboloid(1.2, -0.3),
        mp.Surface.sphere(0.7, (0, 0, -0.1)),
        mp.builtin_mesh("sphere", triangles=2000),
    ],
    ids=["mixed", "concave", "convex", "sphere", "mesh"],
)
def test_more_camera_triangles_come_nearer_to_the_true_surface(surface):
    shown = scene(surface)
    truth = Reflection(shown, method="raytrace").image()
    few, many = (Reflection(shown, triangles=n, resolution=r).image() for n, r in ((26, 60), (416, 24)))
    around = Reflection(shown, method="environment", size=256).image()
    errors = [metrics.image_rmse(image, truth) for image in (many, few, around)]
    assert errors[0] < errors[1] < errors[2]
    assert metrics.psnr(errors[0]) > 25


def test_refraction_comes_near_to_the_true_surface():
    shown = scene(WAVE, index=1.33)
    below = tuple(mesh.transformed(np.diag([1.0, 1.0, -1.0, 1.0])) for mesh in things())
    shown = dataclasses.replace(shown, meshes=below)
    truth = Reflection(shown, method="raytrace").image()
    errors = [
        metrics.image_rmse(Reflection(shown, triangles=n, resolution=r).image(), truth)
        for n, r in ((416, 24), (26, 60))
    ]
    assert errors[0] < errors[1] and metrics.psnr(errors[0]) > 28
    straight = mp.render(shown.camera, dataclasses.replace(shown, mirror=None))
    assert metrics.image_rmse(straight, truth) > 2 * errors[0]


def test_a_mirror_of_a_color_takes_light_away():
    color = np.array([0.5, 0.25, 0.0])
    shown = scene(WAVE)
    clear = Reflection(shown, method="raytrace")
    image = Reflection(shown, mirror=mp.Mirror(WAVE, color=tuple(color)), method="raytrace").image()
    seen = (image != clear.image()).any(-1)
    assert seen.sum() > 1000 and clear.mask[seen].all()
    expected = np.where(seen[..., None], clear.image() * color, clear.image())
    assert np.abs(image - expected).max() < 1e-6


def test_rays_that_miss_see_the_environment():
    v, u = np.meshgrid(np.linspace(0, 1, 64), np.linspace(0, 1, 128), indexing="ij")
    sky = mp.EnvironmentMap.from_panorama(np.stack([u, v, 1 - u], -1), 128)
    empty = mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    shown = dataclasses.replace(scene(mp.Surface.sphere(0.8)), meshes=(empty,), environment=sky)
    picture = Reflection(shown, triangles=400, resolution=32)
    image, truth = picture.image(), Reflection(shown, method="raytrace").image()
    inside = picture.mask
    assert inside.sum() > 400 and np.abs(image - truth)[inside].mean() < 0.01
    beside = ~inside
    ray = shown.camera.ray(np.stack(np.meshgrid(np.arange(96) + 0.5, np.arange(72) + 0.5), -1))
    assert np.allclose(image[beside], sky.lookup(ray.direction)[beside], atol=1e-3)


def test_panoramas_are_looked_up_where_they_lie():
    picture = np.zeros((64, 128, 3), np.float32)
    picture[:, 60:68] = (1, 0, 0)  # the middle: +x
    picture[:, 28:36] = (0, 1, 0)  # a quarter to the left: +y
    picture[:4] = (0, 0, 1)
    sky = mp.EnvironmentMap.from_panorama(picture)
    found = sky.lookup([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    assert np.allclose(found, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0], [0, 0, 0]], atol=0.02)
    with pytest.raises(mp.InputError, match="twice as wide"):
        mp.EnvironmentMap.from_panorama(np.zeros((4, 4)))


@pytest.mark.parametrize("method", METHODS)
def test_moved_vertices_give_the_moved_picture(method):
    shown = scene(WAVE)
    picture = Reflection(shown, method=method)
    before = picture.image()
    moved = shown.mesh.vertices + [0.2, 0.1, 0.1]
    picture.update(moved)
    meshes = [dataclasses.replace(mesh, vertices=mesh.vertices + [0.2, 0.1, 0.1]) for mesh in shown.meshes]
    other = dataclasses.replace(shown, meshes=tuple(meshes))
    after = picture.image()
    assert different(before, after) > 0.02
    assert different(after, Reflection(other, method=method).image()) < 0.003


def test_the_mirror_is_hidden_by_what_stands_before_it():
    shown = scene(WAVE)
    before = at(mp.builtin_mesh("cube", triangles=12), (0.15, -2.4, 1.7), 0.25, (1, 0, 1))
    covered = dataclasses.replace(shown, meshes=(*things(), before))
    image = mp.render(shown.camera, covered, shading="color")
    middle = image[30:42, 42:54].reshape(-1, 3)
    assert np.allclose(middle, (1, 0, 1), atol=1e-5)


def test_render_explains_and_compare_measures(tmp_path):
    shown = scene(WAVE)
    found = Reflection(shown).explanation
    assert "camera triangles" in found.ran and "environment map" in found.left_out
    table = mp.compare(
        shown,
        settings={"camera_triangles": [26, 104], "vertex": [2], "environment": [64], "depth_image": [64]},
        repeats=1,
        output=tmp_path / "out",
    )
    labels = ["camera_triangles 26", "camera_triangles 104", "vertex level 2", "environment 64", "depth_image 64"]
    labels.append("raytrace")
    assert [row.label for row in table] == labels
    flip, ray = table.column("flip"), table.column("ray_angle")
    assert flip[1] < flip[0] < flip[3] and flip[5] == 0 < flip[2] and ray[1] < ray[0] and 0 < flip[4] < flip[3]
    assert (tmp_path / "out" / "report.html").exists() and "mrad" in str(table)


def test_mistakes_are_told():
    shown = scene(WAVE)
    for arguments, words in (
        ({"method": "magic"}, "camera_triangles, vertex, environment, depth_image, raytrace"),
        ({"method": "raytrace", "triangles": 10}, "goes with method='camera_triangles' or 'vertex', not with 'raytr"),
        ({"level": 1}, "level= goes with method='vertex'"),
        ({"method": "vertex", "level": 9}, "from 0 to 7"),
        ({"triangles": 0}, "from 1 to"),
        ({"camera": mp.Orthographic(8, 8)}, "common center"),
        ({"mirror": WAVE}, "give mpcam.Mirror"),
        ({"shading": "shiny"}, "allowed are"),
    ):
        with pytest.raises(mp.InputError, match=words):
            Reflection(shown, **arguments)
    with pytest.raises(mp.InputError, match="no mirror"):
        Reflection(mp.Scene(things(), camera=shown.camera))
    with pytest.raises(mp.InputError, match="shows no mirror"):
        mp.render(shown.camera, shown, method="cubemap")
    for arguments in ({"surface": 3}, {"surface": WAVE, "index": 0}, {"surface": WAVE, "color": (1, 2)}):
        with pytest.raises(mp.InputError, match="mirror"):
            mp.Mirror(**arguments)
