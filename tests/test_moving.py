"""Scenes that move: each frame is that of the moved scene rendered anew, to the bit."""

import functools

import numpy as np
import pytest
from ray_fields import soup

import mpcam as mp
from mpcam.effects.reflection import Reflection
from mpcam.geometry.moved import moved
from mpcam.rendering.shade import SHADINGS, shade

pytestmark = pytest.mark.filterwarnings("ignore:shading='texture'")  # of the scenes here, one has a texture
METHODS = {"invert": {}, "vertex": {"level": 1}, "cubemap": {"resolution": 40}, "hemicube": {}, "raytrace": {}}
LIGHTS = (mp.DirectionalLight((0.3, -0.5, -1)), mp.PointLight((0.5, 1.0, 2.0), (3, 3, 3)))


def turn(seed, shift=0.3):
    rng = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix[:3, 0] *= np.linalg.det(matrix[:3, :3])
    matrix[:3, 3] = rng.normal(size=3) * shift
    return matrix


def scene(seed):
    """A ball with its own normals, a soup without, and a blob whose normals are those of its faces."""
    rng = np.random.default_rng(seed)
    ball = mp.builtin_mesh("sphere", triangles=320).transformed(np.diag([0.5, 0.5, 0.5, 1.0]))
    given = ball.vertices * rng.uniform(0.5, 1.5) + rng.normal(size=3) * 0.2
    blob = mp.Mesh(given * [1, 2, 1], ball.faces)
    blob = mp.Mesh(blob.vertices, blob.faces, normals=blob.smooth_normals(), materials=mp.Material((0.9, 0.4, 0.2)))
    colors = rng.uniform(0.1, 1, (len(ball.vertices), 3))
    checks = mp.Material(texture=rng.uniform(0.2, 1, (4, 5, 3)).astype(np.float32))
    ball = mp.Mesh(ball.vertices, ball.faces, ball.normals, rng.uniform(0, 2, (len(ball.vertices), 2)), colors, checks)
    return mp.Scene((ball, soup(60, seed, 0.4), blob), lights=LIGHTS, background=(0.1, 0.2, 0.3))


@functools.cache
def cameras():
    pose = mp.look_at((0.1, -2.4, 0.7), (0, 0, 0))
    sphere, eye = mp.builtin_mesh("sphere", triangles=80), (0.2, -3.0, 0.5)
    return {
        "fisheye": mp.Radial.equisolid(48, 48, camera_from_world=pose),
        "pinhole": mp.Pinhole(48, 40, fx=40, fy=40, cx=24, cy=20, camera_from_world=pose),
        "panorama": mp.Panorama.equirectangular(60, 30, camera_from_world=pose),
        "triangles": mp.decompose(sphere, eye, 20, resolution=9),
    }


def kinds():
    return [
        (name, method)
        for name in cameras()
        for method in METHODS
        if not (name == "triangles" and method not in ("invert", "raytrace"))
        and (name, method) != ("panorama", "vertex")
        and not (name == "panorama" and method == "hemicube")
    ]


def same(ours, fresh, shadings=SHADINGS, whole=None, fresh_scene=None):
    assert np.array_equal(ours.triangle, fresh.triangle) and np.array_equal(ours.depth, fresh.depth)
    assert np.array_equal(ours.barycentric, fresh.barycentric) and np.array_equal(ours.points, fresh.points)
    for shading in shadings:
        assert np.array_equal(shade(ours, whole, shading), shade(fresh, fresh_scene, shading)), shading


@pytest.mark.parametrize("name, method", kinds())
def test_a_frame_is_that_of_the_moved_scene(name, method):
    camera = cameras()[name]
    for seed in range(3):
        given = scene(seed)
        prepared = mp.prepare(camera, given, method, **METHODS[method])
        prepared.frame()
        for step, matrix in enumerate([turn(seed), turn(seed + 50, 2.0), np.eye(4)]):
            meshes = tuple(mesh.transformed(matrix) for mesh in given.meshes)
            after = mp.Scene(meshes, lights=LIGHTS, background=given.background)
            if step == 0:
                prepared.update(transform=matrix)
            else:
                prepared.update([mesh.vertices for mesh in meshes], normals=[mesh.normals for mesh in meshes])
            fresh = mp.rasterize(camera, after, method, **METHODS[method])
            same(prepared.frame(), fresh, whole=given, fresh_scene=after)
            assert fresh.mask.any() or step == 1


@pytest.mark.parametrize("output", ["depth", "coverage"])
def test_depth_and_coverage_alone(output):
    given, matrix = scene(1), turn(4, 1.0)
    for camera in cameras().values():
        prepared = mp.prepare(camera, given, output=output)
        prepared.update(transform=matrix)
        fresh = mp.prepare(camera, given.mesh.transformed(matrix), output=output).frame()
        field = "depth" if output == "depth" else "mask"
        assert np.array_equal(getattr(prepared.frame(), field), getattr(fresh, field))


def test_normals_of_faces_are_made_anew():
    """Bent, not turned: where normals came from the faces, and where there are none."""
    rng = np.random.default_rng(0)
    ball = mp.builtin_mesh("sphere", triangles=320)
    bent = ball.vertices + 0.2 * rng.normal(size=ball.vertices.shape)
    camera = cameras()["pinhole"]
    for normals in (None, ball.smooth_normals()):
        prepared = mp.prepare(camera, mp.Mesh(ball.vertices, ball.faces, normals=normals))
        prepared.update(bent)
        after = mp.Mesh(bent, ball.faces)
        after = after if normals is None else mp.Mesh(bent, ball.faces, normals=after.smooth_normals())
        same(prepared.frame(), mp.rasterize(camera, after))


def test_a_lit_ball_that_turns_looks_the_same():
    ball = mp.builtin_mesh("sphere", triangles=5120)
    whole = mp.Scene((ball,), lights=(mp.DirectionalLight((1, 1, -1)),))
    camera = mp.Pinhole(64, 64, fx=64, fy=64, cx=32, cy=32, camera_from_world=mp.look_at((0, -3, 1), (0, 0, 0)))
    prepared = mp.prepare(camera, whole)
    first = prepared.frame()
    before = shade(first, whole)
    quarter = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    prepared.update(transform=quarter)
    both = prepared.frame().mask & first.mask
    assert np.abs(shade(prepared.frame(), whole) - before)[both].max() < 0.02


def test_given_normals_that_are_not_known_any_more_are_refused():
    """Only by what needs them."""
    ball = mp.builtin_mesh("sphere", triangles=320)
    prepared = mp.prepare(cameras()["pinhole"], ball)
    prepared.update(1.1 * ball.vertices * [1, 2, 1])
    hits = prepared.frame()
    assert shade(hits, ball, "color").any() and hits.points.any() and hits.depth.any()
    for shading in ("light", "normal"):
        with pytest.raises(mp.InputError, match=r"pass update\(vertices, normals=\.\.\.\) or update\(transform="):
            shade(hits, ball, shading)
    prepared.update(ball.vertices)  # where they were
    shade(prepared.frame(), ball, "light")


def test_what_update_takes():
    given = scene(2)
    prepared = mp.prepare(cameras()["pinhole"], given)
    parts = [mesh.vertices for mesh in given.meshes]
    count = sum(len(part) for part in parts)
    assert len(given.mesh.vertices) == count
    before = prepared.frame().depth
    prepared.update([None, parts[1] + 0.1, None])
    part = prepared.frame().depth
    prepared.update(np.concatenate([parts[0], parts[1] + 0.1, parts[2]]))
    assert np.array_equal(prepared.frame().depth, part) and not np.array_equal(part, before)
    prepared.update(transform=[None, None, turn(3)])
    assert not np.array_equal(prepared.frame().depth, before)
    mine = np.array(given.mesh.vertices)
    prepared.update(mine)
    mine += 5.0
    assert np.array_equal(
        prepared.frame().points[prepared.frame().mask],
        mp.rasterize(cameras()["pinhole"], given).points[prepared.frame().mask],
    )
    bad = np.eye(4) * 2
    for arguments, words in [
        (
            ((np.zeros((4, 3))),),
            rf"vertices has shape \(4, 3\): give \({count}, 3\), as the mesh has, or a list with one",
        ),
        ((parts[:2],), "vertices holds 2 entries, and there are 3 meshes"),
        (([parts[0], parts[1], parts[2][:-1]],), rf"vertices\[2\] has shape \({len(parts[2]) - 1}, 3\)"),
        ((["a"],), "give numbers of shape"),
        ((), "give either vertices=, new positions, or transform="),
    ]:
        with pytest.raises(mp.InputError, match=words):
            prepared.update(*arguments)
    for settings in ({"transform": bad}, {"transform": np.eye(4), "normals": parts}, {"transform": [np.eye(4)]}):
        with pytest.raises(mp.InputError):
            prepared.update(**settings)


@pytest.mark.parametrize(
    "method, shading",
    [("camera_triangles", one) for one in SHADINGS] + [(one, "light") for one in ("vertex", "environment", "raytrace")],
)
def test_mirrors(method, shading):
    """Of the scene, the mirror stays where it is."""
    camera = mp.Pinhole(48, 48, fx=60, fy=60, cx=24, cy=24, camera_from_world=mp.look_at((0, -4, 1), (0, 0, 0)))
    mirror = mp.Mirror(mp.Surface.sphere(0.7, (0, 0, 0)), triangles=40, resolution=16)
    apart = np.eye(4)
    apart[:3, 3] = (1.5, -1.5, 0.3)
    given = mp.Scene(tuple(m.transformed(apart) for m in scene(1).meshes), lights=LIGHTS, mirror=mirror)
    picture = Reflection(given, camera, method=method, shading=shading)
    for matrix in (turn(1, 0.2), turn(10, 0.4)):
        meshes = tuple(mesh.transformed(matrix) for mesh in given.meshes)
        picture.update([mesh.vertices for mesh in meshes], normals=[mesh.normals for mesh in meshes])
        fresh = Reflection(mp.Scene(meshes, lights=LIGHTS, mirror=mirror), camera, method=method, shading=shading)
        assert np.array_equal(picture.image(), fresh.image())
        picture.update(transform=matrix)
        assert np.array_equal(picture.image(), fresh.image())


def test_meshes_with_and_without_normals_keep_their_tables():
    ball = mp.builtin_mesh("sphere", triangles=5120)
    plane = mp.Mesh(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)], normals=np.tile([0.6, 0, 0.8], (4, 1))
    )
    whole = mp.Scene((mp.Mesh(ball.vertices, ball.faces), plane)).mesh
    assert len(whole.vertices) == len(ball.vertices) + 4
    camera = cameras()["pinhole"]
    apart = mp.Mesh.concatenate([mp.Mesh(ball.vertices, ball.faces).flat(), plane])
    for shading in SHADINGS:
        found, expected = (shade(mp.rasterize(camera, mesh), mesh, shading) for mesh in (whole, apart))
        assert np.abs(found - expected).max() < 1e-5


def test_moved_meshes_share_what_does_not_move():
    given = scene(3).mesh
    after = moved(given, given.vertices + 0.5, normals=given.normals)
    for name in ("faces", "colors", "materials", "face_material", "parts"):
        assert getattr(after, name) is getattr(given, name)
    assert after.bounds[0] == pytest.approx(given.bounds[0] + 0.5)
    again = mp.Mesh.concatenate([after, after])
    assert len(again.vertices) == 2 * len(given.vertices)
    assert np.array_equal(after.transformed(np.eye(4)).normals, given.transformed(np.eye(4)).normals)
