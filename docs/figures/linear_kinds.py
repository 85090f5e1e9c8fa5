"""Rays of the eight kinds of general linear cameras, and the slits that they meet."""

import numpy as np
from matplotlib import pyplot

import mpcam as mp

SIZE = (64, 64)
GL = mp.GeneralLinear


def cameras():
    """Each kind by its title, with an image about as large as what it sees at a depth of 2."""
    crossed = GL.cross_slit(*SIZE, ((0, 0, 0), (1, 0, 0)), ((0, 0, 1), (0, 1, 0)), (0, 0, 2.2), 2.4, (0, -1, 0))
    return {
        "pinhole": GL.pinhole(*SIZE, 40.0),
        "orthographic": GL.orthographic(*SIZE, 32.0),
        "pushbroom": GL.pushbroom(*SIZE, 1.6 / 64, 45.0),
        "cross_slit": crossed,
        "pencil": GL.pencil(*SIZE, 1.2 / 64, 45.0),
        "twisted_orthographic": GL.twisted_orthographic(*SIZE, 0.7, 40.0),
        "bilinear": GL.bilinear(*SIZE, 0.6, 0.0, 48.0),
        "epi": GL.epi(*SIZE, 1.6 / 64, 45.0),
    }


def draw(theme):
    figure = pyplot.figure(figsize=(theme.width, 4.3))
    across = np.linspace(0.5, 63.5, 5)
    for number, (title, camera) in enumerate(cameras().items()):
        axes = figure.add_subplot(2, 4, number + 1, projection="3d")
        rays = camera.ray(np.stack(np.meshgrid(across, across), -1).reshape(-1, 2))
        end = rays.origin + rays.direction * (2.0 / rays.direction[:, 2:])
        for row, (start, stop) in enumerate(zip(rays.origin, end, strict=True)):
            color = theme.palette[(row // 5) % len(theme.palette)]
            axes.plot(*np.stack([start, stop]).T[[0, 2, 1]] * [[1], [1], [-1]], color=color, linewidth=0.7)
        for slit in camera.slits:
            ends = slit.point + np.outer([-1.0, 1.0], slit.direction) * 0.9
            middle = ends - [slit.point[0], slit.point[1], 0.0]
            axes.plot(*middle.T[[0, 2, 1]] * [[1], [1], [-1]], color=theme.text, linewidth=2.2)
        if camera.center is not None:
            x, y, z = camera.center
            axes.plot([x], [z], [-y], "o", color=theme.text, markersize=4)
        axes.set_title(title, pad=-2)
        axes.set_axis_off()
        axes.set_box_aspect((1, 1.25, 1))
        axes.set_xlim(-1.3, 1.3)
        axes.set_ylim(0, 2)
        axes.set_zlim(-1.3, 1.3)
        axes.view_init(22, -62)
    return figure
