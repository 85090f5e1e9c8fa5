"""
A first render
==============

A scene, a camera that sees 180 degrees, and three pictures of what each pixel sees first.
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

# %%
# The scene brings a camera: a paraboloid projection of half of all directions, in the
# middle of a street.
scene = mp.builtin_scene("facade", width=768, height=768)
camera = scene.camera
image = mp.render(camera, scene)  # (768, 768, 3), linear light
print(image.shape, image.dtype)

# %%
# `render` is two steps in one. `rasterize` finds the first hit of every pixel's ray:
# which triangle, how far away, where on it. `shade` turns hits into colors;
# `interpolate` gives any other attribute of the mesh at the hits, here the position.
hits = mp.rasterize(camera, scene.mesh)
normals = mp.shade(hits, scene, shading="normal")
position = mp.interpolate(hits, scene.mesh.vertices)

print(f"{hits.mask.mean():.1%} of the pixels see the mesh")
depth = hits.depth[hits.mask]
print(f"nearest {depth.min():.2f} m, farthest {depth.max():.2f} m")
print(f"highest {position[..., 2].max():.2f} m")

# %%
# Images are linear light, and a screen wants them encoded. `mp.write_image` does so
# for `.png`; an `.exr` keeps the numbers as they are, with depth and camera:
# `mp.write_image("facade.exr", image, depth=hits.depth, camera=camera)`.


def picture(linear):
    """For matplotlib: a screen's curve, about; clear where the camera sees nothing."""
    v, u = np.indices(linear.shape[:2]) + 0.5
    seen = camera.ray(np.stack([u, v], -1)).valid
    return np.dstack([np.clip(linear, 0, 1) ** (1 / 2.2), seen])


figure, axes = plt.subplots(1, 3, figsize=(7.6, 2.5))
axes[0].imshow(picture(image))
axes[0].set_title('shading="light"')
axes[1].imshow(picture(normals))
axes[1].set_title('shading="normal"')
depth = np.where(hits.mask, hits.depth, np.nan)
shown = axes[2].imshow(depth, vmax=15)
axes[2].set_title("depth, meters")
figure.colorbar(shown, ax=axes[2], fraction=0.045)
for one in axes:
    one.set_axis_off()
