"""Two-pass rasterization: error against the patch, no holes, slits, pieces, moving frames."""

import numpy as np
import pytest
from catalog import POSE, first_hits

import mpcam as mp
from mpcam.rendering import two_pass
from mpcam.rendering.registry import METHODS

GL, MANY = mp.GeneralLinear, mp.GeneralLinears
ROOM = mp.builtin_mesh("quad_room")
LOOK = mp.look_at((0.3, -2.0, 1.0), (0.0, 0.0, 0.8))
BALL = mp.builtin_mesh("sphere", triangles=320)


def piecewise(size=48):
    """Many pieces in one image: beside each other, over a grid, over the triangles of a mesh."""
    found = dict(MANY.examples(size, size))
    corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.2], [-1.0, 1.0, -0.1], [1.1, 1.0, 0.1]]
    directions = [[0.1, 0, 1], [-0.3, 0, 1], [0, -0.3, 1], [0.1, 0.2, 1]]
    faces = [[0, 1, 2], [1, 3, 2]]
    found["triangles"] = mp.CameraTriangles(corners, faces, directions=directions, resolution=size, ray_scale="plane")
    return found


def wrong(camera, mesh, patch, method="two_pass"):
    """Share of pixels with another triangle than the exact first hit."""
    exact = mp.rasterize(camera, mesh, "raytrace").triangle
    return (mp.rasterize(camera, mesh, method, patch=patch).triangle != exact).mean()


def terrain(seed=0, side=14):
    """A closed, uneven sheet over the whole view, of triangles of all sizes and shapes."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(-9, 9, side), np.linspace(-9, 9, side))
    shift = rng.uniform(-0.55, 0.55, (2, side, side))
    vertices = np.stack([x + shift[0], y + shift[1], 3 + rng.uniform(-0.4, 0.4, x.shape)], -1).reshape(-1, 3)
    number = np.arange(side * side).reshape(side, side)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    return mp.Mesh(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)]))


def unwelded(mesh):
    """The same triangles, with corners of their own in another order, as seams in textures make them."""
    rng = np.random.default_rng(1)
    corners = np.stack([np.roll(triangle, rng.integers(3), axis=0) for triangle in mesh.corners])
    return mp.Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


@pytest.mark.parametrize("patch", [2, 5, 10, 17])
@pytest.mark.parametrize("kind", ["pushbroom", "cross slit", "bilinear", "twisted orthographic", "pencil"])
def test_there_are_no_holes(kind, patch):
    """Wherever the sheet is all that a pixel can see, it sees it, at every size of the patch."""
    camera = GL.examples(96, 80)[kind]
    sheet = unwelded(terrain())
    whole = mp.rasterize(camera, sheet, "raytrace").mask
    assert whole.all()
    assert mp.rasterize(camera, sheet, "two_pass", patch=patch).mask.all()


def test_error_falls_with_the_square_of_the_patch():
    """Depths, where both see the same: straight edges between samples leave a curve by their length squared."""
    camera = GL.examples(120, 100, LOOK)["pushbroom"]
    exact = mp.rasterize(camera, ROOM)
    errors = []
    for patch in (5, 9, 17, 33):
        hits = mp.rasterize(camera, ROOM, "two_pass", patch=patch)
        same = hits.triangle == exact.triangle
        assert same.mean() > 0.95
        errors.append(np.abs(hits.depth - exact.depth)[same].mean())
    ratios = np.array(errors[:-1]) / errors[1:]
    assert (ratios > 2.8).all() and (ratios < 5.5).all(), ratios


@pytest.mark.parametrize("name", list(GL.examples(8, 8)))
def test_single_cameras_near_brute_force(name):
    """Walls on all sides: triangles cross every slit."""
    camera = GL.examples(56, 44, LOOK)[name]
    hits, (triangle, depth) = mp.rasterize(camera, ROOM, "two_pass", patch=40), first_hits(camera, ROOM)
    same = hits.triangle == triangle
    assert same.mean() > 0.993, same.mean()
    seen = same & (triangle >= 0) & (depth > 0.3)
    assert np.quantile(np.abs(hits.depth / np.where(seen, depth, 1.0) - 1.0)[seen], 0.99) < 0.02


@pytest.mark.parametrize("name", list(piecewise(8)))
def test_pieces_near_brute_force(name):
    camera = piecewise()[name]
    back = np.eye(4)
    back[2, 3] = 1.5  # off the axis of the one that looks around: there a point has no image
    mesh = mp.Mesh.concatenate([terrain(3).transformed(back), BALL.transformed(np.diag([0.6, 0.6, 0.6, 1.0]))])
    hits, (triangle, depth) = mp.rasterize(camera, mesh, "two_pass", patch=12), first_hits(camera, mesh)
    same = hits.triangle == triangle
    assert same.mean() > 0.97, same.mean()
    seen = same & (triangle >= 0) & (depth > 0.3)
    assert np.quantile(np.abs(hits.depth / np.where(seen, depth, 1.0) - 1.0)[seen], 0.98) < 0.03
    assert ((hits.triangle >= 0) == (triangle >= 0)).mean() > 0.98


def test_pairs_in_small_chunks_are_the_same(monkeypatch):
    camera, mesh = piecewise()["around"], terrain(5)
    whole = mp.rasterize(camera, mesh, "two_pass", patch=6)
    monkeypatch.setattr(two_pass, "MOST_PAIRS", 37)
    parts = mp.rasterize(camera, mesh, "two_pass", patch=6)
    assert (whole.triangle == parts.triangle).all() and (whole.depth == parts.depth).all()


def test_weights_are_those_of_the_whole_triangle():
    """Also of triangles that were cut: where the weights say, the ray is."""
    for camera in (GL.examples(64, 48, LOOK)["cross slit in the scene"], MANY.around((0, 0, 0.9), 2.4, 2.0, 90, 40, 7)):
        hits = mp.rasterize(camera, ROOM, "two_pass", patch=60)
        exact = mp.rasterize(camera, ROOM)
        same = (hits.triangle == exact.triangle) & hits.mask & (exact.depth > 0.5)
        assert same.mean() > 0.8
        assert np.abs(hits.barycentric - exact.barycentric)[same].max() < 0.02


@pytest.mark.parametrize(
    "camera",
    [
        mp.Pinhole(60, 44, camera_from_world=LOOK),
        mp.Radial.equidistant(52, 52, fov=4.0, camera_from_world=LOOK),
        mp.Orthographic(60, 44, scale=11.0, camera_from_world=LOOK),
        next(iter(mp.KannalaBrandt.examples(60, 44, LOOK).values())),
    ],
)
def test_other_cameras(camera):
    assert wrong(camera, ROOM, 40) < 0.01


def test_cameras_without_one_image_are_refused():
    for camera in (mp.CameraTriangles.examples(24, 24)["mirror"], mp.Panorama.equirectangular(24, 12)):
        with pytest.raises(mp.InputError, match="two_pass"):
            mp.rasterize(camera, ROOM, "two_pass")
    for patch in (1, 257, 2.5):
        with pytest.raises(mp.InputError, match="patch"):
            mp.rasterize(GL.examples(24, 24)["pencil"], ROOM, "two_pass", patch=patch)
    with pytest.raises(mp.InputError, match="small triangles"):
        mp.rasterize(GL.examples(24, 24)["pencil"], mp.builtin_mesh("sphere", triangles=20480), "two_pass", patch=256)


def test_moving_frames_are_fresh_ones():
    for camera in (GL.examples(48, 40)["cross slit in the scene"], piecewise(40)["around"], mp.Pinhole(40, 30)):
        mesh = terrain(2)
        prepared = mp.prepare(camera, mesh, "two_pass", patch=7)
        prepared.frame()
        rng = np.random.default_rng(4)
        for scale in (1.0, 30.0):
            vertices = scale * (mesh.vertices + rng.normal(0, 0.2, mesh.vertices.shape))
            prepared.update(vertices)
            found = prepared.frame()
            fresh = mp.rasterize(camera, mp.Mesh(vertices, mesh.faces), "two_pass", patch=7)
            assert (found.triangle == fresh.triangle).all() and (found.depth == fresh.depth).all()
            assert (found.barycentric == fresh.barycentric).all()
        turned = camera.with_pose(POSE)
        prepared.aim(turned)
        fresh = mp.rasterize(turned, mp.Mesh(vertices, mesh.faces), "two_pass", patch=7)
        assert (prepared.frame().triangle == fresh.triangle).all()


def test_a_scene_far_from_the_origin_is_the_same():
    """Frames of pieces are put together in float64."""
    camera, mesh = piecewise(40)["around"], terrain(6)
    shift = np.eye(4)
    shift[:3, 3] = (4e5, -3e6, 200.0)
    far = camera.with_pose(camera.camera_from_world @ np.linalg.inv(shift))
    near, away = (
        mp.rasterize(c, m, "two_pass", patch=6).triangle for c, m in ((camera, mesh), (far, mesh.transformed(shift)))
    )
    assert (near != away).mean() < 0.003


def test_comparisons_try_it_where_cameras_are_general_linear():
    usual = METHODS["two_pass"].usual
    assert usual(GL.examples(8, 8)["pencil"]) and usual(piecewise(8)["triangles"]) and usual(piecewise(8)["grid"])
    assert not usual(mp.Pinhole(8, 8)) and not usual(mp.CameraTriangles.examples(24, 24)["direct"])


def test_parallel_rays_see_what_lies_right_before_their_plane():
    """Only where rays meet in it is the plane z = 0 kept away from."""
    camera = GL.orthographic(16, 16, scale=1e4)
    corners = np.array([[-1.0, -1.0, 1e-6], [1.0, -1.0, 1e-6], [0.0, 1.0, 1e-6], [0.0, 0.0, 5.0]])
    mesh = mp.Mesh(corners, [[0, 1, 2], [3, 3, 3]])
    assert mp.rasterize(camera, mesh, "two_pass", patch=5).mask.all()
