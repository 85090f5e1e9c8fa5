"""Large triangles cut into blocks, by the kernels' own tests."""

import functools

import drjit as dr
import numpy as np
from matplotlib import pyplot
from matplotlib.colors import ListedColormap, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

import mpcam as mp
from mpcam.cameras.outline import outline
from mpcam.rendering.device import lens, types
from mpcam_kernels import central
from mpcam_kernels.pipeline import BLOCK

SIZE = 160
CAMERA = mp.Radial.paraboloid(SIZE, SIZE)
TRIANGLES = {
    "bounded by tangents": np.array([[-0.7, 0.55, 0.45], [-0.2, 1.0, 0.45], [-0.15, 0.5, 0.9]]),
    "bounded by a sector": np.array([[-2.0, -1.4, 1.0], [1.3, -0.9, 0.8], [0.4, 2.6, 0.7]]),
}


@functools.cache
def states(name):
    """Per pixel: 0 outside of the box, 1 in a block that an edge excludes, 2 tested, 3 hit; and the box."""
    t, corners = types(), TRIANGLES[name]
    samples = lens(CAMERA).directions
    shape = central.setup(*(t.Array3f(*map(float, corner)) for corner in corners))
    keep = (samples.spreads >= 0) & central.may_hit(shape, samples.centres, samples.spreads)
    blocks = SIZE // BLOCK
    kept = np.kron(np.asarray(dr.select(keep, t.UInt(1), 0).numpy()).reshape(blocks, blocks), np.ones((BLOCK, BLOCK)))
    box = outline(CAMERA, *corners[:, :, None])
    low = np.clip(np.ceil(box.low[:, 0] - 0.5), 0, SIZE)
    high = np.clip(np.floor(box.high[:, 0] + 0.5), 0, SIZE)
    v, u = np.indices((SIZE, SIZE))
    inside = (u >= low[0]) & (u < high[0]) & (v >= low[1]) & (v < high[1])
    met = np.kron(inside.reshape(blocks, BLOCK, blocks, BLOCK).any((1, 3)), np.ones((BLOCK, BLOCK))) > 0
    hits = mp.rasterize(CAMERA, mp.Mesh(corners, [[0, 1, 2]]))
    state = np.where(met & (kept > 0), 2, np.where(inside, 1, 0))
    if hits.stats.tests != (state == 2).sum():
        raise RuntimeError(f"the figure shows {(state == 2).sum()} tests, the kernels make {hits.stats.tests}")
    return np.where(hits.mask, 3, state), (low, high)


def draw(theme):
    blue, orange, green, *_ = theme.palette
    colors = [to_rgba(theme.page, 0), to_rgba(theme.weak, 0.28), to_rgba(orange, 0.75), to_rgba(blue, 0.85)]
    figure, axes = pyplot.subplots(1, 2, figsize=(theme.width, 4.8))
    for place, name in zip(axes, TRIANGLES, strict=True):
        state, (low, high) = states(name)
        place.imshow(state, cmap=ListedColormap(colors), vmin=-0.5, vmax=3.5, interpolation="nearest")
        for line in np.arange(-0.5, SIZE + 1, BLOCK):
            place.axhline(line, color=theme.grid, linewidth=0.5)
            place.axvline(line, color=theme.grid, linewidth=0.5)
        x, y = np.array([[low[0], high[0], high[0], low[0], low[0]], [low[1], low[1], high[1], high[1], low[1]]]) - 0.5
        place.plot(x, y, color=green, linewidth=1.6)
        place.set_title(name)
        place.set(xlim=(-0.7, SIZE - 0.3), ylim=(SIZE - 0.3, -0.7))
        place.set_axis_off()
        place.set_anchor("N")
        entries = [
            (Line2D([], [], color=green), f"rectangle: {int((high - low).prod()):,} pixels"),
            (Patch(color=colors[1]), f"in blocks that an edge excludes: {int((state == 1).sum()):,}"),
            (Patch(color=colors[2]), f"tested: {int((state >= 2).sum()):,}"),
            (Patch(color=colors[3]), f"of these hit: {int((state == 3).sum()):,}"),
        ]
        place.legend(*zip(*entries, strict=True), loc="upper left", bbox_to_anchor=(0.0, 0.0))
    return figure
