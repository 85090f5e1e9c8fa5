"""Cameras whose rays bend: exact first hits by `invert`, traced piece by piece as the truth, and all that is made of
them.
"""

import dataclasses

import numpy as np
import pytest
from bent_cameras import Kinked, Polyline, first_of_bent, polylines, wrong_pixels
from ray_fields import soup

import mpcam as mp
from mpcam.cameras.types import RayPieces
from mpcam.rendering import seams
from mpcam.rendering.general import GeneralRasterizer

POSE = mp.look_at((0.3, 0.2, -2.4), (0.1, 0.1, 0.2))
LARGE, SMALL = soup(120, 40, 0.8), soup(1200, 41, 0.08)


def kinked(width: int = 70, height: int = 33, pose: np.ndarray = POSE, **fields: float) -> Kinked:
    """With both bends in the midst of the soup."""
    return Kinked(width, height, pose, **{"bend": 2.0, "far": 2.7} | fields)


def needles() -> mp.Mesh:
    """Long thin triangles to and fro across the bend planes of `kinked`."""
    rng = np.random.default_rng(5)
    center = rng.uniform([-1, -1, 1.5], [1, 1, 3.5], (300, 3))
    along, across = rng.normal(size=(2, 300, 3)) * [[[0.3, 0.3, 1.0]], [[0.02, 0.02, 0.02]]]
    corners = np.stack([center - along, center + along, center + across], 1)
    return mp.Mesh(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3)).transformed(np.linalg.inv(POSE))


VIEWS = {
    "kinked": lambda: kinked(),
    "kinked, posed elsewhere": lambda: kinked(37, 50, mp.look_at((0.0, -2.5, 0.3), (0.1, 0.0, 0.1)), slope=2.0),
    "turned about": lambda: kinked(slope=-0.4, aside=-0.5),
    "four pieces": lambda: polylines(60, 41, 4, 1),
    "seven pieces, posed": lambda: polylines(33, 50, 7, 4, mp.look_at((0.5, 0.4, -0.2), (0.5, 0.3, 1.0))),
}


@pytest.mark.parametrize("name", VIEWS)
def test_first_hits_are_exact(name):
    view = VIEWS[name]()
    for mesh in (LARGE, SMALL, needles()):
        hits = mp.rasterize(view, mesh)
        assert hits.mask.mean() > 0.01
        assert wrong_pixels(view, mesh, hits) == 0
        assert np.array_equal(mp.depth_map(view, mesh).depth, hits.depth)
        assert np.array_equal(mp.coverage_map(view, mesh).mask, hits.mask)
        traced = mp.rasterize(view, mesh, method="raytrace")
        assert wrong_pixels(view, mesh, traced) == 0
        same = hits.mask & (hits.triangle == traced.triangle)
        assert (hits.triangle != traced.triangle).sum() <= 3
        assert np.allclose(hits.depth[same], traced.depth[same], rtol=1e-4, atol=1e-5)
        assert np.abs(hits.barycentric - traced.barycentric)[same].max() < 2e-3


def test_every_piece_sees_something_and_the_judge_notices():
    for view in (kinked(), polylines(60, 41, 4, 1)):
        hits = mp.rasterize(view, LARGE)
        depths, insides = first_of_bent(view, LARGE)
        near = np.abs(depths - np.where(hits.mask, hits.depth, -1.0).reshape(-1, 1, 1)) < 1e-3
        by_piece = (near & (insides > 1e-3)).any(-1).sum(0)
        assert (by_piece[-3:] > 10).all()
        for fields in ({"bend": 2.02}, {"aside": 0.32}, {"far": 2.75}):
            if isinstance(view, Kinked):
                other = mp.rasterize(dataclasses.replace(view, **fields), LARGE)
                assert wrong_pixels(view, LARGE, other) > 20


@pytest.mark.parametrize("shift", [0.0, 3e-8, -3e-8])
@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_a_wall_through_the_bend_has_no_hole(shift, tilt):
    """Surfaces in the very plane where rays bend, or across it at a small angle, are seen by every pixel."""
    pose = mp.look_at((0.4, -0.3, -1.7), (0.1, 0.2, 0.3))
    view = kinked(120, 90, pose, slope=-0.2, aside=0.4)
    x, y = np.meshgrid(np.linspace(-5, 5, 12), np.linspace(-5, 5, 12))
    for plane in (view.bend, view.far):
        wall = np.stack([x, y, plane * (1 + shift) + tilt * x], -1).reshape(-1, 3)
        corner = (np.arange(11)[:, None] * 12 + np.arange(11)).ravel()
        faces = np.concatenate([corner[:, None] + [0, 1, 12], corner[:, None] + [1, 13, 12]])
        mesh = mp.Mesh(wall, faces).transformed(np.linalg.inv(pose))
        hits = mp.rasterize(view, mesh)
        assert hits.mask.all()
        traced = mp.rasterize(view, mesh, method="raytrace")
        weights = np.concatenate([hits.barycentric, 1 - hits.barycentric.sum(-1, keepdims=True)], -1)
        assert weights[~traced.mask].min(-1).max(initial=0.0) < 1e-6  # Embree leaks at edges, bend or not
        image = view.project(hits.points)
        assert np.abs(image.depth[..., 0] / hits.depth - 1).max() < 1e-5


def test_depth_is_continuous_across_bends():
    """Over a plane that cuts through both bends depths change no faster than rays spread, and are what project says."""
    view = kinked(160, 120, aside=0.1)
    plane = mp.Mesh([[-9.0, 0.7, 0.5], [9.0, 0.7, 0.5], [0.0, 0.7, 30.0]], [[0, 1, 2]])
    mesh = plane.transformed(np.linalg.inv(POSE))
    hits = mp.rasterize(view, mesh)
    image = view.project(hits.points)
    centers = np.stack(np.meshgrid(np.arange(160) + 0.5, np.arange(120) + 0.5), -1)
    assert hits.mask.sum() > 3000
    assert np.abs(image.pixel[..., 0, :] - centers)[hits.mask].max() < 2e-2
    assert np.abs(image.depth[..., 0] / hits.depth - 1)[hits.mask].max() < 1e-5
    bends = np.array([view.with_pose(None).ray_pieces([80.5, v]).start[1:] for v in centers[:, 0, 1]])
    crossed = [np.flatnonzero(np.diff(np.sign(hits.depth[:, 80] - bends[:, k]))) for k in range(2)]
    assert all(len(rows) for rows in crossed)


def test_directions_at_hits_are_those_of_the_piece():
    """Rays that turn back see the other side of things: normals are turned to where they come from."""
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [3.0, 0.0, 4.0]])
    width, height = 40, 30
    a, b = np.meshgrid(np.linspace(-0.1, 0.1, width), np.linspace(-0.1, 0.1, height))
    bends = points + np.stack([a, b, 0 * a], -1)[:, :, None]
    ways = np.broadcast_to([0.0, 0.0, -1.0], (height, width, 3))
    view = Polyline(width, height, bends, np.full((height, width), 2), ways)
    back = mp.Mesh([[-9.0, -9.0, 2.0], [9.0, -9.0, 2.0], [3.0, 30.0, 2.0]], [[0, 1, 2]])
    side = mp.Mesh([[1.0, -9.0, -9.0], [1.0, 9.0, -9.0], [1.0, 0.0, 30.0]], [[0, 1, 2]])
    behind = mp.Mesh([[2.0, -9.0, 1.0], [9.0, -9.0, 1.0], [3.0, 30.0, 1.0]], [[0, 1, 2]])
    for mesh, depth, normal in ((back, 2.0, [0, 0, -1]), (side, 5.0, [-1, 0, 0]), (behind, 10.0, [0, 0, 1])):
        for method in ("invert", "raytrace"):
            hits = mp.rasterize(view, mesh, method=method)
            assert hits.mask.all()
            assert np.allclose(hits.depth, depth, atol=0.21)
            assert np.allclose(2 * mp.shade(hits, mesh, "normal") - 1, normal, atol=1e-5)
            ray, pose = hits.view.ray, hits.view.pose
            along = np.asarray(ray.origin.numpy()) + hits.depth.ravel() * np.asarray(ray.direction.numpy())
            world = along.T @ pose[:3, :3] - pose[:3, :3].T @ pose[:3, 3]
            assert np.allclose(world.reshape(height, width, 3), hits.points, atol=1e-5)


def test_what_leaves_the_scene_looks_along_its_last_piece():
    sky = mp.EnvironmentMap.from_panorama(np.linspace(0, 1, 32 * 64 * 3).reshape(32, 64, 3) ** 2)
    view = polylines(60, 41, 4, 1)
    scene = mp.Scene(mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), environment=sky)
    image = mp.shade(mp.rasterize(view, scene), scene)
    pieces = view.ray_pieces(np.stack(np.meshgrid(np.arange(60) + 0.5, np.arange(41) + 0.5), -1))
    last = np.where(pieces.valid.any(-1), pieces.valid.shape[-1] - 1 - pieces.valid[..., ::-1].argmax(-1), 0)
    way = np.take_along_axis(pieces.direction, last[..., None, None], 2)[:, :, 0]
    usable = pieces.valid.any(-1)
    assert np.abs(image - sky.lookup(way))[usable].max() < 0.05
    assert 0 < usable.mean() < 1


def test_sides():
    view, sphere = kinked(), mp.builtin_mesh("sphere", triangles=1280)
    whole, front, back = (mp.rasterize(view, sphere, cull=cull) for cull in ("none", "back", "front"))
    assert np.array_equal(whole.triangle, front.triangle) and whole.mask.any()
    assert (back.depth[back.mask] > front.depth[back.mask]).all() and back.mask.any()
    assert front.stats.rendered + back.stats.rendered == whole.stats.rendered


def test_moving_and_aiming_are_as_good_as_fresh():
    view, other = kinked(), polylines(60, 41, 4, 1)
    shifted = SMALL.vertices @ mp.look_at((0, 0, 0), (0.2, 0.1, 1.0))[:3, :3] + 0.05
    moved = mp.Mesh(shifted, SMALL.faces)
    for method in ("invert", "raytrace"):
        ready = mp.prepare(view, SMALL, method)
        ready.frame()
        ready.update(shifted)
        for aimed in (view, view.with_pose(mp.look_at((1.5, -1.5, 0.3), (0, 0, 0))), other, view):
            ready.aim(aimed)
            fresh, frame = mp.rasterize(aimed, moved, method=method), ready.frame()
            for name in ("triangle", "depth", "barycentric"):
                assert np.array_equal(getattr(frame, name), getattr(fresh, name)), (method, name)
        assert set(ready.stages()) == {step.name for step in ready.explain()}


def test_another_pose_needs_no_other_pieces():
    ready = GeneralRasterizer(kinked(), SMALL)
    blocks = ready.rays.blocks
    ready.aim(kinked(pose=mp.look_at((0, 1, -2), (0, 0, 0))))
    assert ready.rays.blocks is blocks


def test_chunks_give_the_same_frame(monkeypatch):
    from mpcam.rendering import general, pixel_pieces, traced_rays
    from mpcam_kernels import block_pipeline, candidates

    whole = mp.rasterize(polylines(150, 90, 4, 1), SMALL).triangle
    traced = mp.rasterize(kinked(), SMALL, method="raytrace").depth
    general._pipeline.cache_clear()
    with monkeypatch.context() as patch:
        for name, value in {"ROOM": 5000, "SPLIT": 3000, "LONG_LIST": 0, "PIXELS_PER_TRIANGLE": 1 << 20}.items():
            patch.setattr(block_pipeline, name, value)
        for module in (pixel_pieces, traced_rays):
            patch.setattr(module, "CHUNK", 700)
        patch.setattr(candidates, "FEW", 50)
        assert np.array_equal(mp.rasterize(polylines(150, 90, 4, 1), SMALL).triangle, whole)
        assert np.array_equal(mp.rasterize(kinked(), SMALL, method="raytrace").depth, traced)
    general._pipeline.cache_clear()


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (17, 1), (130, 9)])
def test_images_of_any_size(size):
    for view in (kinked(*size), polylines(*size, 4, 1)):
        assert wrong_pixels(view, SMALL, mp.rasterize(view, SMALL)) == 0


def test_cameras_without_a_ray_and_scenes_without_a_triangle():
    class Blind(Kinked):
        def local_ray_pieces(self, pixel):
            return tuple(piece._replace(valid=piece.valid & False) for piece in Kinked.local_ray_pieces(self, pixel))

    class Closed(Kinked):
        """Nothing but the first and the last piece."""

        def local_ray_pieces(self, pixel):
            first, middle, last = Kinked.local_ray_pieces(self, pixel)
            return first, middle._replace(valid=middle.valid & False), last

    for method in ("invert", "raytrace"):
        for view in (Blind(70, 33, POSE, bend=2.0), kinked()):
            mesh = SMALL if isinstance(view, Blind) else mp.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
            hits = mp.rasterize(view, mesh, method=method)
            assert not hits.mask.any() and np.isinf(hits.depth).all() and not hits.barycentric.any()
            assert mp.shade(hits, mesh).shape == (33, 70, 3)
    assert mp.coverage_map(Blind(9, 9, POSE), SMALL).fraction == 0.0
    assert mp.rasterize(Blind(9, 9, POSE), SMALL).stats.tests == 0
    closed = Closed(70, 33, POSE, bend=2.0, far=2.7)
    assert wrong_pixels(closed, LARGE, mp.rasterize(closed, LARGE)) == 0
    assert mp.coverage_map(kinked(), LARGE).fraction == pytest.approx(mp.rasterize(kinked(), LARGE).mask.mean())


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_scenes_of_any_size(scale):
    """A scene and its camera a hundred million times as large, far from the origin, look the same."""
    place = np.array([3.0, -2.0, 7.0])
    pose = np.array(POSE)
    pose[:3, 3] = scale * (POSE[:3, 3] - POSE[:3, :3] @ place)
    view = kinked(pose=pose, bend=2.0 * scale, far=2.7 * scale)
    expected = mp.rasterize(kinked(), LARGE)
    for method in ("invert", "raytrace"):
        hits = mp.rasterize(view, mp.Mesh(scale * (LARGE.vertices + place), LARGE.faces), method=method)
        assert (hits.triangle != expected.triangle).sum() <= 4
        both = hits.mask & (hits.triangle == expected.triangle)
        assert np.allclose(hits.depth[both], scale * expected.depth[both], rtol=1e-4)


def test_blocks_are_split_where_rays_jump(monkeypatch):
    """Pixels to both sides of a seam lie in different blocks, so that few triangles are tested in vain."""

    class Halves(Kinked):
        def local_ray_pieces(self, pixel):
            left, right = (
                Kinked.local_ray_pieces(dataclasses.replace(self, aside=sign * self.aside), pixel) for sign in (1, -1)
            )
            side = pixel[0] < 61
            return tuple(
                RayPieces(*(np.where(side, x, y) for x, y in zip(a, b, strict=True)))
                for a, b in zip(left, right, strict=True)
            )

    small = Halves(130, 32, POSE, bend=2.0, far=2.7, aside=1.0)
    assert wrong_pixels(small, LARGE, mp.rasterize(small, LARGE)) == 0
    mesh = mp.builtin_mesh("sphere", triangles=5120)
    split = mp.rasterize(Halves(130, 64, POSE, bend=2.0, far=2.7, aside=1.0), mesh)
    monkeypatch.setattr(seams, "JUMP", 1e9)
    mixed = mp.rasterize(Halves(130, 64, POSE, bend=2.0, far=2.7, aside=1.0 + 1e-12), mesh)
    assert (split.triangle != mixed.triangle).sum() <= 2
    assert split.stats.tests < 0.2 * mixed.stats.tests


def test_approximations_come_closer_with_their_knobs():
    view = kinked(160, 120)
    mesh = mp.builtin_mesh("sphere", triangles=1280)
    truth = mp.rasterize(view, mesh, method="raytrace")

    def error(method: str, **settings: int) -> float:
        hits = mp.rasterize(view, mesh, method=method, **settings)
        both = hits.mask & truth.mask
        assert (hits.mask != truth.mask).mean() < 0.01
        return float(np.abs(hits.depth[both] - truth.depth[both]).mean())

    coarse, fine = error("vertex"), error("vertex", level=3)
    assert fine < 0.1 * coarse and error("two_pass", patch=40) < 0.5 * error("two_pass", patch=5)


def test_comparisons_and_pictures():
    scene = mp.Scene(mp.builtin_mesh("sphere", triangles=320))
    view = kinked(64, 48)
    table = mp.compare(scene, camera=view, repeats=1)
    rows = {row.method: row for row in table.rows}
    assert {"invert", "vertex", "raytrace"} <= set(rows) and not {"cubemap", "hemicube"} & set(rows)
    assert rows["invert"].hit_mismatch < 0.1 and rows["invert"].depth_p999 < 1e-4
    assert rows["vertex"].depth_p999 > rows["invert"].depth_p999
    image = mp.render(view, scene)
    traced = mp.shade(mp.rasterize(view, scene, method="raytrace"), scene)
    assert np.abs(np.asarray(image) - traced).max() < 0.02


def test_what_does_not_apply_is_refused():
    view = kinked(8, 8)
    for method in ("cubemap", "hemicube"):
        with pytest.raises(mp.InputError, match="needs a camera with one center, not Kinked"):
            mp.rasterize(view, SMALL, method=method)
    with pytest.raises(mp.InputError, match=r"rays of a Kinked bend.*method='raytrace'"):
        mp.truth.sensor(view)
    with pytest.raises(mp.InputError, match=r"rays of a Kinked bend.*one straight ray a pixel"):
        mp.RayMap.of(view)
    with pytest.raises(mp.InputError, match="bound='quad'"):
        mp.rasterize(view, SMALL, bound="quad")

    class Central(Kinked):
        ray_geometry = "central"

    with pytest.raises(mp.InputError, match="rays of a Central bend, but its ray_geometry is 'central'"):
        mp.rasterize(Central(8, 8), SMALL)

    class Wrong(Kinked):
        def local_ray_pieces(self, pixel):
            return (RayPieces(np.zeros((3, 5)), np.ones((3, 5)), 0.0, 1.0, True),)

    with pytest.raises(mp.InputError, match=r"Wrong.local_ray_pieces gives no pieces of rays of 64 pixels"):
        mp.rasterize(Wrong(8, 8), SMALL)
