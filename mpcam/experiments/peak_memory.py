"""Peak memory of a process that renders one mesh by one method: run as a program, in a process of its own.

    python -m mpcam.experiments.peak_memory MESH.npz METHOD SIZE

renders a few still and moving frames and prints megabytes.
"""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from mpcam.geometry.mesh import Mesh

FRAMES = 3


def peak_megabytes(mesh: Mesh, method: str, size: int) -> float:
    """Peak memory in 10^6 bytes of a fresh process with everything that it loads; RuntimeError where it fails."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.npz"
        np.savez(path, vertices=mesh.vertices, faces=mesh.faces)
        command = [sys.executable, "-m", __name__, str(path), method, str(size)]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or [f"it ended with status {done.returncode}"])[-1])
    return float(done.stdout)


def own_peak() -> float:
    """Peak resident memory of this process so far, in 10^6 bytes."""
    status = Path("/proc/self/status")
    if status.exists():  # ru_maxrss would include the process that started this one
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024 / 1e6
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def main(path: str, method: str, size: int) -> float:
    """Render the frames; returns the peak."""
    from mpcam.cameras.radial import Radial
    from mpcam.comparison.motion import moving_frame, moving_vertices
    from mpcam.comparison.timing import synchronize
    from mpcam.rendering.methods import prepare

    with np.load(path) as arrays:
        mesh = Mesh(arrays["vertices"], arrays["faces"])
    prepared = prepare(Radial.paraboloid(size, size), mesh, method)
    moving = moving_frame(prepared, moving_vertices(mesh))
    for _ in range(FRAMES):
        prepared.frame()
        moving()
        synchronize()
    return own_peak()


if __name__ == "__main__":
    sys.stdout.write(f"{main(sys.argv[1], sys.argv[2], int(sys.argv[3])):.1f}\n")
