"""Boxes hold the whole image of a triangle, and are tight: against dense sampling, every model, all three libraries."""

import drjit.llvm as types
import numpy as np
import pytest
from catalog import NAMES, cameras, triangles
from hypothesis import example, given, settings
from hypothesis import strategies as st
from kit import extent

import mpcam as mp
from mpcam.backend import aligned
from mpcam.cameras.outline import outline


def assert_holds(box, low, high, seen, slack):
    bad = seen & (~box.valid | (box.low > low + slack).any(-1) | (box.high < high - slack).any(-1))
    assert not bad.any(), np.flatnonzero(bad)


@pytest.fixture(params=NAMES)
def camera(request):
    return cameras(64)[request.param]


def kernel_outline(camera, corners, kind=np.asarray):
    """What the kernels take, for (N, 3, 3) corners in the camera frame."""
    return outline(camera, *(kind(corners[:, i].T) for i in range(3)))


def test_outlines_hold_every_sampled_point(camera):
    if not hasattr(camera, "local_outline"):
        assert isinstance(camera, (mp.Orthographic, mp.GeneralLinear, mp.SinglePoleOcclusion))
        return
    corners = triangles(500, seed=4)
    low, high, seen = extent(camera, corners)
    found = kernel_outline(camera, corners)
    assert_holds(mp.Box(found.low.T, found.high.T, found.valid), low, high, seen, 1e-9)


LONG = ("scaramuzza", "division")
"""Whose boxes take half a minute to compile: `mpcam stress` has them too."""
BOXES = [
    pytest.param(name, quick, marks=pytest.mark.slow) if name in LONG and not quick else (name, quick)
    for name in NAMES
    for quick in (False, True)
]


@pytest.mark.parametrize("camera, quick", BOXES, indirect=["camera"])
def test_boxes_hold_in_float32_kernels(camera, quick):
    corners = triangles(500, seed=5)
    low, high, seen = extent(camera, corners)
    corner = [types.Array3f(*map(aligned, corners[:, i].T)) for i in range(3)]
    box = outline(camera, *corner) if quick and hasattr(camera, "local_outline") else camera.local_bound(*corner)
    # The kernels widen boxes by more than float32 may move them.
    box = mp.Box(*(np.asarray(array.numpy()) for array in box[:3]))
    assert_holds(mp.Box(box.low.T, box.high.T, box.valid), low, high, seen, 2e-3)


@pytest.mark.parametrize("size", [1e-3, 0.05, 0.3, 1.0])
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize(
    "name", ["paraboloid", "cosine_sphere", "equisolid", "equidistant", "paraboloid 270", "pinhole"]
)
def test_lines_of_outlines_hold_every_sampled_point(name, precision, size):
    """And they are there for small triangles, and touch them."""
    camera, rng = cameras(512)[name], np.random.default_rng(11)
    center = camera.ray(rng.uniform(100, 412, (3000, 1, 2))).direction
    corners = (center + size * rng.normal(size=(3000, 3, 3))).astype(np.float32).astype(np.float64)
    s = np.linspace(0, 1, 65)[:, None]
    edges = np.concatenate([corners[:, [i]] * (1 - s) + corners[:, [(i + 1) % 3]] * s for i in range(3)], 1)
    image = camera.project(edges)
    pixel, valid = image.pixel[..., 0, :], image.valid[..., 0]
    if precision == "float64":
        lines = np.stack([np.stack(line) for line in kernel_outline(camera, corners).lines])
    else:
        found = kernel_outline(camera, corners, lambda p: types.Array3f(*map(aligned, p)))
        lines = np.stack([np.stack([np.asarray(n.numpy()) for n in line]) for line in found.lines]).astype(np.float64)
    known = np.abs(lines[:, :2]).sum((0, 1)) > 0
    distance = np.einsum("kin,npi->nkp", lines[:, :2], pixel) + lines[:, 2].T[..., None]
    distance = np.where(valid[:, None], distance, np.inf)[known]
    assert known.mean() > (0.9 if size < 0.1 else 0.02)
    assert distance.min() > (-1e-9 if precision == "float64" else -2e-3)
    if size < 0.1:
        assert np.median(distance.min(-1)) < 0.5


@settings(max_examples=100, deadline=None)
@example("paraboloid", [0.0, 1.0, -3.4e-283, 1.0, 0.0, 0.0, 1.0, 0.0, -0.0078125], 0.0, 0)  # an edge along the rim
@given(
    st.sampled_from(NAMES),
    st.lists(st.floats(-1, 1), min_size=9, max_size=9),
    st.floats(-6, 3),
    st.integers(0, 2),
)
def test_boxes_hold_for_adversarial_triangles(name, numbers, exponent, copies):
    """Needles, repeated corners, corners at the eye, on the axis, on the horizon and on the camera plane."""
    camera = cameras(64)[name]
    corners = np.array(numbers).reshape(1, 3, 3) * 10.0**exponent
    if copies:
        corners[:, copies] = corners[:, 0]
    low, high, seen = extent(camera, corners)
    low, high = np.clip(low, -1e9, 1e9), np.clip(high, -1e9, 1e9)  # where boxes of pinholes end
    assert_holds(camera.bound(corners), low, high, seen, 1e-6)


@pytest.mark.parametrize("name", ["paraboloid", "cosine_sphere", "equisolid", "equidistant", "user, convex"])
def test_boxes_are_tight_for_triangles_in_view(name):
    """Not more than a tenth of a pixel (of 512) beyond the extreme points of densely sampled edges."""
    camera = cameras(512)[name]
    corners = triangles(500, seed=6)
    corners[..., 2] = np.abs(corners[..., 2]) + 1e-3
    s = np.linspace(0, 1, 2001)[:, None]
    edges = np.concatenate([corners[:, [i]] * (1 - s) + corners[:, [(i + 1) % 3]] * s for i in range(3)], 1)
    pixel = camera.project(edges).pixel[..., 0, :]
    box = camera.bound(corners)
    excess = np.maximum(pixel.min(1) - box.low, box.high - pixel.max(1))
    assert np.percentile(excess, 99) < 0.1
    assert np.median(excess) < 1e-6


@pytest.mark.parametrize("name", ["equisolid 360", "equidistant 270", "paraboloid 270"])
@pytest.mark.parametrize("method", ["local_bound", "outline", "local_bound_quads"])
def test_boxes_hold_edges_that_pass_behind_the_eye(name, method):
    """Near the point behind the eye an image runs half around the rim within a tiny part of an edge."""
    camera = cameras(512)[name]
    corners = triangles(600, seed=8) * [1, 1, 0.3] - [0, 0, 1.0]
    s = np.linspace(0, 1, 1501)[:, None]
    edges = np.concatenate([corners[:, [i]] * (1 - s) + corners[:, [(i + 1) % 3]] * s for i in range(3)], 1)
    image = camera.project(edges)
    pixel, valid = image.pixel[..., 0, :], image.valid[..., 0]
    low = np.where(valid[..., None], pixel, np.inf).min(1)
    high = np.where(valid[..., None], pixel, -np.inf).max(1)
    corner = [np.moveaxis(corners[:, i], -1, 0) for i in range(3)]
    box = outline(camera, *corner) if method == "outline" else getattr(camera, method)(*corner)
    assert_holds(mp.Box(box.low.T, box.high.T, box.valid), low, high, valid.any(1), 1e-6)


@pytest.mark.parametrize("name", ["paraboloid", "cosine_sphere", "equisolid", "equidistant", "narrow"])
def test_quads_hold_every_sampled_point(name):
    """Gascuel et al. 2008, 3.4: looser than the tight boxes, but nothing is missed."""
    camera = cameras(64)[name]
    corners = triangles(500, seed=9)
    low, high, seen = extent(camera, corners)
    assert isinstance(camera, mp.Radial)
    box = camera.local_bound_quads(*(np.moveaxis(corners[:, i], -1, 0) for i in range(3)))
    assert_holds(mp.Box(box.low.T, box.high.T, box.valid), low, high, seen, 1e-9)
    tight = camera.bound(corners)
    assert (box.high - box.low).prod(0)[seen].mean() > (tight.high - tight.low).prod(-1)[seen].mean()


@pytest.mark.parametrize("name", ["paraboloid", "cosine_sphere"])
def test_quads_of_small_triangles_are_small_in_float32(name):
    """Short chords of large circles: their quads must not be lost to cancellation."""
    camera = cameras(512)[name]
    assert isinstance(camera, mp.Radial)
    corners = triangles(500, seed=10)
    corners[..., 2] = np.abs(corners[..., 2]) + 0.1
    corners = corners[:, :1] + 1e-3 * (corners - corners[:, :1])
    box = camera.local_bound_quads(*(types.Array3f(*map(aligned, corners[:, i].T)) for i in range(3)))
    size = (np.asarray(box.high.numpy()) - np.asarray(box.low.numpy())).T
    tight = camera.bound(corners)
    assert (size < 2 * (tight.high - tight.low).max(-1, keepdims=True) + 0.05).all()


def test_a_triangle_around_the_antipode_covers_the_rim():
    camera = mp.Radial.equisolid(64, 64, fov=2 * np.pi)
    box = camera.bound([[-1, -1, -1], [1, -1, -1], [0, 1, -1]])
    assert np.allclose(box.low, 0, atol=1e-6)
    assert np.allclose(box.high, 64, atol=1e-6)


def test_a_triangle_out_of_view_has_no_box():
    camera = mp.Radial.paraboloid(64, 64)
    assert not camera.bound([[-1, -1, -2], [1, -1, -2], [0, 1, -2]]).valid
    assert not mp.Pinhole(64, 64).bound([[-1, -1, -2], [1, -1, -2], [0, 1, -2]]).valid


def test_bad_corners_have_no_box(camera):
    corners = np.full((2, 3, 3), 1.0)
    corners[0, 1, 2], corners[1, 0, 0] = np.nan, np.inf
    box = camera.bound(corners)
    assert not box.valid.any()
    assert np.isfinite(box.low).all()


def test_a_triangle_through_the_eye_may_be_anywhere():
    camera = mp.Radial.paraboloid(64, 64)
    box = camera.bound([[0, 0, 0], [1, 0, 1], [0, 1, 1]])
    assert box.valid
    assert (box.low <= 0.01).all()
    assert (box.high >= 63.9).all()


def test_tiny_triangles_have_tiny_boxes():
    camera = mp.Radial.paraboloid(512, 512)
    corners = np.array([[0.1, 0.1, 1], [0.1 + 1e-7, 0.1, 1], [0.1, 0.1 + 1e-7, 1]])
    box = camera.bound(corners)
    assert box.valid
    assert (box.high - box.low < 0.01).all()
    assert not camera.bound(corners * [1, 1, -1]).valid
