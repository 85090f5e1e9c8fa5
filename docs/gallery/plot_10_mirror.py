"""
Near things in a curved mirror
==============================

A mirror that bulges here and is hollow there sees what no single point sees. A hundred
small cameras on it do.
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

# %%
# A wavy mirror lies on the ground, with things standing around it.
surface = mp.Surface.wave(size=2.4, height=0.09, waves=1.0)
rng = np.random.default_rng(3)
cube, ball = mp.builtin_mesh("cube"), mp.builtin_mesh("sphere", triangles=1280)
things = []
for number, bearing in enumerate(np.linspace(0.2, np.pi - 0.2, 7)):
    place = np.diag([0.22, 0.22, 0.22 + 0.3 * rng.uniform(), 1.0])
    place[:3, 3] = 1.5 * np.cos(bearing), 1.2 * np.sin(bearing), place[2, 2] + 0.05
    shape = (cube, ball)[number % 2]
    color = mp.Material(tuple(rng.uniform(0.15, 0.95, 3)))
    things.append(mp.Mesh(shape.transformed(place).vertices, shape.faces, materials=color))
camera = mp.Pinhole.from_fov(480, 300, 0.75, mp.look_at((0.1, -3.4, 1.9), (0, 0.25, 0.15)))
lights = (mp.DirectionalLight((0.4, 0.8, -0.9)),)
scene = mp.Scene(tuple(things), camera, lights, background=(0.55, 0.68, 0.85), mirror=mp.Mirror(surface))

# %%
# `render` shows the scene in its mirror. Rays of the true surface are the truth; an
# environment map, taken in the mirror's middle, is what games do.
truth = mp.render(camera, scene, method="raytrace")
pictures = {
    "104 camera triangles": mp.render(camera, scene, triangles=104),
    "environment map": mp.render(camera, scene, method="environment"),
    "rays of the true surface": truth,
}
for name, picture in pictures.items():
    print(f"{name}: mean error {np.abs(picture - truth).mean():.4f}")

# %%
# How far the rays are off falls with the square of the triangles' size.
for triangles in (26, 104, 416):
    cams = mp.decompose(surface, camera, triangles)
    error = mp.ray_error(cams, surface, camera)
    print(f"{cams.count} camera triangles: median {error.median:.3f} at {error.distance:.1f} away")

figure, axes = plt.subplots(1, 3, figsize=(9.6, 2.3))
for one, (name, picture) in zip(axes, pictures.items(), strict=True):
    one.imshow(np.clip(picture, 0, 1) ** (1 / 2.2))
    one.set_title(name)
    one.set_axis_off()
