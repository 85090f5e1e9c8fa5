"""Bounds of triangles' images, as the kernels compute and widen them in float32, against samples in float64."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.capabilities import Bounds, Outlines
from mpcam.cameras.outline import outline
from mpcam.stress.inputs import in_the_image
from mpcam.stress.report import StressRow

CHUNK = 100_000

BoundOf = Callable[[Any, Any, Any, Any], list[Any]]
"""Of a camera and three corners: regions (low, high, valid, lines) of which one holds each point of the image."""

BOX: dict[str, BoundOf] = {"box": lambda camera, a, b, c: [(*camera.local_bound(a, b, c), ())]}
OUTLINE: dict[str, BoundOf] = {"outline": lambda camera, a, b, c: [outline(camera, a, b, c)]}


def known_bounds(camera: Any) -> dict[str, BoundOf]:
    """The bounds that a camera has by its capabilities."""
    return (BOX if isinstance(camera, Bounds) else {}) | (OUTLINE if isinstance(camera, Outlines) else {})


def bound_rows(
    name: str, camera: Any, count: int, bounds: dict[str, BoundOf] | None = None, seed: int = 3
) -> list[StressRow]:
    """Each bound of `count` random triangles; missed are those of which a sample in the image lies outside."""
    bounds = known_bounds(camera) if bounds is None else bounds
    missed = dict.fromkeys(bounds, 0)
    rng = np.random.default_rng(seed)
    for start in range(0, count, CHUNK):
        corners = random_triangles(camera, rng, min(CHUNK, count - start))
        for kind, wrong in _missed(camera, corners, bounds).items():
            missed[kind] += wrong
    return [
        StressRow(name, f"bounds, {kind}", "float32", count, float("nan"), wrong, 0) for kind, wrong in missed.items()
    ]


def random_triangles(camera: Any, rng: np.random.Generator, count: int) -> np.ndarray:
    """Corners (count, 3, 3) in the camera frame, in float32: half of all sizes around it, half as pixels see them."""
    half = count // 2
    corners = rng.normal(size=(count, 1, 3)) + 10 ** rng.uniform(-3, 0.8, (count, 1, 1)) * rng.normal(
        size=(count, 3, 3)
    )
    size = np.array([[camera.width], [camera.height]])
    middle = rng.uniform(0, 1, (2, half)) * size
    apart = 10 ** rng.uniform(-3, 0, half)
    for i in range(3):
        place = middle + apart * rng.normal(size=(2, half)) * size
        corners[:half, i] = in_the_image(camera, place) * 10 ** rng.uniform(-1, 1, (half, 1))
    return corners.astype(np.float32)


def _missed(camera: Any, corners: np.ndarray, bounds: dict[str, BoundOf]) -> dict[str, int]:
    """How many triangles have a sampled point, along the edges or inside, that a bound leaves out."""
    import drjit as dr

    from mpcam.backend import aligned, opaque_zero, types
    from mpcam.rendering.device_camera import unposed

    t, lens = types(), unposed(camera)
    # In Dr.Jit's own memory, so that the kernel is compiled once.
    single = [t.Array3f(*map(aligned, corners[:, i].T)) + opaque_zero() for i in range(3)]
    size = max(camera.width, camera.height)
    regions = {kind: [_Region(t, region, size) for region in bound(lens, *single)] for kind, bound in bounds.items()}
    exact = [t.Array3f64(corner) for corner in single]
    dr.eval(single, [region.arrays for several in regions.values() for region in several])
    weights = np.array(_weights()).T
    tables = [t.Float64(aligned(row, np.float64)) for row in weights]

    def sample(number: Any, *out: Any) -> tuple[Any, ...]:
        w = [dr.gather(t.Float64, table, number) for table in tables]
        image = camera.local_project(exact[0] * w[0] + exact[1] * w[1] + exact[2] * w[2])[0]
        seen = image.valid & camera.contains(image.pixel)
        return number + 1, *(
            lost | (seen & ~_any(region.holds(image.pixel) for region in several))
            for lost, several in zip(out, regions.values(), strict=True)
        )

    start = t.UInt(0) + dr.zeros(t.UInt, len(corners)), *(t.Bool(False) for _ in regions)
    out = dr.while_loop(start, lambda number, *out: number < weights.shape[1], sample)[1:]
    dr.eval(out)
    return {kind: int(np.count_nonzero(lost.numpy())) for kind, lost in zip(regions, out, strict=True)}


def _any(conditions: Any) -> Any:
    first, *rest = conditions
    for condition in rest:
        first = first | condition
    return first


class _Region:
    """A box with lines, widened as the kernels widen it, in float64."""

    def __init__(self, types: Any, region: Any, size: int):
        from mpcam_kernels.regions import slack

        self.low, self.high = types.Array2f64(region[0]), types.Array2f64(region[1])
        self.valid, self.lines = region[2], [types.Array3f64(*line) for line in region[3]]
        self.slack = slack(size)
        self.arrays = (self.low, self.high, self.valid, self.lines)

    def holds(self, pixel: Any) -> Any:
        inside = self.valid & (pixel.x >= self.low.x - self.slack) & (pixel.y >= self.low.y - self.slack)
        inside &= (pixel.x <= self.high.x + self.slack) & (pixel.y <= self.high.y + self.slack)
        for a, b, c in self.lines:
            inside &= a * pixel.x + b * pixel.y + c >= -self.slack
        return inside


def _weights() -> list[tuple[float, float, float]]:
    """Barycentric weights of the samples: 33 along each edge, denser at its ends, and a few inside."""
    s = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 33))
    edges = [(1 - a, a, 0.0) for a in s] + [(0.0, 1 - a, a) for a in s] + [(a, 0.0, 1 - a) for a in s]
    inside = [(0.34, 0.33, 0.33), (0.8, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.1, 0.8)]
    return [*edges, *inside]
