"""Large triangles cut into parts of blocks, as the kernels list them."""

import functools

import drjit as dr
import numpy as np
from matplotlib import pyplot
from matplotlib.colors import ListedColormap, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

import mpcam as mp
from mpcam.backend import types
from mpcam.rendering.invert import Inverted
from mpcam_kernels import regions
from mpcam_kernels.blocks import LINK
from mpcam_kernels.samples import HEIGHT, PART, PARTS, WIDTH

SIZE = 160
CAMERA = mp.Radial.paraboloid(SIZE, SIZE)
TRIANGLES = {
    "an outline with lines": np.array([[-0.45, 0.55, 0.7], [-0.51, 0.86, 0.02], [0.09, 0.88, 0.47]]),
    "the box of a sector": np.array([[-2.0, -1.4, 1.0], [1.3, -0.9, 0.8], [0.4, 2.6, 0.7]]),
}
SHOWN = {"an outline with lines": (32, 96), "the box of a sector": (0, 0)}  # from this pixel on, to the lower border
OUTSIDE, DROPPED, TESTED, HIT = range(4)


def listed(mesh):
    """What the kernels find of a mesh of one large triangle: its region, and the numbers of the parts to test."""
    t, prepared, found = types(), Inverted(CAMERA, mesh), {}
    prepared.run(prepared.place(prepared.vertices), found.setdefault)
    rows = [dr.gather(t.Array4f, row, t.UInt(0)) for row in found["triangles"][1].regions]
    lists = found["lists"]
    heads, entries = (np.asarray(array.numpy()) for array in (lists.heads, lists.entries))
    links = np.append(entries.reshape(-1, 2)[:, 1], 0)[heads.astype(np.int64) - 1]  # no entry: the last, 0
    bits = links % LINK
    return regions.unpack(t, rows)[0], (bits[:, None] >> np.arange(PARTS)) & 1 > 0


@functools.cache
def states(name):
    """Per pixel: outside of the outline, in a part that an edge drops, tested or hit; and box and lines."""
    mesh = mp.Mesh(TRIANGLES[name], [[0, 1, 2]])
    area, parts = listed(mesh)
    low, high = np.array([area.x0[0], area.y0[0]]), np.array([area.x1[0], area.y1[0]])
    lines = np.array([[number[0] for number in line] for line in area.lines])
    v, u = np.indices((SIZE, SIZE)) + 0.5
    inside = (u > low[0]) & (u < high[0]) & (v > low[1]) & (v < high[1])
    inside &= (lines[:, 0, None, None] * u + lines[:, 1, None, None] * v + lines[:, 2, None, None] >= 0).all(0)
    # Blocks row by row, in each the parts row by row.
    tested = parts.reshape(SIZE // HEIGHT, SIZE // WIDTH, HEIGHT // PART, WIDTH // PART).swapaxes(1, 2)
    tested = np.kron(tested.reshape(SIZE // PART, SIZE // PART), np.ones((PART, PART))) > 0
    hits = mp.rasterize(CAMERA, mesh)
    if (hits.stats.tests, hits.stats.rendered) != (tested.sum(), hits.mask.sum()):
        raise RuntimeError(f"the figure shows {tested.sum()} tests, {hits.mask.sum()} hits; counted are {hits.stats}")
    state = np.where(inside, DROPPED, OUTSIDE)
    return np.where(hits.mask, HIT, np.where(tested, TESTED, state)), inside, (low, high), lines


def along(line, low, high):
    """Where a line a u + b v + c = 0 enters and leaves a rectangle, (2, 2); None where it does not meet it."""
    a, b, c = line
    crossings = [(u, -(a * u + c) / b) for u in (low[0], high[0]) if b]
    crossings += [(-(b * v + c) / a, v) for v in (low[1], high[1]) if a]
    kept = [p for p in crossings if (low - 1e-3 <= p).all() and (p <= high + 1e-3).all()]
    return np.array([min(kept), max(kept)]) if len(kept) > 1 else None


def draw(theme):
    blue, orange, green, violet, _ = theme.palette
    colors = [to_rgba(theme.page, 0), to_rgba(theme.weak, 0.32), to_rgba(orange, 0.75), to_rgba(blue, 0.85)]
    figure, axes = pyplot.subplots(1, 2, figsize=(theme.width, 4.8))
    for place, name in zip(axes, TRIANGLES, strict=True):
        state, inside, (low, high), lines = states(name)
        place.imshow(state, cmap=ListedColormap(colors), vmin=-0.5, vmax=3.5, interpolation="nearest")
        left, top = SHOWN[name]
        side = SIZE - top
        grids = [(WIDTH, HEIGHT, 0.6)] + [(PART, PART, 0.25)] * (side < SIZE)
        for across, down, width in grids:
            columns, rows = np.arange(left, left + side + 1, across) - 0.5, np.arange(top, SIZE + 1, down) - 0.5
            place.hlines(rows, columns[0], columns[-1], theme.weak, linewidth=width)
            place.vlines(columns, rows[0], rows[-1], theme.weak, linewidth=width)
        x, y = np.array([[low[0], high[0], high[0], low[0], low[0]], [low[1], low[1], high[1], high[1], low[1]]]) - 0.5
        place.plot(x, y, color=green, linewidth=1.6)
        drawn = [ends for line in lines if (ends := along(line, low, high)) is not None]
        for ends in drawn:
            place.plot(*(ends - 0.5).T, color=violet, linewidth=1.6)
        place.set_title(name)
        edge = 0.5 + 0.002 * side
        place.set(xlim=(left - edge, left + side - 1 + edge), ylim=(SIZE - 1 + edge, top - edge))
        place.set_axis_off()
        place.set_anchor("N")
        entries = [
            (Line2D([], [], color=green), f"box: {int((high - low).prod()):,} pixels"),
            (Line2D([], [], color=violet), f"three lines, leaving {int(inside.sum()):,}"),
            (Patch(color=colors[DROPPED]), f"in parts that an edge drops: {int((state == DROPPED).sum()):,}"),
            (Patch(color=colors[TESTED]), f"tested: {int((state >= TESTED).sum()):,}"),
            (Patch(color=colors[HIT]), f"of these hit: {int((state == HIT).sum()):,}"),
        ]
        entries = entries if drawn else entries[:1] + entries[2:]
        place.legend(*zip(*entries, strict=True), loc="upper left", bbox_to_anchor=(0.0, 0.0))
    return figure
