"""`import mpcam` loads nothing heavy; each claim is made in a fresh process."""

import subprocess
import sys

import numpy as np
import pytest

import mpcam

HEAVY = ("jax", "mitsuba", "drjit", "optimistix", "equinox", "trimesh", "OpenImageIO", "matplotlib", "scipy", "PIL")


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    return done.stdout


def loaded_by(statement: str) -> set[str]:
    return set(run(f"{statement}\nimport sys; print(*{{name.split('.')[0] for name in sys.modules}})").split())


@pytest.mark.parametrize(
    "statement",
    [
        "import mpcam",
        "import mpcam; mpcam.Mesh, mpcam.Scene, mpcam.Radial, mpcam.InputError",
        "import mpcam.cli",
        "import mpcam_kernels.llvm",
    ],
)
def test_nothing_heavy_is_loaded(statement):
    assert loaded_by(statement).isdisjoint(HEAVY)


def test_the_check_can_fail():
    assert "drjit" in loaded_by("import drjit")


def test_kernels_load_without_mpcam():
    assert "mpcam" not in loaded_by("import mpcam_kernels.backend, mpcam_kernels.llvm")


def test_import_takes_no_longer_than_numpy():
    code = (
        "import time; a = time.perf_counter(); import numpy; b = time.perf_counter(); import mpcam; "
        "print(b - a, time.perf_counter() - b)"
    )
    times = np.array([run(code).split() for _ in range(5)], np.float64)
    numpy_seconds, own_seconds = times.min(axis=0)
    assert own_seconds < numpy_seconds + 0.05


def test_every_public_name_is_there():
    for name in mpcam.__all__:
        assert getattr(mpcam, name) is not None
    assert set(mpcam.__all__) <= set(dir(mpcam))


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = mpcam.no_such_name
