"""
What straight edges get wrong
=============================

The usual way to draw through a fisheye is to project vertices and to keep the edges
between them straight. How far off is each pixel, and what does tessellation help?
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

SIZE = 512
scene = mp.builtin_scene("temple", SIZE, SIZE)
camera = scene.camera

v, u = np.indices((SIZE, SIZE)) + 0.5
centers = np.stack([u, v], -1)
seen = camera.ray(centers).valid


def projection_error(hits):
    """Pixels from each center to the exact image of the point that is shown there."""
    image = camera.project(hits.points)
    distance = np.linalg.norm(image.pixel[..., 0, :] - centers, axis=-1)
    return np.where(hits.mask & image.valid[..., 0], distance, np.nan)


# %%
# `vertex` splits every edge 2**level times before it projects. An arc leaves its chord by
# the square of its length, so each level divides the error by four. That holds where all
# of a triangle is in view. A triangle that runs behind the eye has a corner for which
# there is no good place in the image, and more levels only make the damage rarer.
settings = {"invert": {}} | {f"vertex, level {n}": {"level": n} for n in range(5)}
whole = camera.project(scene.mesh.corners).valid[..., 0].all(-1)
images, errors = {}, {}
print("95 % of the errors are below       triangles in view    all triangles")
for label, setting in settings.items():
    method = label.split(",")[0]
    hits = mp.rasterize(camera, scene.mesh, method=method, **setting)
    images[label] = mp.shade(hits, scene)
    errors[label] = projection_error(hits)
    in_view = errors[label][hits.mask & whole[hits.triangle]]
    pair = np.nanpercentile(in_view, 95), np.nanpercentile(errors[label], 95)
    print(f"{label:32s} {pair[0]:16.5f} px {pair[1]:13.5f} px")

# %%
# Exact above, level 2 below: 16 triangles in place of each one.
figure, axes = plt.subplots(2, 3, figsize=(7.6, 5.0))
shown = ("invert", "vertex, level 2")
for label, (left, middle, right) in zip(shown, axes, strict=True):
    image = np.dstack([np.clip(images[label], 0, 1) ** (1 / 2.2), seen])
    left.imshow(image)
    left.set_title(label)
    middle.imshow(image[60:260, 30:230])
    middle.set_title("enlarged")
    scale = right.imshow(errors[label], norm="log", vmin=1e-6, vmax=30, cmap="magma")
    right.set_title("projection error")
    figure.colorbar(scale, ax=right, fraction=0.045, label="pixels")
    for one in (left, middle, right):
        one.set_axis_off()
