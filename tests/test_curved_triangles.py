"""Camera triangles of degree 2: rays against polynomials, what is shared along edges, rasterization, decomposition."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from catalog import first_hits
from triangle_cameras import CAMERAS, around, centers

import mpcam as mp
from mpcam.backend import types
from mpcam.cameras.serialize import camera_from_json, camera_to_json
from mpcam.cameras.triangle_nodes import mixed, sides, slopes, weights
from mpcam.decomposition.border import Border
from mpcam.decomposition.middles import quadratic
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.shooting import Locator
from mpcam.rendering.general import GeneralRasterizer

EYE = mp.Pinhole(97, 71, 90, 92, 48, 36, camera_from_world=mp.look_at((3, 1, 2.5), (0, 0, 0)))
NODES = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0.5), (0, 0.5), (0.5, 0)])
"""Weights of corners 2 and 3 at the six vertices."""
FACES = np.array([[0, 1, 2, 4, 5, 3], [6, 2, 1, 4, 7, 8]])
KINDS = ("direct", "unit", "mirror", "lens")


def terms(x: Any, y: Any) -> np.ndarray:
    """The monomials of degree 2, (..., 6)."""
    return np.stack([1 + 0 * x, x, y, x * x, x * y, y * y], axis=-1)


def polynomials(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directions (6, 3) over a plane, gently curved, as coefficients of monomials."""
    rng = np.random.default_rng(seed)
    places, along = 0.15 * rng.normal(size=(2, 6, 3))
    places[:3] += [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    along[:3] += [[0, 0, 1], [0.3, 0, 0], [0, 0.3, 0]]
    return places, along


def curved(kind: str, resolution: Any = 30, pose: Any = None) -> mp.CameraTriangles:
    """Two triangles of the square, (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0), with the values of the polynomials."""
    places, along = polynomials()
    at = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5), (1, 1), (1, 0.5), (0.5, 1)])
    vertices, values = (terms(*at.T) @ table for table in (places, along))
    given = {
        "direct": {"directions": values, "ray_scale": "near_far"},
        "unit": {"directions": values},
        "mirror": {"normals": values, "eye": (0.2, 0.3, 4)},
        "lens": {"normals": values, "eye": (0.2, 0.3, 4), "index": 1.5},
    }[kind]
    return mp.CameraTriangles(vertices, FACES, **given, degree=2, resolution=resolution, camera_from_world=pose)


def test_weights_are_those_of_the_nodes_and_their_slopes():
    assert np.array_equal(np.stack(weights(*NODES.T, 6), axis=-1), np.eye(6))
    assert np.array_equal(np.stack(weights(*NODES[:3].T, 3), axis=-1), np.eye(3))
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 20))
    for many in (3, 6):
        assert np.allclose(sum(weights(x, y, many)), 1)
        table = rng.normal(size=(many, 3, 20))
        for axis, step in enumerate(([1e-6, 0], [0, 1e-6])):
            two = [mixed(list(table), x + s * step[0], y + s * step[1]) for s in (1, -1)]
            assert np.allclose(sides(list(table), x, y)[axis], (two[0] - two[1]) / 2e-6, atol=1e-6)
            parts = np.stack(np.broadcast_arrays(*slopes(x, y, many)[axis]))
            assert np.allclose(np.einsum("mn,mxn->xn", parts, table), (two[0] - two[1]) / 2e-6, atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_rays_are_those_of_the_polynomials(kind):
    """Positions and directions at pixels against monomials; the bend by Snell's law and by equal angles."""
    camera = curved(kind)
    pixel = centers(camera)
    ray = camera.ray(pixel)
    face, second, third, inside = camera.atlas.locate(*np.moveaxis(pixel, -1, 0))
    assert np.array_equal(ray.valid, inside) and inside.sum() == 2 * 30 * 31 // 2
    x = np.where(face == 0, second, 1 - second)[inside]
    y = np.where(face == 0, third, 1 - third)[inside]
    places, along = polynomials()
    origin, value = terms(x, y) @ places, terms(x, y) @ along
    assert np.allclose(ray.origin[inside], origin, atol=1e-14)
    if kind == "unit":  # unit at the vertices only: a polynomial through them
        nodal = terms(*NODES.T) @ along, terms(*(1 - NODES).T) @ along
        fits = [np.linalg.solve(terms(*NODES.T), one / np.linalg.norm(one, axis=1, keepdims=True)) for one in nodal]
        weight = second[inside], third[inside]
        value = np.where((face[inside] == 0)[:, None], *(terms(*weight) @ fit for fit in fits))
    value /= np.linalg.norm(value, axis=-1, keepdims=True)
    if kind in ("mirror", "lens"):
        come = origin - [0.2, 0.3, 4]
        come /= np.linalg.norm(come, axis=-1, keepdims=True)
        gone = ray.direction[inside]
        if kind == "mirror":
            assert np.allclose(come - gone, 2 * (come * value).sum(-1, keepdims=True) * value, atol=1e-13)
        else:
            assert np.allclose(np.cross(come, value), 1.5 * np.cross(gone, value), atol=1e-13)
        assert ((gone * value).sum(-1) * (come * value).sum(-1) * (-1 if kind == "mirror" else 1) > 0).all()
    else:
        assert np.allclose(ray.direction[inside], value, atol=1e-14)
    single = camera.ray(types().Array2f(*pixel.reshape(-1, 2).T.astype(np.float32)))
    for ours, truth in ((single.origin, ray.origin), (single.direction, ray.direction)):
        assert np.allclose(ours.numpy().T.reshape(truth.shape)[inside], truth[inside], atol=3e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_both_triangles_have_the_rays_of_their_edge(kind):
    camera = curved(kind)
    t = np.linspace(0, 1, 30)
    one, other = camera.ray_at(np.zeros(30, int), 1 - t, t), camera.ray_at(np.ones(30, int), t, 1 - t)
    for first, second in zip(one[:2], other[:2], strict=True):
        assert np.allclose(first, second, atol=1e-15 if kind != "lens" else 1e-14)
    flat = 0.5 * (camera.vertices[1] + camera.vertices[2])
    assert np.linalg.norm(camera.vertices[4] - flat) > 0.03


@pytest.mark.parametrize("name", ["direct", "lengths", "mirror", "lens", "sizes", "total reflection"])
def test_raised_from_degree_1_rays_stay(name):
    camera = CAMERAS[name]()
    raised = quadratic(camera)
    assert raised.degree == 2 and raised.count == camera.count and raised.kind == camera.kind
    one, two = camera.ray(centers(camera)), raised.ray(centers(camera))
    assert np.array_equal(one.valid, two.valid)
    assert np.allclose(one.origin, two.origin, atol=1e-14) and np.allclose(one.direction, two.direction, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turned", [False, True])
def test_rasterized_as_by_brute_force_and_by_tracing(kind, turned):
    pose = mp.look_at((3, -2, 1), (0.2, 0.4, 0.6)) if turned else None
    camera = curved(kind, np.array([19, 26]), pose)
    mesh = around(camera, 80, 0.3)
    hits = GeneralRasterizer(camera, mesh).frame()
    triangle, depth = first_hits(camera, mesh)
    ours = np.asarray(hits.triangle)
    assert (triangle >= 0).mean() > 0.15 and (ours != triangle).mean() < 0.004
    same = (ours == triangle) & (triangle >= 0)
    assert np.allclose(np.asarray(hits.depth)[same], depth[same], rtol=2e-4, atol=2e-5)
    traced = np.asarray(mp.rasterize(camera, mesh, method="raytrace").triangle)
    assert (ours != traced).mean() < 0.004
    flat = dataclasses.replace(camera, faces=camera.faces[:, :3], degree=1)
    assert (np.asarray(mp.rasterize(flat, mesh).triangle) != triangle).mean() > 0.03


@pytest.mark.parametrize("kind", ["direct", "mirror"])
@pytest.mark.parametrize("bent", [0.1, 0.6])
def test_points_on_rays_project_back_and_nothing_is_invented(kind, bent):
    """However the triangles are bent: folded over, and with rays to all sides."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        values = [0, 0, 1] + bent * rng.normal(size=(6, 3))
        given = {"directions": values, "ray_scale": "near_far"} if kind == "direct" else {"normals": values}
        vertices = np.pad(NODES, ((0, 0), (0, 1))) + bent * rng.normal(size=(6, 3))
        eye = {"eye": (0.2, 0.3, 4)} if kind == "mirror" else {}
        camera = mp.CameraTriangles(vertices, [range(6)], **given, **eye, degree=2, resolution=30)
        pixel = rng.uniform(0, 30, (300, 2))
        ray = camera.ray(pixel)
        points = ray.origin + rng.uniform(0.1, 4, 300)[:, None] * ray.direction
        found = camera.project(points)
        _, second, third, _ = camera.atlas.locate(*pixel.T)
        inside = ray.valid & (np.minimum(np.minimum(second, third), 1 - second - third) > 1e-6)
        off = np.where(found.valid, np.abs(found.pixel - pixel[:, None]).max(-1), np.inf).min(axis=1)
        assert inside.sum() > 100 and not (inside & ~(off < 1e-3)).any()
        back = camera.ray(found.pixel)
        away = points[:, None] - back.origin
        gap = np.linalg.norm(away - found.depth[..., None] * back.direction, axis=-1)
        assert gap[found.valid].max() < 1e-9 and back.valid[found.valid].all()
        assert (np.diff(np.where(found.valid, found.depth, 1e9), axis=1) >= 0).all()


def test_both_images_at_a_fold_are_found():
    """Rays of (x, y, 0) along (s (x - 1/2)^2 - (x - 1/2), (1/4 - y) / 2, 1): two images of points at z = 1, or none."""
    x, y = NODES.T
    along = np.stack([0.7 * (x - 0.5) ** 2 - (x - 0.5), 0.5 * (0.25 - y), 1 + 0 * x], axis=1)
    vertices = np.stack([x, y, 0 * x], axis=1)
    settings: dict[str, Any] = {"directions": along, "ray_scale": "near_far", "degree": 2, "resolution": 101}
    camera = mp.CameraTriangles(vertices, [range(6)], **settings)
    aside, height = np.meshgrid(np.geomspace(1e-4, 0.3, 9), np.linspace(0.02, 0.18, 5))
    points = np.stack([0.5 + 0.7 * aside**2, 0.5 * height + 0.125, 1 + 0 * aside], axis=-1)
    found = camera.project(points)
    assert (found.valid.sum(axis=-1) == 2).all()
    at = np.sort(np.where(found.valid, found.pixel[..., 0], np.inf), axis=-1)[..., :2]
    truth = 0.5 + 100 * np.stack([0.5 - aside, 0.5 + aside], axis=-1)
    assert np.abs(at - truth).max() < 1e-8
    assert np.abs(np.where(found.valid, found.pixel[..., 1] - 0.5 - 100 * height[..., None], 0)).max() < 1e-8
    assert not camera.project(points - [0.01, 0, 0]).valid[aside < 0.1].any()
    assert not camera.project(points * [1, 1, -1]).valid.any()


@pytest.mark.parametrize("kind", KINDS)
def test_images_are_the_same_on_the_device(kind):
    camera = curved(kind)
    rng = np.random.default_rng(3)
    ray = camera.ray(rng.uniform(2, 12, (40, 2)))
    points = ray.origin + rng.uniform(0.5, 2, 40)[:, None] * ray.direction
    truth = camera.project(points)
    assert truth.valid.any(axis=1).all()
    other = camera.project(types().Array3f(*points.T.astype(np.float32)))
    depth, valid = (
        np.stack([np.broadcast_to(np.asarray(values), 40) for values in part], -1)
        for part in (other.depth, other.valid)
    )
    nearest = np.where(truth.valid, truth.depth, 1e9).min(axis=1)
    assert np.allclose(np.where(valid, depth, 1e9).min(axis=1), nearest, rtol=1e-3)


SURFACES = {
    "sphere": mp.Surface.sphere(1.0),
    "bowl": mp.Surface.paraboloid(),
    "wave": mp.Surface.wave(),
}


@pytest.fixture(scope="module")
def made() -> dict[str, tuple[mp.CameraTriangles, mp.CameraTriangles]]:
    return {
        name: (mp.decompose(one, EYE, 40, resolution=12), mp.decompose(one, EYE, 40, resolution=12, degree=2))
        for name, one in SURFACES.items()
    }


@pytest.mark.parametrize("name", SURFACES)
def test_decomposed_vertices_lie_on_the_surface_and_rays_are_nearer(made, name):
    flat, cams = made[name]
    surface, whole = SURFACES[name], reflector_of(SURFACES[name])
    assert np.array_equal(cams.faces[:, :3], flat.faces) and np.array_equal(
        cams.vertices[: len(flat.vertices)], flat.vertices
    )
    assert np.allclose(surface.snap(cams.vertices, cams.normals), cams.vertices, atol=1e-9)
    assert np.allclose(surface.normal_at(cams.vertices), cams.normals, atol=1e-9)
    middle = cams.vertices[cams.faces[:, [[1, 2], [2, 0], [0, 1]]]].mean(axis=2)
    edge = np.linalg.norm(cams.vertices[cams.faces[:, [1, 2, 0]]] - cams.vertices[cams.faces[:, [2, 0, 1]]], axis=2)
    assert (np.linalg.norm(cams.vertices[cams.faces[:, 3:]] - middle, axis=2) < 0.6 * edge).all()
    before, after = (mp.ray_error(one, surface, EYE) for one in (flat, cams))
    assert after.rms * {"sphere": 30, "bowl": 3, "wave": 1.3}[name] < before.rms and after.missed == 0
    border = Border(whole)
    if border.count:
        rim = border.nearest(flat.vertices)[0] < 1e-3
        assert rim.sum() > 8 and (border.nearest(cams.vertices)[0] < 1e-3).sum() >= 1.8 * rim.sum()


def test_places_are_found_again(made):
    """What a place in a curved triangle ties to on the surface is found there again."""
    _, cams = made["wave"]
    rng = np.random.default_rng(4)
    face = rng.integers(0, cams.count, 400)
    second, third = rng.uniform(0.02, 0.48, (2, 400))
    places, normals = cams.interpolated(face, second, third)
    found = Locator(cams.vertices, cams.normals, cams.faces).locate((places + 0.02 * normals).T, normals.T)
    assert found.inside.mean() > 0.99 and (found.face == face).mean() > 0.97
    same = found.face == face
    assert np.abs(found.second - second)[same].max() < 1e-7 and np.abs(found.third - third)[same].max() < 1e-7


def test_meshes_that_are_taken_as_they_are_stay_exact():
    mesh = mp.Surface.sphere(1.0).mesh(60)
    cams = mp.decompose(mesh, EYE, 500, degree=2)
    assert mp.ray_error(cams, mesh, EYE).rms < 1e-9


def test_each_in_four(made):
    _, cams = made["sphere"]
    finer = mp.decomposition.decompose.subdivided(cams, SURFACES["sphere"])
    assert finer.degree == 2 and finer.count == 4 * cams.count and finer.resolution == 6
    assert np.allclose(np.linalg.norm(finer.vertices, axis=1), 1, atol=1e-9)
    before, after = (mp.ray_error(one, SURFACES["sphere"], EYE) for one in (cams, finer))
    assert after.rms * 4 < before.rms and after.missed == 0
    edges = np.sort(finer.faces[:, [1, 2, 2, 0, 0, 1]].reshape(-1, 3, 2), axis=2)
    by_edge = {}
    for ends, middle in zip(edges.reshape(-1, 2), finer.faces[:, 3:].ravel(), strict=True):
        assert by_edge.setdefault(tuple(ends), middle) == middle


def test_resolved_pictures_are_nearer(made):
    """The atlas holds directions; put back, they are compared with the true ones."""
    away = {}
    for cams in made["sphere"]:
        cams = dataclasses.replace(cams, resolution=24)
        image = np.asarray(cams.ray(centers(cams)).direction, np.float32)
        resolver = mp.Resolver(cams, SURFACES["sphere"], EYE)
        seen = resolver(image)[resolver.mask]
        seen /= np.linalg.norm(seen, axis=1, keepdims=True)
        away[cams.degree] = np.sqrt(((seen - resolver.direction[resolver.mask]) ** 2).sum(axis=1).mean())
    assert away[2] * 3 < away[1] < 0.02


def test_a_second_bend_behind_curved_triangles(made):
    flat, cams = made["sphere"]
    plate = mp.Mesh([[-3, -3, -3], [3, -3, -3], [3, 3, -3], [-3, 3, -3]], [[0, 1, 2], [0, 2, 3]])
    errors = []
    for one in (flat, cams):
        after = mp.chained(one, plate, least=1, most=1).camera
        truth = mp.chained(flat, plate, reflector=SURFACES["sphere"], least=1, most=1).camera
        if len(after.vertices) == len(truth.vertices):
            errors.append(np.median(np.linalg.norm(after.vertices - truth.vertices, axis=1)))
    assert len(errors) == 2 and errors[1] * 10 < errors[0]


def test_written_and_read_back(made):
    _, cams = made["wave"]
    back: Any = camera_from_json(camera_to_json(cams))
    assert back.degree == 2 and (back.faces == cams.faces).all() and (back.normals == cams.normals).all()
    pixel = centers(cams)
    assert np.array_equal(back.ray(pixel).direction, cams.ray(pixel).direction)


def test_a_fit_is_nearer_still(tmp_path):
    surface = SURFACES["sphere"]
    cams = mp.decompose(surface, EYE, 12, degree=2)
    result = mp.fit(cams, reflector=surface, eye=EYE, samples=1500, iterations=8)
    assert result.gain > 2.5 and result.overfit < 1.5 and result.error.missed == 0
    assert result.camera.degree == 2 and (result.camera.faces == cams.faces).all()
    flat = mp.ray_error(mp.decompose(surface, EYE, 12), surface, EYE)
    assert mp.ray_error(result.camera, surface, EYE).rms * 30 < flat.rms
    mp.write_fit(tmp_path / "fit.npz", result)
    back = mp.read_fit(tmp_path / "fit.npz").camera
    assert back.degree == 2 and (back.vertices == result.camera.vertices).all()


def test_mistakes(made):
    flat, cams = made["sphere"]
    given: dict[str, Any] = {"directions": np.ones((6, 3))}
    with pytest.raises(mp.InputError, match="or degree=2"):
        mp.CameraTriangles(np.eye(6)[:, :3], [range(6)], **given)
    with pytest.raises(mp.InputError, match=r"give \(F, 6\)"):
        mp.CameraTriangles(np.eye(6)[:, :3], [[0, 1, 2]], degree=2, **given)
    with pytest.raises(mp.InputError, match="degree=3"):
        mp.CameraTriangles(np.eye(6)[:, :3], [range(6)], degree=3, **given)
    with pytest.raises(mp.InputError, match="flat triangles"):
        mp.CameraTriangles(np.eye(6)[:, :3], [range(6)], degree=2, ray_scale="plane", **given)
    mesh = mp.builtin_mesh("cube")
    for bound in ("nine_point", "triangle"):
        with pytest.raises(mp.InputError, match="use bound='tight'"):
            mp.rasterize(cams, mesh, bound=bound)
    for mode in ("general_linear", "continuous"):
        with pytest.raises(mp.InputError, match="flat camera triangles"):
            mp.decompose(SURFACES["sphere"], EYE, 20, mode=mode, degree=2)
    with pytest.raises(mp.InputError, match="degree 2 already"):
        quadratic(cams)
    scene = mp.Scene([mesh], mirror=mp.Mirror(SURFACES["sphere"]))
    with pytest.raises(mp.InputError, match="degree 1"):
        mp.Reflection(scene, EYE, method="vertex", cams=cams)
