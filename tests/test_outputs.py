"""What frames hold less of: depth or coverage alone, one side of the triangles; and that they cost less."""

import drjit as dr
import numpy as np
import pytest
from catalog import cameras

import mpcam as mp

NAMES = ["paraboloid", "cosine_sphere", "equidistant 270", "pinhole", "orthographic", "kannala_brandt"]


@pytest.fixture(scope="module")
def scene():
    return mp.builtin_mesh("temple")


def placed(camera):
    """The camera where the scene's own is."""
    return camera.with_pose(mp.builtin_scene("temple").camera.camera_from_world)


@pytest.mark.parametrize("name", NAMES)
def test_depth_and_coverage_are_those_of_the_hits(name, scene):
    camera = placed(cameras(96)[name])
    hits = mp.rasterize(camera, scene)
    assert 0.02 < hits.mask.mean()
    depth = mp.depth_map(camera, scene)
    np.testing.assert_array_equal(depth.depth, hits.depth)
    np.testing.assert_array_equal(depth.mask, hits.mask)
    coverage = mp.coverage_map(camera, scene)
    np.testing.assert_array_equal(coverage.mask, hits.mask)
    v, u = np.indices(hits.mask.shape) + 0.5
    valid = camera.ray(np.stack([u, v], -1)).valid
    assert coverage.fraction == pytest.approx(hits.mask.sum() / valid.sum())


@pytest.mark.parametrize("output", ["depth", "coverage"])
def test_large_triangles_too(output):
    """These go through the lists of blocks, which small ones never see."""
    camera, mesh = mp.Radial.paraboloid(200, 160), mp.builtin_mesh("sphere", triangles=80)
    frame = mp.prepare(camera, mesh, output=output).frame()
    hits = mp.rasterize(camera, mesh)
    assert hits.mask.any() and np.array_equal(frame.mask, hits.mask)


@pytest.mark.parametrize("name", NAMES)
def test_culled_sides(name):
    """From outside a closed surface its back is never seen; from inside, nothing else is."""
    camera = cameras(96)[name]
    sphere = mp.builtin_mesh("sphere", triangles=320)
    ahead = mp.Mesh(0.5 * sphere.vertices + [0, 0, 3.0], sphere.faces)
    whole = mp.rasterize(camera, ahead)
    assert whole.mask.any()
    np.testing.assert_array_equal(mp.rasterize(camera, ahead, cull="back").triangle, whole.triangle)
    far_side = mp.rasterize(camera, ahead, cull="front")
    np.testing.assert_array_equal(far_side.mask, whole.mask)
    assert (far_side.depth[whole.mask] > whole.depth[whole.mask]).all()
    if camera.ray_geometry == "central":
        assert not mp.rasterize(camera, sphere, cull="back").mask.any()


@pytest.mark.parametrize("bound", ["triangle", "quad"])
@pytest.mark.parametrize("name", ["paraboloid", "cosine_sphere", "equisolid", "equidistant", "paraboloid 270"])
def test_bounds_of_the_paper_give_the_same_hits(bound, name):
    camera = cameras(128)[name]
    for mesh in (mp.builtin_mesh("facade", triangles=600), mp.builtin_mesh("sphere", triangles=80)):
        expected, found = mp.rasterize(camera, mesh), mp.rasterize(camera, mesh, bound=bound)
        np.testing.assert_array_equal(found.triangle, expected.triangle)
        np.testing.assert_array_equal(found.depth, expected.depth)
        assert found.stats.rendered >= expected.stats.rendered > 0


@pytest.mark.parametrize("projection", ["paraboloid", "cosine_sphere", "equisolid", "equidistant"])
def test_few_tests_are_in_vain(projection):
    """Not more than 0.6 of them for each hit, on the scene that the paper counts on."""
    scene = mp.builtin_scene("facade")
    camera = getattr(mp.Radial, projection)(512, 512, scene.camera.camera_from_world)
    assert mp.rasterize(camera, scene).stats.overdraw < 1.6


def kernels(prepared):
    """Operations of the kernels of a warm frame, and bytes of what it makes."""
    for _ in range(3):
        prepared.frame()
    dr.sync_thread()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        prepared.frame()
        dr.sync_thread()
        history = dr.kernel_history()
    return [entry for entry in history if entry["type"] == dr.KernelType.JIT]


def test_less_output_is_less_work(scene):
    """Depth alone has no triangle numbers, coverage alone no depth; counted on the kernels themselves."""
    camera = placed(mp.Radial.paraboloid(128, 128))
    operations, results = {}, {}
    for output in ("hits", "depth", "coverage"):
        history = kernels(mp.prepare(camera, scene, output=output))
        operations[output] = sum(entry["operation_count"] for entry in history)
        results[output] = history[-1]["output_count"]
    assert operations["coverage"] < operations["depth"] < operations["hits"]
    assert results == {"hits": 2, "depth": 1, "coverage": 1}


def test_shading_is_no_part_of_a_depth_map(scene, monkeypatch):
    from mpcam.rendering import shade

    monkeypatch.setattr(shade, "attributes", lambda mesh: pytest.fail("a depth map looked up attributes"))
    mp.depth_map(placed(mp.Radial.paraboloid(32, 32)), scene)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"output": "color"}, "output='color': allowed are hits, depth, coverage"),
        ({"output": "depth", "method": "raytrace"}, "output='hits' only"),
        ({"cull": "left"}, "cull='left': allowed are none, back, front"),
        ({"cull": "back", "method": "vertex"}, "has no setting 'cull'"),
        ({"bound": "box"}, "allowed are tight, triangle, quad"),
    ],
)
def test_mistakes(scene, arguments, message):
    with pytest.raises(mp.InputError, match=message):
        mp.prepare(mp.Radial.paraboloid(8, 8), scene, **arguments)
