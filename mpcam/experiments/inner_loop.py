"""How fast the pixel pass tests pixels, against the same tests fully unrolled on numbers in the code."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.comparison.timing import synchronize
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.invert import Inverted


def large_triangles(count: int) -> Mesh:
    """Triangles behind each other, each of which fills the whole view of a pinhole at the origin."""
    turn = 2.399963 * np.arange(count)[:, None] + 2 * np.pi / 3 * np.arange(3)
    depth = np.broadcast_to(1 + 0.01 * np.arange(count)[:, None], turn.shape)
    vertices = np.stack([400 * np.cos(turn), 400 * np.sin(turn), depth], -1)
    return Mesh(vertices.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3), name=f"{count} triangles")


def measure_loop(triangles: int, size: int, repeats: int) -> dict[str, float]:
    """Tests per second, in 10^9: of the pixel pass, and unrolled; and their ratio. Interleaved, medians.

    Each is the time of its longest kernel, as Dr.Jit reports it: both have but one that counts.
    """
    prepared = Inverted(Pinhole(size, size), large_triangles(triangles))
    tests = prepared.frame().stats.tests
    unrolled = _unrolled(prepared, triangles)
    loop, straight = [], []
    for number in range(repeats + 2):
        seconds = _longest_kernel(prepared.frame), _longest_kernel(unrolled)
        if number >= 2:
            loop.append(seconds[0])
            straight.append(seconds[1])
    rates = tests / np.median(loop) / 1e9, size * size * triangles / np.median(straight) / 1e9
    return {"loop_rate": float(rates[0]), "unrolled_rate": float(rates[1]), "share": float(rates[0] / rates[1])}


def _longest_kernel(call: Callable[[], object]) -> float:
    """Seconds of the longest kernel of a call."""
    import drjit as dr

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        call()
        synchronize()
        return 1e-3 * max(entry.get("execution_time", 0.0) for entry in dr.kernel_history())


def _unrolled(prepared: Inverted, triangles: int) -> Any:
    """A frozen kernel that tests all pixels against all triangles, set-ups as literals, nearest in registers."""
    import drjit as dr

    from mpcam.backend import types
    from mpcam_kernels import ray_triangle
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.pixels import PER_THREAD

    t, fours = types(), PER_THREAD // 4
    corners = np.asarray(prepared.place(prepared.vertices)[0].numpy()).reshape(triangles, 3, 4)[..., :3]
    shapes = []
    for triangle in corners:
        shape = ray_triangle.setup(*(t.Array3f(*map(float, corner)) for corner in triangle))
        numbers = [[float(n) for n in np.ravel(row.numpy())] for row in (*shape.edges, shape.plane)]
        shapes.append(numbers)
    threads = prepared.camera.width * prepared.camera.height // PER_THREAD

    @frozen
    def kernel(components: list[Any]) -> tuple[Any, Any]:
        thread = dr.arange(t.UInt, threads)
        groups = [[dr.gather(t.Array4f, c, thread * fours + k) for c in components] for k in range(fours)]
        views = [t.Array3f(*(component[k] for component in group)) for group in groups for k in range(4)]
        best, owners = [t.Float(0)] * PER_THREAD, [t.UInt(0xFFFFFFFF)] * PER_THREAD
        for number, rows in enumerate(shapes):
            *edges, plane = (t.Array3f(*row) for row in rows)
            shape = ray_triangle.RayTriangle((edges[0], edges[1], edges[2]), plane, True)
            for k, view in enumerate(views):
                covered, nearness = ray_triangle.hit(shape, view)
                better = (nearness > best[k]) | ((nearness == best[k]) & (number < owners[k]))
                owners[k] = dr.select(covered & better, t.UInt(number), owners[k])
                best[k] = dr.select(covered & better, nearness, best[k])
        return best, owners

    components = list(prepared.samples.pixels)

    def run() -> None:
        dr.eval(kernel(components))

    run()
    return run
