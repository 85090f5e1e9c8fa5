"""A ray over a depth image: its curved projection, with coarse steps and the fine ones at the hit."""

import functools

import numpy as np

import mpcam as mp

FORMAT = "png"
COARSE, FINE = 6.0, 1.0


def scene():
    """Balls and a box on a floor."""
    floor = mp.Mesh([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [(0, 1, 2), (0, 2, 3)])
    parts = [mp.Mesh(floor.vertices, floor.faces, materials=mp.Material((0.55, 0.55, 0.5)))]
    things = (("sphere", (-0.7, 0.2, 0.45), 0.45), ("sphere", (0.55, 0.5, 0.6), 0.6), ("cube", (0.1, -0.7, 0.2), 0.2))
    for (name, place, size), color in zip(things, ((0.8, 0.3, 0.2), (0.25, 0.45, 0.8), (0.85, 0.7, 0.2)), strict=True):
        pose = np.diag([size, size, size, 1.0])
        pose[:3, 3] = place
        thing = mp.builtin_mesh(name, **({"triangles": 5120} if name == "sphere" else {})).transformed(pose)
        parts.append(mp.Mesh(thing.vertices, thing.faces, materials=mp.Material(color)))
    return mp.Scene(
        tuple(parts), lights=(mp.DirectionalLight((0.5, 0.6, -1.0), (0.8, 0.8, 0.8)),), ambient=(0.25, 0.25, 0.25)
    )


@functools.cache
def parts():
    """The depth image, and per ray the pixels of its projection, of coarse and fine steps, and of its hit."""
    camera = mp.Radial.equisolid(400, 300, mp.look_at((0.0, -1.75, 1.3), (0.0, 0.1, 0.4)), fov=3.0)
    image = mp.DepthImage.render(camera, scene())
    found = []
    for start, end in (((-1.9, -1.3, 0.1), (0.5, 0.25, 0.9)), ((1.9, -1.2, 1.6), (-0.8, 0.0, 0.5))):
        origin, way = np.array(start), np.array(end) - start
        hit = image.intersect(origin, way)
        length = np.linalg.norm(way)
        reach = float(hit.distance) if hit.hit else 1.4 * length
        line = camera.project(origin + np.linspace(0, reach, 4001)[:, None] * way / length).pixel[:, 0]
        along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        last = COARSE * np.floor(along[-1] / COARSE)
        places = np.arange(0, last + 1, COARSE), np.arange(last, along[-1], FINE)
        steps = [np.stack([np.interp(place, along, line[:, k]) for k in range(2)], -1) for place in places]
        found.append((line, *steps, hit.pixel if hit.hit else None))
    return image, found


def draw(theme):
    from matplotlib import pyplot

    image, rays = parts()
    color = np.clip(np.asarray(image.color), 0, 1) ** (1 / 2.2)
    figure, (whole, near) = pyplot.subplots(1, 2, figsize=(theme.width, 2.6), width_ratios=(4, 3))
    for one, size in ((whole, 3), (near, 9)):
        one.imshow(color, extent=(0, image.camera.width, image.camera.height, 0), interpolation="nearest")
        one.set_axis_off()
        for line, coarse, fine, hit in rays:
            one.plot(*line.T, color="#ffb000", linewidth=0.8)
            one.scatter(*coarse.T, s=size, color="#ffb000", linewidths=0)
            one.scatter(*fine.T, s=0.5 * size, color="#dc267f", linewidths=0)
            if hit is not None:
                one.scatter(*hit, s=3 * size, facecolors="none", edgecolors="#dc267f", linewidths=0.9)
    place = rays[0][3] if rays[0][3] is not None else rays[0][0][-1]
    near.set_xlim(place[0] - 24, place[0] + 16)
    near.set_ylim(place[1] + 15, place[1] - 15)
    whole.set_xlim(0, image.camera.width)
    whole.set_ylim(image.camera.height, 0)
    return figure
