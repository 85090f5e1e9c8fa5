"""A maze from above with the frusta of a graph camera and some of its rays, and the two pictures from the entrance."""

import functools

import numpy as np
from matplotlib import pyplot
from matplotlib.patches import Polygon, Rectangle

import mpcam as mp

FORMAT = "png"
SIZE = (560, 420)
PLAN = """
#######
#  #  #
## # ##
#    ##
## ####
## ####
"""
COLORS = ("#d9822b", "#3b7dd8", "#3f9b6b", "#b05bb0", "#c9b23c", "#c05046", "#4aa5b5")


def wall_mesh(plan):
    """Walls, each cell's sides with a color of its own, and a floor of two grays."""
    parts = []
    for row, column in np.argwhere(plan.open):
        low = np.array([*plan.corner, 0.0]) + plan.cell * np.array([column, row, 0.0])
        right, ahead, up = np.diag([plan.cell, plan.cell, plan.height])
        gray = 0.35 if (row + column) % 2 else 0.6
        parts.append(_quad(low, right, ahead, (gray, gray, gray)))
        color = tuple((int(COLORS[(2 * row + column) % len(COLORS)][i : i + 2], 16) / 255) ** 2.2 for i in (1, 3, 5))
        for step, start, along in (
            ((0, -1), low, ahead),
            ((0, 1), low + right, ahead),
            ((-1, 0), low, right),
            ((1, 0), low + ahead, right),
        ):
            r, c = row + step[0], column + step[1]
            if 0 <= r < len(plan.open) and 0 <= c < plan.open.shape[1] and not plan.open[r, c]:
                parts.append(_quad(start, along, up, color))
    return mp.Mesh.concatenate(parts)


def _quad(start, first, second, color):
    corners = [start, start + first, start + first + second, start + second]
    return mp.Mesh(corners, [(0, 1, 2), (0, 2, 3)], materials=(mp.Material(color),))


@functools.cache
def made():
    """Plan, camera, and the pictures of the graph camera and of its root."""
    plan = mp.MazePlan.drawn(PLAN, 2.0, 1.8)
    camera = mp.GraphCamera.through(plan, *SIZE)
    sun, sky = ((0.3, 0.6, -0.7), (0.5, 0.5, 0.5)), ((-0.5, -0.4, -0.6), (0.3, 0.3, 0.3))
    lights = (mp.DirectionalLight(*sun), mp.DirectionalLight(*sky))
    scene = mp.Scene((wall_mesh(plan),), lights=lights, ambient=(0.45, 0.45, 0.45), background=(0.8, 0.88, 0.97))
    pictures = [np.clip(mp.render(given, scene), 0, 1) ** (1 / 2.2) for given in (camera, camera.root)]
    return plan, camera, pictures


def outline(camera, number):
    """Corners of a frustum from above, in order; None where it does not cross the height of the root."""
    height = camera.root.eye[2]
    planes = camera.frustum_planes[number]
    flat = np.column_stack([planes[:, :2], planes[:, 2] * height + planes[:, 3]])
    corners = np.array([(-40.0, -40.0), (40.0, -40.0), (40.0, 40.0), (-40.0, 40.0)])
    for a, b, c in flat:
        kept = []
        for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            u, v = p @ (a, b) + c, q @ (a, b) + c
            if u <= 1e-9:
                kept.append(p)
            if (u <= 1e-9) != (v <= 1e-9):
                kept.append(p + u / (u - v) * (q - p))
        corners = np.array(kept).reshape(-1, 2)
    return corners


def draw(theme):
    plan, camera, pictures = made()
    figure, (above, *places) = pyplot.subplots(1, 3, figsize=(theme.width, 2.4), width_ratios=[0.86, 1, 1])
    for row, column in np.argwhere(~plan.open):
        corner = (plan.corner[0] + plan.cell * column, plan.corner[1] + plan.cell * row)
        above.add_patch(Rectangle(corner, plan.cell, plan.cell, color=theme.grid))
    for number in range(len(camera.frustum_parents)):
        color = theme.palette[number % len(theme.palette)]
        above.add_patch(Polygon(outline(camera, number), facecolor=color, alpha=0.3, edgecolor=color, linewidth=0.8))
    columns = np.linspace(4, SIZE[0] - 4, 30)
    pieces = camera.ray_pieces(np.stack([columns, np.full(30, 0.5 * SIZE[1])], -1))
    for origin, along, start, end, valid in zip(*pieces, strict=True):
        ends = np.where(np.isfinite(end), end, start + 1.0)
        points = np.concatenate([origin[:1], (origin + (ends - start)[:, None] * along)[valid]])
        above.plot(*points[:, :2].T, color=theme.text, linewidth=0.5)
    rows, across = plan.open.shape
    above.set_xlim(plan.corner[0], plan.corner[0] + plan.cell * across)
    above.set_ylim(plan.corner[1] - 0.6 * plan.cell, plan.corner[1] + plan.cell * rows)
    above.set_aspect("equal")
    above.set_axis_off()
    above.set_title("frusta and rays, from above")
    for place, picture, title in zip(places, pictures, ("graph camera", "pinhole, from the same eye"), strict=True):
        place.imshow(picture, interpolation="antialiased")
        place.set_title(title)
        place.set_axis_off()
    return figure
