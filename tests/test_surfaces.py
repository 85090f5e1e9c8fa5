"""Analytic surfaces: points on them, normals across them, and meshes that hold both."""

import numpy as np
import pytest

from mpcam.errors import InputError
from mpcam.geometry.surfaces import Surface

TURN = np.array([[0.36, 0.48, -0.8, 3.0], [-0.8, 0.6, 0.0, -1.0], [0.48, 0.64, 0.6, 2.0], [0, 0, 0, 1]])
SURFACES = {
    "sphere": Surface.sphere(2.0, (1, 2, 3)),
    "ellipsoid": Surface.ellipsoid((1, 2, 0.5)),
    "torus": Surface.torus(1.0, 0.4),
    "bowl": Surface.paraboloid(1.0, 0.5),
    "dome": Surface.paraboloid(1.0, -0.5),
    "patch": Surface.cylinder(1.0, 2.0, 2.0),
    "tube": Surface.cylinder(1.0, 2.0, 2 * np.pi),
    "saddle": Surface.saddle(),
    "wave": Surface.wave(),
    "turned": Surface.torus(1.0, 0.3).transformed(TURN),
}
EACH = pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
u, v = np.random.default_rng(1).uniform(0.02, 0.98, (2, 200))


@EACH
def test_normals_are_at_right_angles_to_the_surface(surface):
    normal, h = surface.normal(u, v), 1e-6
    assert np.abs(np.linalg.norm(normal, axis=-1) - 1).max() < 1e-14
    for du, dv in ((h, 0), (0, h)):
        along = (surface.point(u + du, v + dv) - surface.point(u - du, v - dv)) / (2 * h)
        assert np.abs((along * normal).sum(-1)).max() < 1e-7 * np.linalg.norm(along, axis=-1).max()


@EACH
def test_mesh_has_exact_points_and_normals_and_about_the_triangles(surface):
    for triangles in (12, 500, 20_000):
        mesh = surface.mesh(triangles)
        assert mesh.triangle_count <= 1.7 * triangles
        assert triangles < 100 or abs(mesh.triangle_count / triangles - 1) < 0.15
        assert np.abs(surface.snap(mesh.vertices, mesh.normals) - mesh.vertices).max() < 1e-12
        assert np.abs(surface.normal_at(mesh.vertices) - mesh.normals).max() < 1e-12
        if triangles > 100:
            assert np.abs(surface.point(*mesh.uv.T) - mesh.vertices).max() < 1e-12
            assert (mesh.face_normals * mesh.normals[mesh.faces].mean(axis=1)).sum(axis=1).min() > 0.8


@EACH
def test_points_beside_the_surface_are_put_on_it(surface):
    point, normal = surface.point(u, v), surface.normal(u, v)
    offset = np.random.default_rng(2).uniform(-0.02, 0.02, (200, 1))
    assert np.abs(surface.snap(point + offset * normal, normal) - point).max() < 1e-12
    near = surface.snap(point + offset * normal)
    assert np.abs(surface.snap(near) - near).max() < 1e-12
    assert np.linalg.norm(near - point, axis=-1).max() < 0.02


def test_closed_surfaces_close_to_the_bit():
    for name, flat in (("sphere", 0), ("torus", 0), ("tube", 2)):
        mesh = SURFACES[name].mesh(600)
        _, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
        faces = number.reshape(-1)[mesh.faces]
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        _, sides = np.unique(edges, axis=0, return_counts=True)
        assert set(sides) <= ({2} if flat == 0 else {1, 2}), name


def test_a_rigid_motion_moves_points_and_turns_normals():
    plain = Surface.torus(1.0, 0.3)
    turned = plain.transformed(TURN)
    assert np.allclose(turned.point(u, v), plain.point(u, v) @ TURN[:3, :3].T + TURN[:3, 3], atol=1e-14)
    assert np.allclose(turned.normal(u, v), plain.normal(u, v) @ TURN[:3, :3].T, atol=1e-14)


@pytest.mark.parametrize(
    "call",
    [
        lambda: Surface.sphere(0),
        lambda: Surface.sphere(np.nan),
        lambda: Surface.sphere("big"),
        lambda: Surface.sphere(1, (0, 0)),
        lambda: Surface.sphere(1, (0, 0, np.inf)),
        lambda: Surface.ellipsoid((1, 2)),
        lambda: Surface.ellipsoid((1, 2, -1)),
        lambda: Surface.torus(1, 1),
        lambda: Surface.cylinder(angle=7),
        lambda: Surface.paraboloid(-1),
        lambda: Surface.wave(waves=0),
        lambda: Surface.sphere().point(1.1, 0),
        lambda: Surface.sphere().normal(0, np.nan),
        lambda: Surface.sphere().mesh(3),
        lambda: Surface.sphere().mesh(20.5),
        lambda: Surface.sphere().mesh(True),
        lambda: Surface.sphere().transformed(2 * np.eye(4)),
    ],
)
def test_what_makes_no_surface_is_refused(call):
    with pytest.raises(InputError, match=".{20}"):
        call()
