"""
A profile of your own
=====================

Any increasing r = f(θ) with f(0) = 0 makes a camera. It is written once, with the
functions of `mpcam.math`, and then runs in NumPy, in JAX and inside the kernels.
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp
from mpcam.math import sin, tan

SIZE = 512
scene = mp.builtin_scene("characters", SIZE, SIZE, triangles=60_000)
pose = scene.camera.camera_from_world

# %%
# Three profiles for 200 degrees: one that enlarges the rim, one that enlarges the middle,
# as an eye does, and one that enlarges a ring.
fov = np.radians(200)
profiles = {
    "tan(θ/2.2)": lambda theta: tan(theta / 2.2),
    "θ/(θ + 0.4)": lambda theta: theta / (theta + 0.4),
    "θ - 0.3 sin 2θ": lambda theta: theta - 0.3 * sin(2 * theta),
}
cameras = {}
for name, function in profiles.items():
    cameras[name] = mp.Radial.from_function(SIZE, SIZE, function, pose, fov, name=name)

# %%
# The slope and the inverse of f are found numerically where they are not given.
# `convex` tells whether the images of straight lines bulge away from the center
# everywhere: then tangents bound them tightly, else wider annular sectors do. The hits
# are exact in both cases; only the number of tests differs.
v, u = np.indices((SIZE, SIZE)) + 0.5
figure, axes = plt.subplots(1, 3, figsize=(7.6, 2.8))
for one, (name, camera) in zip(axes, cameras.items(), strict=True):
    hits = mp.rasterize(camera, scene.mesh)
    image = camera.project(hits.points[hits.mask])
    centers = np.stack([u, v], -1)[hits.mask]
    error = np.linalg.norm(image.pixel[:, 0] - centers, axis=-1)
    print(
        f"{name:15s} convex {camera.profile.convex!s:5s}",
        f"tests per hit {hits.stats.overdraw:6.2f}",
        f"95 % of errors below {np.percentile(error, 95):.5f} px",
    )
    linear = mp.shade(hits, scene)
    seen = camera.ray(np.stack([u, v], -1)).valid
    one.imshow(np.dstack([np.clip(linear, 0, 1) ** (1 / 2.2), seen]))
    one.set_title(f"r = {name}")
    one.set_axis_off()

# %%
# What cannot be a projection is refused, with the reason.
try:
    mp.Radial.from_function(SIZE, SIZE, lambda theta: sin(theta), pose, fov)
except mp.InputError as error:
    print(str(error).replace(": ", ":\n"))
