"""
Shadows in a fisheye
====================

A shadow map is a depth-only view from the light. A lamp looks around with two
paraboloid views, the sun with one orthographic view; each pixel asks both.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

# %%
# By day: the sun of the built-in scene, whose map holds the whole courtyard. A map has
# 1024 texels along a side, or `shadow_size` of them.
day = mp.builtin_scene("patio", 512, 512, triangles=120_000)
camera = day.camera

# %%
# By night: a lamp between the columns, and a little light from everywhere.
lamp = mp.PointLight((2.5, -1.2, 2.2), (9.0, 6.5, 4.0))
night = replace(day, lights=(lamp,), ambient=(0.02, 0.025, 0.05), background=(0.01, 0.01, 0.03))

v, u = np.indices((512, 512)) + 0.5
seen = camera.ray(np.stack([u, v], -1)).valid
figure, axes = plt.subplots(2, 2, figsize=(6.4, 6.6))
for row, scene, name in zip(axes, (day, night), ("sun", "lamp"), strict=True):
    for one, shadows in zip(row, (False, True), strict=True):
        image = mp.render(camera, scene, shadows=shadows)
        one.imshow(np.dstack([np.clip(image, 0, 1) ** (1 / 2.2), seen]))
        one.set_title(f"{name}, shadows={shadows}")
        one.set_axis_off()

# %%
# `visible` asks a map about any points; normals make the test finer, since a surface's
# own plane tells how deep each texel may be. What more texels still change is at the
# edges of the shadows.
hits = mp.rasterize(camera, day)
points = hits.points[hits.mask]
normals = day.mesh.face_normals[hits.triangle[hits.mask]]
fine = mp.shadow_map(day, day.lights[0], 2048).visible(points, normals)
print(f"{fine.mean():.1%} of the pixels are reached by the sun")
for size in (128, 256, 512, 1024):
    lit = mp.shadow_map(day, day.lights[0], size).visible(points, normals)
    print(f"{size:4d} texels: {np.mean(lit != fine):.2%} differ from 2048 texels")
