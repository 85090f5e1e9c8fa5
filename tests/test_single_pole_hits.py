"""Frames of single-pole occlusion cameras: all methods agree, with each other and with brute force, in all ranges."""

from typing import Any

import numpy as np
import pytest
from bent_cameras import wrong_pixels
from catalog import POSE, soup

import mpcam as mp

EXAMPLES: dict[str, Any] = mp.SinglePoleOcclusion.examples(96, 64, POSE)


def balls():
    """Small triangles before, within and beyond the range of the examples, none of them hidden wholly."""
    eye, ahead = mp.math.pose.frame_origin(POSE), POSE[2, :3]
    found = []
    for place, size in ((0.35, 0.06), (0.9, 0.2), (1.9, 0.5), (3.4, 0.8), (9.0, 5.0)):
        pose = np.diag([size, size, size, 1.0])
        pose[:3, 3] = eye + place * ahead + 0.12 * place * np.array([0.3, -0.4, 0.6])
        found.append(mp.builtin_mesh("sphere", triangles=5120).transformed(pose))
    return mp.Mesh.concatenate(found)


@pytest.mark.parametrize("name", EXAMPLES)
def test_hits_are_those_of_brute_force_on_all_pieces(name):
    camera, mesh = EXAMPLES[name], soup(200, 21)
    hits = mp.rasterize(camera, mesh)
    with np.errstate(invalid="ignore"):
        wrong = wrong_pixels(camera, mesh, hits)
    assert hits.mask.mean() > 0.5 and wrong == 0


@pytest.mark.parametrize("name", EXAMPLES)
def test_all_methods_agree(name):
    camera, mesh = EXAMPLES[name], balls()
    hits = mp.rasterize(camera, mesh)
    z = (np.asarray(hits.points)[hits.mask] @ POSE[:3, :3].T + POSE[:3, 3])[:, 2]
    assert (z < camera.near).mean() > 0.01 and (z > camera.far).mean() > 0.05
    assert ((z > camera.near) & (z < camera.far)).mean() > 0.1
    traced = mp.rasterize(camera, mesh, method="raytrace")
    assert (hits.triangle != traced.triangle).mean() < 1e-3
    # The image of what was hit is the pixel that hit it, at the depth that it was hit at.
    image = camera.project(np.asarray(hits.points)[hits.mask])
    centers = np.stack(np.meshgrid(np.arange(96) + 0.5, np.arange(64) + 0.5), -1)
    off = np.linalg.norm(image.pixel[:, 0] - centers[hits.mask], axis=-1)
    assert np.percentile(off, 99) < 1e-3 and np.abs(image.depth[:, 0] / hits.depth[hits.mask] - 1).max() < 1e-4
    for method, settings in (("vertex", {"level": 2}), ("two_pass", {"patch": 6})):
        drawn = mp.rasterize(camera, mesh, method=method, **settings)
        # A triangle across the pole's axis is drawn over the disc around the pole where nothing of it can be.
        aside = np.linalg.norm(centers - camera.pole, axis=-1) > camera.shift_far + 2
        both = hits.mask & drawn.mask & aside
        assert (hits.mask != drawn.mask)[aside].mean() < 0.02 and both.mean() > 0.3
        assert np.percentile(np.abs(drawn.depth[both] / hits.depth[both] - 1), 95) < 0.01
