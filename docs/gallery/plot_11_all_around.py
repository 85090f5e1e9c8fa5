"""
A thing from all sides
======================

Crossed slits around a thing unroll it: each column of the picture looks through the axis
from another place of a circle.
"""

import numpy as np
from matplotlib import pyplot

import mpcam as mp

figures = mp.builtin_scene("characters")
middle = np.array([0.0, 0.0, 1.0])

# %%
# A pinhole sees one side. The panorama has 36 cameras in a row, all with the same axis, and
# no seams between them.
pinhole = mp.Pinhole.from_fov(480, 300, 0.9, mp.look_at((0.0, -9.0, 1.6), middle))
around = mp.GeneralLinears.around(middle, 14.0, 3.4, 1200, 300)
print(around, around.piece(0).kind)

# %%
# Both are rasterized by the same kernels, without a ray being traced.

figure, panels = pyplot.subplots(2, 1, figsize=(8, 5), height_ratios=(1, 1))
for axes, camera in zip(panels, (pinhole, around), strict=True):
    axes.imshow(np.clip(mp.render(camera, figures), 0, 1) ** (1 / 2.2))
    axes.set_axis_off()
