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


NUMBERS = """
import drjit as dr
import drjit.llvm as types
from mpcam_kernels.frozen import frozen

def scaled(x, once, twice, last):
    return x * last

kernel, x, y = {wrapper}(scaled), types.UInt([1, 2, 3]) + 0, types.UInt([3, 2, 1]) + 0
dr.eval(x, y)
print([kernel(x, 1, 2, last).numpy().tolist() for last in (2, 1)])
kernel = {wrapper}(lambda a, b, last: 10 * last + 0 * (a + b))
print([kernel(x, y, last).numpy().tolist() for last in (x, y)])
"""


def _numbers(wrapper: str) -> str:
    script = NUMBERS.format(wrapper=wrapper)
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120).stdout


def test_numbers_and_arrays_that_came_before_are_told_apart():
    assert _numbers("frozen").split("\n")[:2] == ["[[2, 4, 6], [1, 2, 3]]", "[[10, 20, 30], [30, 20, 10]]"]


def test_without_care_one_would_be_taken_for_the_other():
    """Once this fails, Dr.Jit has mended it, and `frozen` need not put the numbers into a text any more."""
    assert _numbers("dr.freeze").split("\n")[:2] == ["[[2, 4, 6], [2, 4, 6]]", "[[10, 20, 30], [10, 20, 30]]"]


def test_many_cameras_and_meshes_in_one_process():
    """Recordings of some sizes do not serve others: camera triangles of all sizes, each frame against traced rays."""
    rng = np.random.default_rng(1)
    for _ in range(120):
        count, triangles = int(rng.choice([1, 2, 5, 30, 120])), int(rng.choice([1, 2, 3, 9, 300]))
        corners = 0.2 * rng.normal(size=(count, 3, 3)) + rng.normal(size=(count, 1, 3))
        corners[..., 2] *= 0.2
        ways = 0.3 * rng.normal(size=(count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3)) + [0, 0, 1]
        camera = mp.CameraTriangles(
            corners.reshape(-1, 3),
            np.arange(3 * count).reshape(-1, 3),
            directions=ways.reshape(-1, 3),
            resolution=int(rng.choice([2, 3, 8, 17])),
        )
        points = rng.normal(size=(triangles, 1, 3)) * [1.5, 1.5, 0.5] + [0, 0, 2.5]
        points = points + rng.normal(size=(triangles, 3, 3)) * rng.choice([0.05, 0.4, 1.0])
        mesh = mp.Mesh(points.reshape(-1, 3), np.arange(3 * triangles).reshape(-1, 3))
        truth = mp.rasterize(camera, mesh, method="raytrace").triangle
        for settings in (
            {},
            {"bound": "triangle"},
            {"bound": "nine_point"},
            {"culling": ()},
            {"culling": ("objects",)},
        ):
            if not settings or rng.random() < 0.3:
                found = mp.rasterize(camera, mesh, **settings).triangle
                assert (found != truth).sum() <= max(3, 0.003 * truth.size), (count, triangles, settings)
