"""
Form factors and ambient occlusion
==================================

From a surface element, what share of the hemisphere is covered? A fisheye at the element
that looks along its normal answers by counting pixels: in the cosine-sphere projection
area is solid angle times cosine, in the equal-area projection it is solid angle.
"""

import matplotlib.pyplot as plt
import numpy as np

import mpcam as mp

# %%
# A ball of radius R at distance d along the normal has the form factor (R / d)². The
# error of counting falls faster than one over the size of the view.
radius, distance = 0.5, 1.3
placed = np.diag([radius, radius, radius, 1.0])
placed[2, 3] = distance
ball = mp.builtin_mesh("sphere", triangles=81_920).transformed(placed)
sizes = np.array([8, 16, 32, 64, 128, 256])
angles = np.linspace(0, 1.1, 12)
errors = []
for size in sizes:
    normals = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], -1)
    found = mp.form_factor(ball, np.zeros((12, 3)), normals, int(size))
    exact = (radius / distance) ** 2 * np.cos(angles)
    errors.append(np.sqrt(np.mean((found - exact) ** 2)))
    print(f"{size:4d} pixels: error {errors[-1]:.1e}")

# %%
# Ambient occlusion is the rest: 1 under a free sky, 0 in a closed box. Here it is worked
# out at the vertices, once for each weight, and becomes a vertex color. Elements are
# moved off the surface by 1e-5 of the mesh's size, so as not to see their own face.
floor = mp.builtin_mesh("plane", triangles=2 * 40**2).transformed(np.diag([3, 3, 1, 1]))
box = mp.builtin_mesh("cube", triangles=12 * 6**2).flat()
body = mp.builtin_mesh("sphere", triangles=320)
body = mp.Mesh(body.vertices, body.faces, normals=body.vertices)


def moved(mesh, size, x, y):
    matrix = np.diag([size, size, size, 1.0])
    matrix[:3, 3] = x, y, size * -mesh.bounds[0, 2]
    return mesh.transformed(matrix)


parts = [moved(box, 0.32, 0.5, 0.45), moved(body, 0.38, -0.45, 0.1)]
parts += [moved(body, 0.17, 0.3, -0.45)]
mesh = mp.Mesh.concatenate([floor, *parts])
baked = {
    weight: mp.ambient_occlusion(mesh, mesh.vertices, mesh.normals, 32, weight) for weight in ("cosine", "uniform")
}
for weight, open_share in baked.items():
    print(f"{weight:8s} {len(open_share)} vertices, mean {open_share.mean():.3f}")

pose = mp.look_at((-0.5, -1.9, 1.0), (0, 0, 0.2))
camera = mp.Radial.equidistant(420, 420, pose, fov=1.5, radius=300)
figure, axes = plt.subplots(1, 3, figsize=(7.6, 2.6))
for one, (weight, open_share) in zip(axes, baked.items(), strict=False):
    colored = mp.Mesh(
        mesh.vertices,
        mesh.faces,
        colors=np.repeat(open_share[:, None], 3, axis=1),
        materials=mp.Material((1, 1, 1)),
    )
    image = mp.render(camera, colored, shading="color")
    seen = mp.rasterize(camera, colored).mask
    one.imshow(np.dstack([np.clip(image, 0, 1), seen]))
    one.set_title(f'weight="{weight}"')
    one.set_axis_off()
axes[2].loglog(sizes, errors, "o-", label="form factor of a ball")
axes[2].loglog(sizes, 0.1 / sizes, "--", label="one over the size")
axes[2].set(xlabel="pixels along a side", title="error")
axes[2].legend()
axes[2].grid(True)
