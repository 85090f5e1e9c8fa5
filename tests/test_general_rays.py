"""Cameras that give nothing but rays: exact first hits by `invert`, whatever the rays are."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from ray_fields import Field, camera, fields, soup, wrong_pixels

import mpcam as mp
from mpcam.math import cos, isfinite, normalize, sin, vector
from mpcam.rendering.general import GeneralRasterizer

POSE = mp.look_at((0.3, 0.2, -0.4), (1.0, 0.5, 0.2))
LARGE, SMALL = soup(150, 40, 0.8), soup(2000, 41, 0.08)
NAMES = list(fields(2, 2))


@dataclasses.dataclass(frozen=True, eq=False)
class Twisted(mp.Camera):
    """Rays from a square, turned about their middle; written for arrays of any library."""

    width: int
    height: int
    camera_from_world: Any = None
    twist: Any = 0.3

    def local_ray(self, pixel):
        u, v = pixel
        x, y = 2 * u / self.width - 1, 2 * v / self.height - 1
        way = vector(0.5 * x - self.twist * y, 0.5 * y + self.twist * x, 0 * x + 1)
        return mp.Ray(vector(x, y, 0 * x - 2), normalize(way), isfinite(x + y))


@dataclasses.dataclass(frozen=True, eq=False)
class Eye(mp.Camera):
    """Rays from one point that is not the frame's origin; the model does not say that it has a center."""

    width: int
    height: int
    camera_from_world: Any = None

    def local_ray(self, pixel):
        u, v = pixel
        a, b = 2 * u / self.width - 1, v / self.height - 0.5
        way = vector(cos(b) * sin(a), sin(b), cos(b) * cos(a))
        return mp.Ray(vector(0 * a + 0.25, 0 * a - 0.5, 0 * a - 3), way, isfinite(a + b))


@pytest.mark.parametrize("name", NAMES)
def test_all_fields_of_rays_are_exact(name):
    for size, mesh, pose in (((70, 33), LARGE, None), ((37, 50), SMALL, POSE)):
        field = fields(*size)[name]
        given = camera(field, pose)
        hits = mp.rasterize(given, mesh)
        assert wrong_pixels(given, mesh, hits) == 0
        assert np.array_equal(mp.depth_map(given, mesh).depth, hits.depth)
        assert np.array_equal(mp.coverage_map(given, mesh).mask, hits.mask)
        assert hits.mask.any() == (name != "no ray at all")


def test_the_judge_notices():
    given = camera(fields(70, 33)["twisted"])
    hits = mp.rasterize(given, LARGE)
    shifted = mp.rasterize(given, LARGE.transformed(np.diag([1.05, 1.05, 1.05, 1.0])))
    assert wrong_pixels(given, LARGE, shifted) > 100
    assert wrong_pixels(given, LARGE, hits) == 0


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (17, 1), (130, 9)])
def test_images_of_any_size(size):
    for name in ("panorama", "twisted"):
        given = camera(fields(*size)[name])
        assert wrong_pixels(given, SMALL, mp.rasterize(given, SMALL)) == 0


@pytest.mark.parametrize("model", [Twisted, Eye])
def test_arrays_of_the_device_and_of_numpy_give_the_same_frame(model):
    given = model(60, 44, POSE)
    pixel = np.stack(np.meshgrid(np.arange(60) + 0.5, np.arange(44) + 0.5), -1)
    ray = given.with_pose(None).ray(pixel)
    other = Field(60, 44, *map(np.asarray, ray), camera_from_world=POSE)
    hits, same = mp.rasterize(given, LARGE), mp.rasterize(other, LARGE)
    assert wrong_pixels(other, LARGE, hits) == 0
    assert (hits.triangle != same.triangle).sum() <= 3
    assert (hits.triangle != mp.rasterize(given, LARGE, method="raytrace").triangle).sum() <= 3


def test_a_common_center_is_found():
    views = {name: camera(fields(20, 20)[name]) for name in ("panorama elsewhere", "folded")}
    kinds = {name: GeneralRasterizer(view, SMALL).rays.kind for name, view in views.items()}
    assert kinds == {"panorama elsewhere": "central", "folded": "general"}
    assert GeneralRasterizer(Eye(20, 20), SMALL).rays.kind == "central"
    assert GeneralRasterizer(Twisted(20, 20), SMALL).rays.kind == "general"


@pytest.mark.parametrize("model", [Twisted, Eye])
def test_sides(model):
    """Of a closed surface seen from outside only fronts show, and without them the backs behind."""
    given, sphere = model(80, 60), mp.builtin_mesh("sphere", triangles=1280)
    whole, front, back = (mp.rasterize(given, sphere, cull=cull) for cull in ("none", "back", "front"))
    assert np.array_equal(whole.triangle, front.triangle) and whole.mask.any()
    assert (back.depth[back.mask] > front.depth[back.mask]).all()
    assert back.mask.sum() > 0.9 * front.mask.sum()
    assert front.stats.rendered + back.stats.rendered == whole.stats.rendered
    turned = dataclasses.replace(sphere, faces=sphere.faces[:, ::-1])
    assert np.array_equal(mp.rasterize(given, turned, cull="front").mask, front.mask)


def test_another_pose_needs_no_other_rays():
    prepared = GeneralRasterizer(Twisted(64, 48, POSE), SMALL)
    rays, moved = prepared.rays.blocks, Twisted(64, 48, mp.look_at((0, 1, -2), (0, 0, 0)))
    prepared.aim(moved)
    assert prepared.rays.blocks is rays
    assert np.array_equal(prepared.frame().triangle, mp.rasterize(moved, SMALL).triangle)


def test_large_arrays_are_told_apart():
    field = fields(40, 30)["twisted"]
    first = mp.rasterize(camera(field), LARGE)
    other = camera((field[0], -field[1], field[2]))
    assert wrong_pixels(other, LARGE, mp.rasterize(other, LARGE)) == 0
    assert np.array_equal(mp.rasterize(camera(field), LARGE).triangle, first.triangle)


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_scenes_of_any_size(scale):
    """A scene and its rays a hundred million times as large, far from the origin, look the same."""
    for name in ("twisted", "panorama elsewhere"):
        origins, directions, valid = fields(50, 40)[name]
        plain = mp.rasterize(camera((origins, directions, valid)), LARGE)
        pose = np.eye(4)
        pose[:3, 3] = scale * np.array([300.0, -20.0, 70.0])
        moved = LARGE.transformed(np.linalg.inv(pose) @ np.diag([scale, scale, scale, 1.0]))
        hits = mp.rasterize(camera((scale * origins, directions, valid), pose), moved)
        assert (hits.triangle != plain.triangle).sum() <= 4
        both = hits.mask & (hits.triangle == plain.triangle)
        assert np.allclose(hits.depth[both], scale * plain.depth[both], rtol=1e-3)


@pytest.mark.parametrize("far", [100.0, 1000.0])
def test_distant_eyes_miss_nothing(far):
    """The cones of nearly parallel rays, far from their origins."""
    sphere = mp.builtin_mesh("sphere", triangles=5120)
    pose = mp.look_at(far * np.array([0.6, 0.64, 0.48]), (0, 0, 0))
    a, b = np.meshgrid(np.linspace(-1, 1, 96), np.linspace(-1, 1, 96))
    for width in (1.2, 0.05):
        way = np.stack([a * width / far, b * width / far, np.ones_like(a)], -1)
        way /= np.linalg.norm(way, axis=-1, keepdims=True)
        for origins in (0 * way, 1e-3 * np.stack([b, a, 0 * a], -1)):
            given = Field(96, 96, origins, way, np.ones(a.shape, bool), camera_from_world=pose)
            hits, truth = mp.rasterize(given, sphere), mp.rasterize(given, sphere, method="raytrace")
            assert (hits.mask == truth.mask).mean() > 0.999
            assert not (truth.mask & ~hits.mask)[20:-20, 20:-20].any()


def test_chunks_give_the_same_frame(monkeypatch):
    from mpcam.rendering import general
    from mpcam_kernels import block_pipeline, candidates

    views = [camera(fields(150, 90)[name]) for name in ("twisted", "panorama")]
    whole = [mp.rasterize(view, SMALL).triangle for view in views]
    small = {"ROOM": 500, "SPLIT": 300, "LONG_LIST": 0}
    for walking in (0, 1 << 20):
        general._pipeline.cache_clear()
        with monkeypatch.context() as patch:
            for name, value in (*small.items(), ("PIXELS_PER_TRIANGLE", walking)):
                patch.setattr(block_pipeline, name, value)
            patch.setattr(candidates, "THREADS", 700)
            patch.setattr(candidates, "FEW", 50)
            for view, triangle in zip(views, whole, strict=True):
                assert np.array_equal(mp.rasterize(view, SMALL).triangle, triangle)
    general._pipeline.cache_clear()


def test_what_a_camera_lacks_is_named():
    given = Twisted(8, 8)
    with pytest.raises(mp.InputError, match=r"project\(\) needs images of points \(local_project\), which Twisted"):
        given.project(np.zeros(3))
    with pytest.raises(mp.InputError, match=r"bound\(\) needs boxes .* which Twisted does not have"):
        given.bound(np.zeros((3, 3)))
    with pytest.raises(mp.InputError, match="bound='nine_point' is for camera triangles, not for a Twisted"):
        mp.rasterize(given, SMALL, bound="nine_point")

    @dataclasses.dataclass(frozen=True, eq=False)
    class Blind(mp.Camera):
        width: int
        height: int
        camera_from_world: Any = None

    with pytest.raises(mp.InputError, match=r"needs rays of pixels \(local_ray\), which Blind does not have"):
        mp.rasterize(Blind(8, 8), SMALL)
    with pytest.raises(mp.InputError, match=r"width=0"):
        Twisted(0, 8)


def test_rays_of_the_wrong_shape_are_named():
    class Wrong(Field):
        def local_ray(self, pixel):
            return mp.Ray(np.zeros((3, 5)), np.ones((3, 5)), np.ones(5, bool))

    with pytest.raises(mp.InputError, match=r"Wrong.local_ray gives no rays of 64 pixels"):
        mp.rasterize(Wrong(8, 8), SMALL)


def test_an_own_camera_is_a_pytree():
    import jax

    class Other(Twisted):
        pass

    for model in (Twisted, Other):
        leaves, tree = jax.tree_util.tree_flatten(model(8, 8, POSE, 0.25))
        assert len(leaves) == 2
        assert jax.tree_util.tree_unflatten(tree, leaves).twist == 0.25


VIEWS = {
    "invert": (mp.Radial.paraboloid(40, 30, POSE), mp.Pinhole(40, 30)),
    "invert, parallel": (mp.Orthographic(40, 30, camera_from_world=POSE), mp.Orthographic(40, 30, 4.0)),
    "invert, any rays": (Twisted(40, 30, POSE), Eye(30, 40)),
    "vertex": (mp.Radial.paraboloid(40, 30, POSE), mp.Orthographic(50, 30)),
    "cubemap": (mp.Radial.paraboloid(40, 30, POSE), mp.Pinhole(30, 30)),
    "hemicube": (mp.Radial.paraboloid(40, 30, POSE), mp.Radial.equisolid(30, 40)),
    "raytrace": (mp.Radial.paraboloid(40, 30, POSE), Twisted(40, 30)),
}


@pytest.mark.parametrize("name", list(VIEWS))
def test_every_method_aims(name):
    """Another camera gives what a fresh frame of it gives, to the bit."""
    first, second = VIEWS[name]
    method = name.partition(",")[0]
    prepared = mp.prepare(first, LARGE, method)
    before = prepared.frame().triangle
    prepared.aim(second)
    frame, fresh = prepared.frame(), mp.rasterize(second, LARGE, method)
    assert np.array_equal(frame.triangle, fresh.triangle) and np.array_equal(frame.depth, fresh.depth)
    assert np.array_equal(frame.barycentric, fresh.barycentric)
    prepared.aim(first)
    assert np.array_equal(prepared.frame().triangle, before)


def test_what_cannot_be_aimed_says_so():
    prepared = mp.prepare(mp.Radial.paraboloid(20, 20), LARGE)
    with pytest.raises(mp.InputError, match="which Twisted does not have: prepare anew"):
        prepared.aim(Twisted(20, 20))
    with pytest.raises(mp.InputError, match="method='vertex' needs images of points"):
        mp.rasterize(Twisted(20, 20), LARGE, "vertex")
