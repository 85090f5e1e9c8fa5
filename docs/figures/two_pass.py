"""What the second pass of two-pass rasterization draws: samples of two triangles, as small triangles."""

from typing import Any

import numpy as np
from matplotlib import pyplot

import mpcam as mp


def draw(theme):
    camera = mp.GeneralLinear.pushbroom(
        300, 220, 2.4 / 300, 90.0, camera_from_world=mp.look_at((0, -1, 0.6), (0, 2, 0.1))
    )
    corners = np.array([[-1.3, 0.2, -0.6], [1.2, -0.5, -0.4], [0.9, 1.6, 0.9], [-1.0, 2.6, 0.5]])
    mesh = mp.Mesh(corners, [[0, 1, 2], [0, 2, 3]])
    figure, panels = pyplot.subplots(1, 3, figsize=(theme.width, 2.1), sharex=True, sharey=True)
    for axes, patch in zip(panels, (3, 5, 10), strict=True):
        prepared: Any = mp.prepare(camera, mesh, "two_pass", patch=patch)
        exact = mp.rasterize(camera, mesh).mask
        rows = np.asarray(prepared.place(prepared.vertices)[0].numpy()).reshape(-1, 4)
        faces = np.asarray(prepared.faces.numpy()).reshape(-1, 3)
        found = prepared.frame().mask
        axes.imshow(np.where(exact, 0.0, np.nan), cmap="gray", alpha=0.25, extent=(0, 300, 220, 0))
        axes.triplot(rows[:, 0], rows[:, 1], faces, color=theme.palette[0], linewidth=0.6)
        axes.plot(rows[:, 0], rows[:, 1], ".", color=theme.palette[1], markersize=2.5)
        axes.set_title(f"patch {patch}: {(found != exact).sum()} pixels off")
        axes.set_xlim(0, 300)
        axes.set_ylim(220, 0)
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
    return figure
