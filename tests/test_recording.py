"""Recorded kernels: the garbage collector does not disturb a recording, and a replay has the size of its input."""

import subprocess
import sys

import numpy as np
import pytest

import mpcam as mp

SCRIPT = """
import gc
import numpy as np
import drjit as dr
import drjit.llvm as types
from mpcam_kernels.frozen import frozen
frozen = {wrapper}

class Ring:
    def __init__(self):
        self.me = self
        self.borrowed = types.Float(np.ones(1000, np.float32))
        dr.eval(self.borrowed)

def fill(x):
    for _ in range(20):
        Ring()  # garbage that only the collector can free
    return x + 1

gc.set_threshold(1)
print(frozen(fill)(types.Float([1, 2, 3])).numpy().tolist(), gc.isenabled())
"""


def _run(wrapper: str) -> subprocess.CompletedProcess[str]:
    script = SCRIPT.format(wrapper=wrapper)
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False)


def test_a_recording_is_not_disturbed_by_the_collector():
    assert _run("frozen").stdout.strip() == "[2.0, 3.0, 4.0] True"


def test_without_care_it_would_be():
    """Once this fails, Dr.Jit has mended it, and `frozen` need not stop the collector any more."""
    assert _run("dr.freeze").returncode != 0


@pytest.mark.parametrize("output", ["hits", "depth", "coverage"])
def test_frames_of_another_mesh_have_their_own_size(output):
    """A frozen kernel that counts its lanes itself takes their number from any array that is a multiple of it."""
    camera = mp.Radial.paraboloid(100, 100)  # 112 x 104 places with the blocks at the border: 1,456 lanes of eight
    for triangles in (4004, 1456, 1457, 364, 2912, 100, 101):
        corners = np.random.default_rng(triangles).normal(size=(triangles, 1, 3))
        corners = corners + 0.2 * np.random.default_rng(1).normal(size=(triangles, 3, 3))
        mesh = mp.Mesh(corners.reshape(-1, 3), np.arange(3 * triangles).reshape(-1, 3))
        frame = mp.prepare(camera, mesh, output=output).frame()
        truth = mp.rasterize(camera, mesh, method="raytrace")
        assert (frame.mask != truth.mask).mean() <= 2e-4
        if output == "hits":
            same = frame.mask & (frame.triangle == truth.triangle)
            assert (frame.triangle != truth.triangle).mean() <= 5e-4
            assert np.abs(frame.barycentric - truth.barycentric)[same].max() < 2e-2
