"""A cube through a pinhole and through a single-pole occlusion camera: rays from the side, and both pictures."""

import functools

import numpy as np
from matplotlib import pyplot
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, Rectangle

import mpcam as mp

FORMAT = "png"
HALF, DISTANCE, ASIDE, SIZE = 0.55, 4.0, 1.6, 420
RADIUS = HALF * np.sqrt(3)
FACES = ("#c2560b", "#0b62c4", "#0a7f6b", "#8a3fb0", "#8a6d00", "#b0306a")


@functools.cache
def cameras():
    """A pinhole and the other one by name: aside by 0 and by more, else the same."""
    return {
        name: mp.SinglePoleOcclusion.around(SIZE, SIZE, (0, 0, 0), RADIUS, (0, -DISTANCE, 0), aside)
        for name, aside in (("pinhole", 0.0), ("single-pole occlusion camera", ASIDE))
    }


@functools.cache
def pictures():
    """(SIZE, SIZE, 4) pictures by name: a color for each face, squares on it, nothing around it."""
    mesh = mp.builtin_mesh("cube").transformed(np.diag([HALF, HALF, HALF, 1.0]))
    found = {}
    for name, camera in cameras().items():
        hits = mp.rasterize(camera, mesh)
        a, b, c = np.moveaxis(mesh.corners, 1, 0)
        normals, places = np.cross(b - a, c - a)[hits.triangle], np.asarray(hits.points)
        axis = np.abs(normals).argmax(-1)
        face = 2 * axis + (np.take_along_axis(normals, axis[..., None], -1)[..., 0] > 0)
        on_face = np.arange(3) != axis[..., None]
        dark = (np.floor((places + HALF) / (HALF / 2)) * on_face).sum(-1) % 2
        color = np.array([to_rgb(c) for c in FACES])[face] * np.where(dark, 0.72, 1.0)[..., None]
        found[name] = np.concatenate([np.where(hits.mask[..., None], color, 0), hits.mask[..., None]], -1)
    return found


def side_view(axes, camera, theme, color):
    """Rays of the middle column of the image, seen from the side."""
    axes.add_patch(Circle((DISTANCE, 0), RADIUS, fill=False, color=theme.weak, linewidth=0.7, linestyle=":"))
    corner = DISTANCE - HALF, -HALF
    axes.add_patch(Rectangle(corner, 2 * HALF, 2 * HALF, facecolor=theme.grid, edgecolor=theme.text))
    for v in np.linspace(0, SIZE, 15):
        pieces = camera.with_pose(np.eye(4)).ray_pieces([0.5 * SIZE, v])
        for k in np.flatnonzero(pieces.valid):
            length = min(pieces.end[k] - pieces.start[k], 9.0)
            ends = pieces.origin[k] + np.outer([0, length], pieces.direction[k])
            axes.plot(ends[:, 2], -ends[:, 1], color=color, linewidth=0.8)
    for z in (camera.near, camera.far):
        axes.axvline(z, color=theme.weak, linewidth=0.5, linestyle="--")
    axes.plot(0, 0, "o", color=theme.text, markersize=3)
    axes.set_xlim(-0.1, DISTANCE + 2.1)
    axes.set_ylim(-1.65, 1.65)
    axes.set_aspect("equal")
    axes.set_axis_off()


def draw(theme):
    figure, axes = pyplot.subplots(2, 2, figsize=(theme.width, 4.6), width_ratios=(2.0, 1.1))
    for row, color, (name, camera) in zip(axes, theme.palette, cameras().items(), strict=False):
        side_view(row[0], camera, theme, color)
        row[0].set_title(name)
        row[1].imshow(pictures()[name], interpolation="antialiased")
        row[1].set_axis_off()
    return figure
