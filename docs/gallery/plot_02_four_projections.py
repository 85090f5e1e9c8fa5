"""
Four projections of one place
=============================

The same eye, the same half of all directions, four profiles r = f(θ). They agree at the
center of the image and at its rim, and share out the radius between differently.
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

SIZE = 640
scene = mp.builtin_scene("temple", SIZE, SIZE)
pose = scene.camera.camera_from_world
cameras = {
    "paraboloid": mp.Radial.paraboloid(SIZE, SIZE, pose),
    "cosine_sphere": mp.Radial.cosine_sphere(SIZE, SIZE, pose),
    "equisolid": mp.Radial.equisolid(SIZE, SIZE, pose),
    "equidistant": mp.Radial.equidistant(SIZE, SIZE, pose),
}

# %%
# How large a part of the image does a small patch of directions get? The solid angle of
# each pixel says so: the cross product of the two steps from a ray to its neighbors.
v, u = np.indices((SIZE, SIZE)) + 0.5
centers = np.stack([u, v], -1)


def solid_angle(camera):
    """Of each pixel, steradians (H, W); NaN where the camera sees nothing."""
    step = 0.01
    ray = camera.ray(centers)
    right = camera.ray(centers + [step, 0])
    down = camera.ray(centers + [0, step])
    steps = (right.direction - ray.direction, down.direction - ray.direction)
    area = np.linalg.norm(np.cross(*steps), axis=-1) / step**2
    return np.where(ray.valid & right.valid & down.valid, area, np.nan)


figure, axes = plt.subplots(2, 4, figsize=(7.6, 4.1))
for (name, camera), top, bottom in zip(cameras.items(), *axes, strict=True):
    image = np.clip(mp.render(camera, scene), 0, 1) ** (1 / 2.2)
    area = solid_angle(camera)
    print(f"{name:14s} sees {np.nansum(area) / np.pi:.2f} pi steradians")
    top.imshow(np.dstack([image, camera.ray(centers).valid]))
    top.set_title(name)
    ratio = area / area[SIZE // 2, SIZE // 2]
    shown = bottom.imshow(ratio, norm="log", vmin=0.1, vmax=10, cmap="RdBu_r")
    for one in (top, bottom):
        one.set_axis_off()
figure.colorbar(shown, ax=axes, fraction=0.02, label="solid angle / center's")

# %%
# Equal-area (equisolid) is white all over. The paraboloid gives the rim four times the
# pixels per solid angle that the center has, the cosine sphere next to none.
