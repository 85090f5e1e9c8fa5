"""Scenes with something far away: what is near the camera stays as exact, in the pictures and in the truth."""

import numpy as np
import pytest

import mpcam as mp

PLACE = np.array([448262.3, 5411933.7, 118.2])
ROOM = mp.builtin_mesh("quad_room")
EYE = ROOM.bounds.mean(axis=0) + [0.3, 0.2, 0.1]


def face(*corners):
    return mp.Mesh(np.array(corners, float), [(0, 1, 2)])


FAR = {
    "nothing": [],
    "no area": [face((0, 0, 0), (0, 0, 0), (0, 0, 0))],
    "one meter": [face((0, 0, 0), (1, 0, 0), (0, 1, 0))],
    "1e9": [face((1e9, 0, 0), (1e9, 1, 0), (1e9, 0, 1))],
    "huge": [face((-1e7, 0, 0), (1e7, 0, 0), (0, 1e7, 1))],
    "not finite": [face((0, 0, 0), (np.inf, 0, 0), (0, np.nan, 0))],
    "most of the scene": [mp.builtin_mesh("sphere", triangles=320)],
}


def cameras(pose):
    return {
        "fisheye": mp.Radial.equisolid(40, 40, camera_from_world=pose),
        "pinhole": mp.Pinhole(40, 40, fx=30, fy=30, cx=20, cy=20, camera_from_world=pose),
        "panorama": mp.Panorama.equirectangular(48, 24, camera_from_world=pose),
        "orthographic": mp.Orthographic(40, 40, 20.0, camera_from_world=pose),
        "twisted": mp.RayMap.examples(40, 40, pose)["twisted"],
    }


def nearest(camera, mesh):
    """Depth of each pixel: every ray against every face in float64."""
    v, u = np.indices((camera.height, camera.width)) + 0.5
    ray = camera.ray(np.stack([u.ravel(), v.ravel()], -1))
    origin, best = np.asarray(ray.origin) - PLACE, np.full(u.size, np.inf)
    for a, b, c in mesh.corners - PLACE:
        if not np.isfinite([a, b, c]).all() or not np.cross(b - a, c - a).any():
            continue
        n = np.cross(b - a, c - a)
        with np.errstate(all="ignore"):
            t = ((a - origin) * n).sum(-1) / (ray.direction @ n)
            p = origin + t[:, None] * ray.direction
            sides = [np.cross(end - start, p - start) @ n for start, end in ((a, b), (b, c), (c, a))]
        best = np.where((t > 0) & (np.min(sides, 0) >= 0) & ray.valid, np.minimum(t, best), best)
    return best.reshape(u.shape)


@pytest.mark.parametrize("name", cameras(np.eye(4)))
@pytest.mark.parametrize("what", FAR)
def test_depth_to_a_hundredth_of_a_millimeter(name, what):
    shift = np.eye(4)
    shift[:3, 3] = PLACE
    mesh = mp.Mesh.concatenate([ROOM.transformed(shift), *FAR[what]])
    pose = mp.look_at(EYE, EYE + [1, 0.4, 0.1])
    pose[:3, 3] = -pose[:3, :3] @ (EYE + PLACE)
    camera = cameras(pose)[name]
    truth = nearest(camera, mesh)
    for method in ("invert", "raytrace"):
        hits = mp.rasterize(camera, mesh, method)
        both = np.isfinite(truth) & hits.mask
        assert (np.isfinite(truth) != hits.mask).sum() <= 1 and both.sum() > 400
        assert np.abs(hits.depth[both] - truth[both]).max() < 1e-5, method


@pytest.mark.parametrize("method", ["invert", "raytrace", "vertex", "cubemap"])
def test_what_leaves_and_comes_back(method):
    """A part moves far away and the camera after it: each frame is that of the scene rendered anew."""
    whole = mp.Scene((ROOM, mp.builtin_mesh("sphere", triangles=320)))
    pose = mp.look_at(EYE, EYE + [1, 0.4, 0.1])
    prepared = mp.prepare(mp.Radial.equisolid(40, 40, camera_from_world=pose), whole, method)
    shift = np.eye(4)
    for far in (3e6, 0.1, 2e9, 0.0):
        shift[:3, 3] = far * np.array([1.0, -0.5, 0.25])
        for target in (EYE, EYE + shift[:3, 3]):
            turned = mp.look_at(EYE, EYE + [1, 0.4, 0.1])
            turned[:3, 3] = -turned[:3, :3] @ target
            camera = mp.Radial.equisolid(40, 40, camera_from_world=turned)
            prepared.update(transform=[shift, None])
            prepared.aim(camera)
            fresh = mp.rasterize(camera, mp.Scene((ROOM.transformed(shift), whole.meshes[1])), method)
            frame = prepared.frame()
            assert np.array_equal(frame.triangle, fresh.triangle) and np.array_equal(frame.depth, fresh.depth)
