"""Rays against depth images: hits against Embree, and steps."""

import numpy as np
import pytest
from depth_image_kit import HEIGHT, MESH, MIDDLE, SHARES, SIZE, WIDTH, Truth, apart, at, cameras, rays

import mpcam as mp


@pytest.mark.parametrize("name", list(cameras()))
def test_rays_hit_what_embree_hits(name):
    """Wherever the image holds that surface; what is found lies on the ray and on the image's surface."""
    camera, (origins, directions) = cameras()[name], rays(20_000)
    image = mp.DepthImage.render(camera, MESH, color=False)
    found, truth = image.intersect(origins, 3.0 * directions), Truth(camera, MESH, origins, directions)
    assert truth.held.mean() > 0.1
    # The rest lies along the many silhouettes and creases: 2 to 4 pixels of a ball's hundred are at its edge.
    assert (truth.off(found)[truth.held] <= 0.25).mean() >= SHARES[name]
    assert (~found.hit)[truth.held].mean() < 0.006
    assert (found.hit & ~truth.hit).mean() < 0.012  # along silhouettes, whose pixels are taken to be full
    hit = found.hit
    again = camera.project(at(origins, directions, found.distance)[hit])
    assert np.hypot(*(again.pixel[:, 0] - found.pixel[hit]).T).max() < 0.02
    column, row = found.pixel[hit].T.astype(int)
    around = [
        (np.clip(row + j, 0, HEIGHT - 1), np.clip(column + i, 0, WIDTH - 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)
    ]
    off = np.abs(np.array([image.depth[place] for place in around]) - again.depth[:, 0]).min(axis=0)
    assert np.quantile(off, 0.98) < SIZE / 8


def test_one_thing_that_fills_the_image_is_met_nearly_always():
    ball = mp.builtin_mesh("sphere", triangles=20480)
    origins, directions = rays(30_000)
    origins = 2 * (origins - MIDDLE) / SIZE
    for camera in (
        mp.Pinhole.from_fov(WIDTH, HEIGHT, 0.7, mp.look_at((0, -3.2, 0.5), (0, 0, 0))),
        mp.Orthographic(WIDTH, HEIGHT, 85.0, camera_from_world=mp.look_at((0, -3.2, 0.5), (0, 0, 0))),
    ):
        image, truth = mp.DepthImage.render(camera, ball, color=False), Truth(camera, ball, origins, directions)
        found = image.intersect(origins, directions)
        assert truth.held.sum() > 1000
        assert (truth.off(found)[truth.held] <= 0.25).mean() >= 0.995
        assert (~found.hit)[truth.held].mean() < 0.002


def test_without_planes_rays_hit_nearly_as_well():
    camera, (origins, directions) = cameras()["pinhole"], rays(20_000)
    truth = Truth(camera, MESH, origins, directions)
    image = mp.DepthImage.render(camera, MESH, color=False, planes=False)
    arrays = mp.DepthImage(camera, image.depth)
    found = image.intersect(origins, directions)
    assert (truth.off(found)[truth.held] <= 0.25).mean() >= 0.98
    other = arrays.intersect(origins, directions)  # which knows no bounds of the mesh
    assert (found.hit == other.hit).mean() > 0.999 and not (found.hit & ~other.hit).any()
    assert (apart(found, other)[found.hit] <= 1e-3 * SIZE).mean() > 0.999


@pytest.mark.parametrize("name", ["pinhole", "panorama", "bilinear"])
def test_coarse_steps_leave_out_work_and_nothing_else(name):
    camera, (origins, directions) = cameras()[name], rays(20_000)
    image = mp.DepthImage.render(camera, MESH, color=False)
    fine = image.intersect(origins, directions, coarse=None)
    for coarse in (3, 6, 9, 12):
        found = image.intersect(origins, directions, coarse=coarse)
        assert ((found.hit != fine.hit) | (apart(found, fine) > 1e-3 * SIZE)).mean() <= 0.001
        assert found.steps.mean() < fine.steps.mean() / (2 if name == "panorama" else 3)
    assert fine.steps.min() == 0 and fine.steps.max() < 10_000


def test_steps_are_no_longer_than_they_may_be():
    """Along a camera's plane a ray crosses the image evenly, so that its steps can be counted."""
    camera = mp.Orthographic(64, 64, 32.0)
    depth = np.full((64, 64), 1.0)
    depth[:, 40:] = 3.0  # a gap, under which the ray runs
    image = mp.DepthImage(camera, depth)
    ray = (-0.99, 0.011, 2.0), (1.0, 0.0, 0.0)
    for fine, least in ((1.0, 64), (0.25, 64)):
        found = image.intersect(*ray, coarse=None, fine=fine)
        assert not found.hit and least <= found.steps < 3 * least / fine
    assert image.intersect(*ray, coarse=6.0).steps < 50
    depth = np.full((64, 64), 1.99)
    depth[31:34] = 2.004  # so near along the whole ray that all steps must be fine
    near = mp.DepthImage(camera, depth)
    assert near.intersect(*ray, fine=0.25).steps >= 4 * 62
    assert near.intersect(*ray, fine=1.0).steps < 90


def test_fine_steps_hardly_change_hits():
    camera, (origins, directions) = cameras()["pinhole"], rays(20_000)
    image = mp.DepthImage.render(camera, MESH, color=False)
    first = image.intersect(origins, directions, fine=1 / 16)
    for fine in (1.0, 0.5, 0.25):
        found = image.intersect(origins, directions, fine=fine)
        assert ((found.hit != first.hit) | (apart(found, first) > 1e-3 * SIZE)).mean() < 1e-3


def test_pieces_of_graph_cameras_give_the_same_hits():
    """Frustum by frustum, straight in the image, by other patches: the same hits but at edges, in fewer steps."""
    camera, (origins, directions) = cameras()["graph"], rays(20_000)
    image = mp.DepthImage.render(camera, MESH, color=False)
    marched, walked = (image.intersect(origins, directions, walk=walk) for walk in ("march", "pieces"))
    assert (marched.hit != walked.hit).mean() < 0.015
    off = apart(marched, walked)[marched.hit & walked.hit]
    assert np.median(off) < 1e-3 * SIZE and (off < 0.03 * SIZE).mean() > 0.98
    assert walked.steps.mean() < marched.steps.mean()
    with pytest.raises(mp.InputError, match="a Pinhole has none"):
        mp.DepthImage(mp.Pinhole(2, 2), np.ones((2, 2))).intersect((0, 0, 0), (0, 0, 1), walk="pieces")


def test_a_pole_shows_what_a_pinhole_does_not():
    """One ball seen from the front: more of its sides is in the image, and more rays meet what is true."""
    ball = mp.builtin_mesh("sphere", triangles=20480)
    origins, directions = rays(20_000)
    origins, pose = 2 * (origins - MIDDLE) / SIZE, mp.look_at((0, -3.2, 0), (0, 0, 0))
    pinhole = mp.Pinhole(WIDTH, HEIGHT, 180.0, camera_from_world=pose)
    pole = mp.SinglePoleOcclusion(
        WIDTH, HEIGHT, 140.0, 140.0, 110.0, 90.0, near=2.2, far=3.6, shift_far=45.0, camera_from_world=pose
    )
    shares = []
    for camera in (pinhole, pole):
        truth = Truth(camera, ball, origins, directions)
        found = mp.DepthImage.render(camera, ball, color=False).intersect(origins, directions)
        assert (~found.hit)[truth.held].mean() < 0.005
        both = truth.hit & found.hit
        shares.append((np.abs(found.distance[both] - truth.distance[both]) < 0.02).sum())
    assert shares[1] > 1.15 * shares[0]
