"""Mirrors made of meshes as people have them: winding, normals and stray faces must not show."""

import warnings

import numpy as np
import pytest

import mpcam as mp
from mpcam.decomposition.reflector import Reflector
from mpcam.decomposition.welding import has_area
from mpcam.decomposition.winding import first_of_each, reversed_faces
from mpcam.effects.mirror_rays import mirror_rays
from mpcam.effects.reflection import Reflection

BALL = mp.Surface.sphere(1.0).mesh(3000)
assert BALL.normals is not None
RNG = np.random.default_rng(5)
CAMERA = mp.Pinhole(64, 64, fx=70, fy=70, cx=32, cy=32, camera_from_world=mp.look_at((0.4, -3.5, 1.2), (0, 0, 0)))


def mixed(mesh, share=0.5, normals=None):
    around = RNG.random(len(mesh.faces)) < share
    return mp.Mesh(mesh.vertices, np.where(around[:, None], mesh.faces[:, [1, 0, 2]], mesh.faces), normals)


def stray(mesh):
    """With a face of no area far away, and one that holds no numbers."""
    more = [(1e7, 0, 0), (1e7, 0, 0), (1e7, 1, 0), (np.nan, 0, 0)]
    n = len(mesh.vertices)
    faces = np.concatenate([[(n, n + 1, n + 2), (n, n + 2, n + 3)], mesh.faces])
    normals = None if mesh.normals is None else np.concatenate([mesh.normals, np.tile([0, 0, 1.0], (4, 1))])
    return mp.Mesh(np.concatenate([mesh.vertices, more]), faces, normals)


BARE = mp.Mesh(BALL.vertices, BALL.faces)
KINDS = {
    "as it is": BARE,
    "mixed": mixed(BARE),
    "inside out": mixed(BARE, 2.0),
    "doubled": mp.Mesh(BALL.vertices, np.concatenate([BALL.faces, BALL.faces[:, [2, 1, 0]]])),
    "corners of their own": mixed(
        mp.Mesh(BALL.vertices[BALL.faces.ravel()], np.arange(BALL.faces.size).reshape(-1, 3))
    ),
    "stray faces": stray(BARE),
    "with normals": mp.Mesh(BALL.vertices, BALL.faces, BALL.normals),
    "normals against the winding": mp.Mesh(BALL.vertices, BALL.faces, -BALL.normals),
    "mixed, with normals": mixed(BARE, 0.5, BALL.normals),
    "mixed normals": mp.Mesh(
        BALL.vertices, BALL.faces, BALL.normals * np.where(RNG.random((len(BALL.vertices), 1)) < 0.5, 1, -1)
    ),
    "stray, with normals": stray(mp.Mesh(BALL.vertices, BALL.faces, -BALL.normals)),
}


def off_the_sphere(mesh):
    """How far true rays are from those of the sphere, by its own geometry: largest angle off the outline, and mask."""
    truth = mirror_rays(CAMERA, mp.Mirror(mesh))
    v, u = np.divmod(np.arange(64 * 64), 64)
    way = CAMERA.ray(np.stack([u + 0.5, v + 0.5], -1)).direction
    eye = np.array([0.4, -3.5, 1.2])
    b = way @ eye
    root = b * b - (eye @ eye - 1)
    points = eye + (-b - np.sqrt(np.maximum(root, 0)))[:, None] * way
    after = way - 2 * (way * points).sum(1, keepdims=True) * points
    clear = root > 0.2
    angle = np.linalg.norm(truth.ray.direction - after, axis=1)[clear]
    return angle.max(), truth.ray.valid[clear].all(), clear.sum()


@pytest.mark.parametrize("kind", KINDS)
def test_true_rays_are_those_of_the_sphere(kind):
    worst, whole, count = off_the_sphere(KINDS[kind])
    assert whole and count > 500
    assert worst < 0.02, worst


@pytest.mark.parametrize("kind", KINDS)
def test_pictures_are_those_of_the_clean_mesh(kind):
    """By camera triangles: as much of a red ball is seen in the mirror, and more triangles come nearer to the truth."""
    red = mp.builtin_mesh("sphere", triangles=1280).transformed(np.diag([0.4, 0.4, 0.4, 1.0]))
    place = np.eye(4)
    place[:3, 3] = (0.9, -1.9, 0.9)
    red = mp.Mesh(red.vertices, red.faces, materials=mp.Material((1, 0, 0))).transformed(place)

    def reds(mesh, **settings):
        mirror = mp.Mirror(mesh, triangles=200, resolution=16)
        picture = Reflection(mp.Scene((red,), mirror=mirror), CAMERA, shading="color", **settings)
        return picture.image()[..., 0] * picture.mask

    true = reds(BALL, method="raytrace")
    for method in ("raytrace", "camera_triangles"):
        found = reds(KINDS[kind], method=method)
        assert abs((found > 0.3).sum() - (true > 0.3).sum()) <= 0.05 * (true > 0.3).sum()
        assert np.abs(found - true).mean() < 0.006
    assert (true > 0.3).sum() > 50


def test_a_stray_face_does_not_move_the_center():
    for kind in ("stray faces", "stray, with normals"):
        found = Reflector(KINDS[kind])
        assert np.abs(found.center).max() < 0.01 and abs(found.radius - 1) < 0.01


def test_area_is_told_from_rounding():
    """Corners on one line but for the last bit have none, thin and tiny triangles have one; whichever edge is long."""
    way = np.array([1e-9, 0.7, -0.3])
    none = np.array([[np.zeros(3), way, way * 1e-7 / 7], [np.zeros(3), way / 3, way], [way, way, way]])
    some = np.array([[(0, 0, 0), (1, 0, 0), (0.5, 1e-9, 0)], [(0, 0, 0), (1e-6, 0, 0), (1, 1e-6, 0)]])
    for order in ([0, 1, 2], [0, 2, 1]):
        for size in (1e-30, 1.0, 1e30):
            assert not has_area(size * none[:, order]).any()
            assert has_area(size * some[:, order]).all()


def test_normals_against_the_winding_give_the_same_error():
    """To the bit: only their sides differ."""
    along, against = (KINDS[kind] for kind in ("with normals", "normals against the winding"))
    for triangles in (26, 104):
        a, b = (mp.ray_error(mp.decompose(m, CAMERA, triangles), m, CAMERA) for m in (along, against))
        assert a.angle_rms == pytest.approx(b.angle_rms, rel=1e-6) and a.rms == pytest.approx(b.rms, rel=1e-6)


def test_winding_by_parts():
    """Two separate triangles of two faces, one with the larger part turned; and a face that is there three times."""
    faces = np.array([(0, 1, 2), (1, 0, 3), (4, 5, 6), (4, 5, 7), (5, 4, 6), (6, 4, 5)])
    usable = first_of_each(faces)
    assert usable.tolist() == [True, True, True, True, False, False]
    areas = np.array([1, 1, 1, 3, 1, 1.0])
    assert reversed_faces(faces, areas, usable).tolist() == [False, False, True, False, False, False]
    areas[3] = 0.5
    assert reversed_faces(faces, areas, usable).tolist() == [False, False, False, True, False, False]


def test_what_has_one_side_is_said():
    count = 20
    angle = np.arange(count) * 2 * np.pi / count
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    tilt = 0.3 * np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], -1)
    vertices = np.concatenate([ring + tilt, ring - tilt])
    faces = []
    for i in range(count):
        j, (a, b) = (i + 1) % count, (i, i + count)
        c, d = (j, j + count) if j else (count, 0)
        faces += [(a, b, c), (c, b, d)]
    with pytest.warns(UserWarning, match="40 faces belong to a part with one side only \\(0, 1, 2, 3, 4, ...\\)"):
        Reflector(mp.Mesh(vertices, faces))
    fan = [(0, 1, 2), (1, 0, 3), (0, 1, 4)]
    corners = [(0, 0, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (-1, -1, 0)]
    with pytest.warns(UserWarning, match="3 faces share an edge with two or more others \\(0, 1, 2\\)"):
        Reflector(mp.Mesh(corners, fan))
    fan += [(1, 0, 5), (0, 1, 6)]
    corners += [(-1, 1, 0), (1, 1, 0)]
    with pytest.warns(UserWarning, match="5 faces share an edge with two or more others \\(0, 1, 2, 3, 4\\)"):
        Reflector(mp.Mesh(corners, fan))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Reflector(mp.Mesh(vertices, faces[:-2]))
