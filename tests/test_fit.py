"""Fits of camera triangles and of general linear cameras, against differences, other solvers and their own truth."""

import dataclasses
from typing import Any

import jax
import numpy as np
import pytest

import mpcam as mp
from mpcam.decomposition.ray_error import in_world
from mpcam.decomposition.reflector import reflector_of
from mpcam.fitting import blocks
from mpcam.fitting.frames import fixed_parts, frames_of
from mpcam.fitting.samples import split_samples
from mpcam.fitting.state import padded, state_of, thinned

SPHERE, WAVE = mp.Surface.sphere(1.0), mp.Surface.wave()
EYE = mp.Pinhole(97, 71, 90, 92, 48, 36, camera_from_world=mp.look_at((3, 1, 2.5), (0, 0, 0)))
COMPILED: Any = (blocks.assembled, blocks.placed, blocks.stepped)
SMALL: Any = {"samples": 1500, "iterations": 12}


@pytest.fixture(scope="module")
def start():
    return mp.decompose(SPHERE, EYE, 40)


@pytest.fixture(scope="module")
def fitted(start):
    seen = []
    result = mp.fit(start, reflector=SPHERE, eye=EYE, **SMALL, progress=seen.append)
    assert tuple(seen) == result.history
    return result


def cosines(cams):
    """Between faces and normals at their corners, worst of each."""
    corners = cams.vertices[cams.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return (flat[:, None] * cams.normals[cams.faces]).sum(-1).min(axis=1)


def test_a_fit_is_much_better_where_it_was_not_fitted(start, fitted):
    assert fitted.gain > 3.5 and fitted.overfit < 1.3
    assert fitted.status in ("converged", "budget")
    radius = reflector_of(SPHERE).radius
    for distance, gain in ((0.5, 3), (2.0, 3.5), (20.0, 2)):
        before, after = (mp.ray_error(c, SPHERE, EYE, distance=distance * radius) for c in (start, fitted.camera))
        assert after.rms * gain < before.rms and after.missed == 0
    assert (cosines(fitted.camera) > 0).all()
    assert (fitted.camera.faces == start.faces).all()
    assert np.ptp(np.linalg.norm(fitted.camera.normals, axis=1)) > 0.05
    errors = [step.error for step in fitted.history]
    assert errors[-1] < 0.35 and fitted.history[0].stage == "rays" and fitted.history[-1].stage == "all"


def test_fits_are_the_same_again_compile_nothing_and_leave_jax_alone(start, fitted):
    def compiled():
        return [function._cache_size() for function in COMPILED]

    before = compiled()
    again = mp.fit(start, reflector=SPHERE, eye=EYE, **SMALL)
    assert (again.camera.vertices == fitted.camera.vertices).all() and again.history == fitted.history
    like = mp.decompose(SPHERE, EYE, 44)  # another number of triangles, vertices and samples, padded to the same
    mp.fit(like, reflector=SPHERE, eye=EYE, **SMALL)
    assert before == compiled()
    assert jax.numpy.ones(1).dtype == np.float32
    other = mp.fit(start, reflector=SPHERE, eye=EYE, **SMALL, seed=1)
    assert (other.camera.vertices != again.camera.vertices).any() and other.gain > 3


def test_padding():
    assert [padded(n) for n in (0, 16, 17, 25, 33, 49, 1000)] == [16, 16, 24, 32, 48, 64, 1024]


def test_thinned_samples_stand_for_all():
    rng = np.random.default_rng(0)
    face = rng.integers(0, 20, 3000) ** 2 // 20
    for most in (100, 500, 2999, 5000):
        rows, weights = thinned(face, 25, most)
        assert len(rows) <= max(most, 25) and len(np.unique(rows)) == len(rows)
        assert np.allclose(np.bincount(face[rows], weights, 25), np.bincount(face, minlength=25) / 3000)
        counts = np.bincount(face[rows], minlength=25)
        assert counts[counts > 0].min() == min(counts.max(), np.bincount(face)[np.bincount(face) > 0].min())


def test_held_out_pixels_are_not_fitted():
    whole = reflector_of(WAVE)
    parts = split_samples(whole, EYE, 3000, 800, 0)
    pixels = [set(map(tuple, np.floor(np.asarray(EYE.project(p.points).pixel).reshape(-1, 2)))) for p in parts]
    assert min(map(len, pixels)) > 100 and not pixels[0] & pixels[1]
    assert len(parts.fitted.points) > 2500
    point = split_samples(whole, (3.0, 1.0, 2.5), 3000, 800, 0)
    assert not set(map(tuple, point.fitted.points)) & set(map(tuple, point.held_out.points))


@pytest.mark.parametrize("kind", ["reflection", "refraction", "direct", "quadratic"])
def test_slopes_are_those_of_the_cost(kind):
    """Against central differences of the cost, in all of a node's six numbers; samples beyond the border left out."""
    cams = mp.decompose(
        WAVE,
        EYE,
        24 if kind != "quadratic" else 12,
        index=1.4 if kind == "refraction" else None,
        mode="directions" if kind == "direct" else "normals",
        degree=2 if kind == "quadratic" else 1,
    )
    whole = reflector_of(WAVE)
    state = state_of(cams, whole, split_samples(whole, EYE, 1500, 100, 0).fitted, 1500)
    rng = np.random.default_rng(2)
    nodes = state.nodes * rng.uniform(0.97, 1.03, state.nodes.shape)
    frames = frames_of(state, fixed_parts(None, state.real[0]), "free")
    stage = blocks.Stage(frames, state.nodes, np.float64(1e-3))
    with jax.enable_x64(True):
        rest = state.mesh, state.samples, state.eye, stage, state.kind
        face, place, *_ = blocks.placed(nodes, state.face, state.place, *rest)
        weights = np.stack([1 - place[:, 0] - place[:, 1], place[:, 0], place[:, 1]])
        sure = weights.min(axis=0) > 1e-4
        assert sure.mean() > 0.5
        samples = state.samples._replace(weight=np.where(sure, state.samples.weight, 0.0))
        rest = state.mesh, samples, state.eye, stage, state.kind
        slope = np.asarray(blocks.assembled(nodes, face, place, *rest).slope)
        numbers = [(v, k) for v in range(0, state.real[0], 7) for k in range(6)]
        for v, k in numbers:
            costs = []
            for h in (1e-6, -1e-6):
                moved = nodes.copy()
                moved[v] += h * frames[v, :, k]
                costs.append(float(blocks.placed(moved, face, place, *rest)[2]))
            assert (costs[0] - costs[1]) / 4e-6 == pytest.approx(slope[v, k], rel=1e-4, abs=1e-6), (v, k)


@pytest.mark.slow
def test_optimistix_comes_to_the_same(start, fitted):
    other = mp.fit(start, reflector=SPHERE, eye=EYE, samples=1500, iterations=25, solver="optimistix")
    assert other.error.rms == pytest.approx(fitted.error.rms, rel=0.15)
    assert abs(other.camera.vertices - fitted.camera.vertices).max() < 0.1


def test_what_is_fixed_stays(start, fitted):
    count = len(start.vertices)
    result = mp.fit(start, reflector=SPHERE, eye=EYE, **SMALL, fixed={"positions": True})
    assert np.abs(result.camera.vertices - start.vertices).max() < 1e-15
    assert 1.3 < result.gain and fitted.near.rms < 0.5 * result.near.rms
    mask = np.arange(count) % 2 == 0
    result = mp.fit(start, reflector=SPHERE, eye=EYE, **SMALL, fixed=mask)
    moved = np.abs(result.camera.vertices - start.vertices).max(axis=1)
    assert moved[mask].max() < 1e-15 < 1e-4 < moved[~mask].max()
    assert np.abs(result.camera.normals - start.normals)[mask].max() < 1e-15
    lengths = mp.fit(start, reflector=SPHERE, eye=EYE, **SMALL, fixed={"length": True}).camera.normals
    assert np.ptp(np.linalg.norm(lengths, axis=1)) < 0.2
    wave = mp.decompose(WAVE, EYE, 40)
    rim = mp.fit(wave, reflector=WAVE, eye=EYE, **SMALL, rim="fixed").camera
    border = np.abs(wave.vertices[:, :2]).max(axis=1) > 1 - 1e-9
    assert np.abs(rim.vertices - wave.vertices)[border].max() < 1e-15 < np.abs(rim.vertices - wave.vertices).max()
    along = mp.fit(wave, reflector=WAVE, eye=EYE, **SMALL, rim="along").camera
    assert 1e-4 < np.abs(along.vertices - wave.vertices)[border].max()


@pytest.mark.parametrize("kind", ["refraction", "direct", "posed"])
def test_other_rays(kind):
    index = 1.5 if kind == "refraction" else None
    cams = mp.decompose(WAVE, EYE, 40, index=index, mode="directions" if kind == "direct" else "normals")
    if kind == "posed":
        pose = mp.look_at((1, 2, 3), (0.2, 0, 0))
        turn, move = pose[:3, :3], pose[:3, 3]
        cams = dataclasses.replace(
            cams,
            vertices=cams.vertices @ turn.T + move,
            normals=cams.normals @ turn.T,
            eye=turn @ cams.eye + move,
            camera_from_world=pose,
        )
        assert np.allclose(in_world(cams).eye, (3, 1, 2.5))
    result = mp.fit(cams, reflector=WAVE, eye=EYE, **SMALL)
    assert result.gain > (1.5 if kind == "direct" else 2.0) and result.error.missed == 0
    before, after = (mp.ray_error(c, WAVE, EYE) for c in (cams, result.camera))
    assert after.rms * 1.5 < before.rms
    assert result.camera.kind == cams.kind and result.camera.index == cams.index
    if kind == "direct":
        assert result.camera.ray_scale == "near_far"


def test_interrupted_saved_and_gone_on_with(start, tmp_path):
    def stop(step):
        if step.number == 2 and step.stage == "all":
            raise KeyboardInterrupt

    part = mp.fit(start, reflector=SPHERE, eye=EYE, samples=1500, progress=stop)
    assert part.status == "interrupted" and part.gain > 2
    mp.write_fit(tmp_path / "part.npz", part)
    back = mp.read_fit(tmp_path / "part.npz")
    assert (back.camera.normals == part.camera.normals).all() and back.history == part.history
    assert back.error == part.error and back.camera.resolution == part.camera.resolution
    whole = mp.fit(back, reflector=SPHERE, eye=EYE, **SMALL)
    assert whole.error.rms <= part.error.rms and whole.history[: len(part.history)] == part.history
    assert whole.history[-1].error < 1  # over that of the camera that it went on from
    assert "rays" not in {step.stage for step in whole.history[len(part.history) :]}
    with pytest.raises(mp.InputError, match="no such file"):
        mp.read_fit(tmp_path / "none.npz")
    (tmp_path / "bad.npz").write_bytes(b"no")
    with pytest.raises(mp.InputError, match="not what"):
        mp.read_fit(tmp_path / "bad.npz")


def test_lengths_live_on_in_pictures(fitted):
    """A fitted camera is rasterized by its own rays: the same pixels as tracing them, and saved with its lengths."""
    from mpcam.cameras.serialize import camera_from_json, camera_to_json

    cams = dataclasses.replace(fitted.camera, resolution=12)
    room = mp.builtin_mesh("quad_room").transformed(np.diag([3.0, 3.0, 3.0, 1.0]))
    ours, truth = (np.asarray(mp.rasterize(cams, room, method=method).triangle) for method in ("invert", "raytrace"))
    bare = dataclasses.replace(cams, normals=cams.normals / np.linalg.norm(cams.normals, axis=1, keepdims=True))
    other = np.asarray(mp.rasterize(bare, room).triangle)
    assert (ours != truth).mean() < 0.002 < (other != truth).mean()
    back: Any = camera_from_json(camera_to_json(cams))
    assert (back.normals == cams.normals).all()


def test_hopeless_and_tiny_inputs_end_with_a_status():
    flat = mp.Surface.saddle(2.0, 0.0)
    result = mp.fit(mp.decompose(flat, EYE, 20), reflector=flat, eye=EYE, **SMALL)
    assert result.status == "converged" and not result.history and result.error.rms < 1e-9
    cams = mp.decompose(WAVE, EYE, 40)
    few = mp.fit(cams, reflector=WAVE, eye=EYE, samples=16)
    assert few.status == "rank_deficient" and few.error.rms <= few.before.rms
    one = mp.CameraTriangles(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], normals=np.eye(3)[[2, 2, 2]], eye=(3, 1, 2.5)
    )
    assert np.isfinite(mp.fit(one, reflector=WAVE, eye=EYE, **SMALL).error.rms)
    none = mp.fit(cams, reflector=WAVE, eye=EYE, samples=1500, iterations=0)
    assert none.status == "budget" and none.gain == 1 and (none.camera.vertices == cams.vertices).all()
    still = mp.fit(cams, reflector=WAVE, eye=EYE, **SMALL, fixed=np.ones(len(cams.vertices), bool))
    assert (still.camera.normals == cams.normals).all()


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_sizes_do_not_matter(start, fitted, scale):
    eye = mp.Pinhole(97, 71, 90, 92, 48, 36, camera_from_world=mp.look_at(scale * np.array((3, 1, 2.5)), (0, 0, 0)))
    cams = dataclasses.replace(start, vertices=scale * start.vertices, eye=scale * start.eye)
    result = mp.fit(cams, reflector=mp.Surface.sphere(scale), eye=eye, **SMALL)
    assert result.error.rms / scale == pytest.approx(fitted.error.rms, rel=1e-4)
    assert np.abs(result.camera.vertices / scale - fitted.camera.vertices).max() < 1e-4


def test_mistakes(start):
    with pytest.raises(mp.InputError, match="give CameraTriangles"):
        mp.fit(SPHERE, reflector=SPHERE, eye=EYE)
    with pytest.raises(mp.InputError, match="eye"):
        mp.fit(start, reflector=SPHERE, eye=(0.0, 0.0, 9.0))
    with pytest.raises(mp.InputError, match="rim"):
        mp.fit(start, reflector=SPHERE, eye=EYE, rim="loose")
    with pytest.raises(mp.InputError, match="solver"):
        mp.fit(start, reflector=SPHERE, eye=EYE, solver="mine")
    with pytest.raises(mp.InputError, match="fixed"):
        mp.fit(start, reflector=SPHERE, eye=EYE, fixed={"sizes": True})
    with pytest.raises(mp.InputError, match="fixed"):
        mp.fit(start, reflector=SPHERE, eye=EYE, fixed=[True, False])
