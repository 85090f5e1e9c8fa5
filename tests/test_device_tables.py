"""Tables on the device, worked out once more in a plain way: meshes around their anchor, blocks of pixels."""

import re
from pathlib import Path

import numpy as np
import pytest

import mpcam as mp
from mpcam.backend import aligned, aligned_room
from mpcam.rendering import device
from mpcam.rendering.block_layout import atlas_layout, image_layout


@pytest.mark.parametrize("count", [1, 3, 63, 64, 65, 130, 1000])
@pytest.mark.parametrize("shift", [0.0, 3e5])
def test_vertices_around_the_middle_of_their_box(count, shift):
    rng = np.random.default_rng(count)
    vertices = rng.normal(size=(count, 3)) * (3.0, 1.0, 0.2) + (shift, -1.0, 2.0)
    mesh = mp.Mesh(vertices, rng.integers(0, count, (2 * count, 3)))
    found = device.DeviceMesh(mesh)
    used = vertices[np.unique(mesh.faces)]
    middle, half = 0.5 * (used.min(axis=0) + used.max(axis=0)), 0.5 * float(np.ptp(used, axis=0).max())
    scale = 2.0 ** np.ceil(np.log2(half)) if half > 0 else 1.0
    assert found.scale == scale
    assert np.abs(found.anchor - middle).max() <= scale / 16
    if half > 0:
        assert (found.anchor % (scale / 8) == 0).all()
    expected = ((vertices - found.anchor) / scale).astype(np.float32)
    assert np.array_equal(np.asarray(found.vertices.numpy()).reshape(-1, 3), expected)


def test_vertices_that_are_not_finite_count_for_nothing():
    rng = np.random.default_rng(0)
    vertices = rng.uniform(-1, 1, (200, 3))
    plain = device.DeviceMesh(mp.Mesh(vertices, np.arange(198).reshape(-1, 3)))
    for bad in (np.nan, np.inf, -np.inf):
        spoilt = np.array(vertices)
        spoilt[77, 1] = bad
        found = device.DeviceMesh(mp.Mesh(spoilt, np.arange(198).reshape(-1, 3)))
        assert found.scale == plain.scale
        assert np.array_equal(found.anchor, plain.anchor)


def test_most_vertices_decide_where_some_are_very_far_away():
    rng = np.random.default_rng(1)
    vertices = np.concatenate([rng.uniform(4, 6, (600, 3)), rng.uniform(-1e6, 1e6, (20, 3))])
    found = device.DeviceMesh(mp.Mesh(vertices, np.arange(618).reshape(-1, 3)))
    assert found.reaches_far
    assert 2 <= found.scale <= 16
    assert np.abs(found.anchor - 5).max() < 1
    near = device.DeviceMesh(mp.Mesh(vertices[:600], np.arange(600).reshape(-1, 3)))
    assert not near.reaches_far


def _layouts():
    cap = mp.decompose(mp.Surface.sphere(), (0.0, 0.0, 4.0), 40, resolution=21)
    return {"image": image_layout(75, 41), "triangles": atlas_layout(cap.atlas)}


@pytest.mark.parametrize("name", ["image", "triangles"])
def test_parts_of_blocks_are_those_that_hold_a_pixel(name):
    layout = _layouts()[name]
    expected = np.zeros(layout.blocks, np.uint32)
    for slot in layout.slots[layout.slots >= 0]:
        block, within = divmod(int(slot), 128)
        expected[block] |= np.uint32(1 << (within // 16))
    assert np.array_equal(layout.parts, expected)
    assert (expected != 0).all()
    assert not (expected == 255).all()


def test_no_pixel_is_tested_where_camera_triangles_have_none():
    """With one triangle before all, every run of eight slots that holds a pixel is tested once, and no other."""
    corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    cams = mp.CameraTriangles(corners, [(0, 1, 2), (0, 2, 3)], directions=[(0.0, 0.0, 1.0)] * 4, resolution=21)
    wall = mp.Mesh([(-900.0, -901.0, 9.0), (900.0, -901.0, 9.0), (1.0, 1800.0, 9.0)], [(0, 1, 2)])
    slots = atlas_layout(cams.atlas).slots
    runs = len({slot // 8 for slot in slots.tolist() if slot >= 0})
    assert mp.rasterize(cams, wall).stats.tests == 8 * runs == 576


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint32, bool])
def test_uploads_begin_where_kernels_are_always_the_same(dtype):
    memory = np.arange(5000) % 7
    kept = []
    for shift, shape in enumerate([(1,), (3, 5), (0,), (7, 11, 3), (1000,), (0, 3)] * 4):
        values = memory[shift : shift + int(np.prod(shape))].reshape(shape).T
        kept += [aligned(values, dtype), aligned_room(values.size, dtype)]
        assert np.array_equal(kept[-2], values.ravel().astype(dtype)) and not np.shares_memory(kept[-2], memory)
        assert all(x.ctypes.data % 64 == 0 and x.dtype == dtype and len(x) == values.size for x in kept[-2:] if x.size)


def test_nothing_else_of_numpy_is_uploaded():
    """Kernels differ by the address of what is taken as it is. Tables of few numbers are gathered from, and may be."""
    package = Path(mp.__file__).parent
    upload = re.compile(r"\.(?:Float|Float64|Int|UInt|Bool)\((?:np\.|[^()]*\.(?:astype|ravel)\().*")
    found = [match for path in package.rglob("*.py") for match in upload.findall(path.read_text(encoding="utf-8"))]
    assert found == [".Float(np.array(numbers, np.float32))"]
