"""One street through a distorted lens, a panorama, and rays that were turned about the middle of the image."""

import numpy as np

import mpcam as mp

FORMAT = "png"


def views():
    """Pictures by title."""
    scene = mp.builtin_scene("facade", 64, 64)
    pose = scene.camera.camera_from_world
    lens = mp.BrownConrady(480, 360, 260, 260, 240, 180, k=(-0.25, 0.04), p=(0.01, -0.008), camera_from_world=pose)
    panorama = mp.Panorama.equirectangular(720, 360, camera_from_world=pose)
    x, y = np.meshgrid(np.linspace(-1, 1, 360), np.linspace(-1, 1, 360))
    size = 0.004 * np.ptp(scene.mesh.vertices)
    origins = size * np.stack([x, y, 0 * x], -1)
    directions = np.stack([0.7 * x - 0.5 * y, 0.7 * y + 0.5 * x, 0 * x + 1], -1)
    twisted = mp.RayMap(origins, directions, camera_from_world=pose)
    cameras = {"BrownConrady": lens, "Panorama": panorama, "RayMap, twisted": twisted}
    return {title: np.clip(mp.render(camera, scene), 0, 1) ** (1 / 2.2) for title, camera in cameras.items()}


def draw(theme):
    from matplotlib import pyplot

    pictures = views()
    wide = [picture.shape[1] / picture.shape[0] for picture in pictures.values()]
    figure, axes = pyplot.subplots(1, 3, figsize=(theme.width, 1.9), width_ratios=wide)
    for one, (title, picture) in zip(axes, pictures.items(), strict=True):
        one.imshow(picture, interpolation="antialiased")
        one.set_title(title)
        one.set_axis_off()
    return figure
