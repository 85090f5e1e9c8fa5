"""
What a mirror ball sees
=======================

Two paraboloid views back to back hold what is seen from one point in all directions. A
mirror that is small against its distance from everything else needs nothing more.
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

# %%
# The scene around a point of the courtyard. Each view is a disc that sees a little more
# than half of all directions, so that look-ups at the seam find four pixels too.
scene = mp.builtin_scene("patio", triangles=120_000)
place = np.array([1.0, 0.4, 1.7])
around = mp.environment_map(scene, place, size=512, shadows=True)
print(around)

# %%
# `lookup` takes world directions of any shape. Along a pixel's ray it gives what the
# pixel sees; the error is that of bilinear interpolation between two pictures.
camera = mp.Radial.equidistant(400, 400, mp.look_at(place, place + (1, -0.7, 0.3)))
direct = mp.render(camera, scene, shadows=True)
v, u = np.indices((400, 400)) + 0.5
ray = camera.ray(np.stack([u, v], -1))
difference = np.abs(around.lookup(ray.direction) - direct)[ray.valid].max(-1)
print(f"half of the pixels differ by less than {np.median(difference):.4f}")

# %%
# A mirror ball at that point, seen from two meters away: the view direction reflected
# about the normal is where to look. Past the ball, the same map serves as the backdrop.
ball = mp.builtin_mesh("sphere", triangles=20_480)
eye = np.array([-2.6, -1.9, 0.3])
close = mp.Pinhole.from_fov(480, 400, 0.75, mp.look_at(eye, (0, 0, 0)))
v, u = np.indices((400, 480)) + 0.5
view = close.ray(np.stack([u, v], -1)).direction
hits = mp.rasterize(close, ball)
normal = mp.interpolate(hits, ball.vertices)  # of a ball of radius 1 around the origin
normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
mirrored = view - 2 * (view * normal).sum(-1, keepdims=True) * normal
image = around.lookup(np.where(hits.mask[..., None], mirrored, view))
image[hits.mask] *= (0.93, 0.9, 0.8)

figure, axes = plt.subplots(1, 3, figsize=(7.6, 2.5), width_ratios=(1, 1, 1.2))
for one, disc, title in zip(axes, around.images, ("towards +x", "towards -x"), strict=False):
    v, u = np.indices(disc.shape[:2]) + 0.5
    seen = around.cameras[0].ray(np.stack([u, v], -1)).valid
    one.imshow(np.dstack([np.clip(disc, 0, 1) ** (1 / 2.2), seen]))
    one.set_title(title)
axes[2].imshow(np.clip(image, 0, 1) ** (1 / 2.2))
axes[2].set_title("mirror ball")
for one in axes:
    one.set_axis_off()
