"""
A field of view of 270 degrees
==============================

A fisheye may see behind itself. Triangles that cross the horizon, or surround the eye,
need no cutting: each pixel has its ray, and each ray is asked what it hits.
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

SIZE = 640
scene = mp.builtin_scene("temple", SIZE, SIZE)
pose = scene.camera.camera_from_world
camera = mp.Radial.equidistant(SIZE, SIZE, pose, fov=np.radians(270))
print(camera.domain)

# %%
# What lies behind the camera has an image too: project a point half a meter behind it.
behind = camera.eye - 0.5 * camera.ray([SIZE / 2, SIZE / 2]).direction
above = behind + [0, 0, 1.0]
image = camera.project([behind, above])
print("valid:", image.valid[:, 0], "pixel:", image.pixel[1, 0].round(1))

# %%
# A profile has an end. The cosine sphere cannot reach beyond 180 degrees, and says so;
# nor can half a cube cover this camera.
for attempt in (
    lambda: mp.Radial.cosine_sphere(SIZE, SIZE, pose, fov=np.radians(270)),
    lambda: mp.rasterize(camera, scene.mesh, method="hemicube"),
):
    try:
        attempt()
    except mp.InputError as error:
        print(error)

# %%
# A whole cube can, at the price of its texels: what one texel holds is shown by all the
# pixels that look into it.
v, u = np.indices((SIZE, SIZE)) + 0.5
seen = camera.ray(np.stack([u, v], -1)).valid
figure, axes = plt.subplots(1, 3, figsize=(7.6, 2.8))
settings = [("invert", {})]
settings += [("cubemap", {"resolution": texels}) for texels in (64, 256)]
for one, (method, setting) in zip(axes, settings, strict=True):
    linear = mp.render(camera, scene, method, **setting)
    one.imshow(np.dstack([np.clip(linear, 0, 1) ** (1 / 2.2), seen]))
    one.set_title(" ".join([method, *map(str, setting.values())]))
    one.set_axis_off()
