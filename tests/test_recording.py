"""Recording a kernel survives what the garbage collector does meanwhile."""

import subprocess
import sys

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
