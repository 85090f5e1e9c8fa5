"""What bounds a curved triangle: tangents at its corners, along the chords too; the sector of its cone; the rim."""

import numpy as np
from matplotlib import pyplot
from matplotlib.patches import Circle, Polygon, Rectangle

import mpcam as mp
from mpcam.cameras.outline import outline

CAMERA = mp.Radial.paraboloid(200, 200)


def direction(theta, phi):
    """Unit direction from degrees from the axis and degrees of azimuth (0: right, 90: down)."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def boundary(corners, count=400):
    """Image (N, 2) of the boundary of the triangle, NaN where it is out of view."""
    t = np.linspace(0, 1, count)[:, None]
    points = np.concatenate([p + (q - p) * t for p, q in zip(corners, np.roll(corners, -1, 0), strict=True)])
    found = CAMERA.project(points)
    return np.where(found.valid, found.pixel[:, 0], np.nan)


def region(image):
    """The visible part of a boundary as a closed polygon (N, 2): along the rim where the triangle leaves the view."""
    seen = np.isfinite(image).all(1)
    if seen.all():
        return image
    image = np.roll(image, -int(np.flatnonzero(seen & ~np.roll(seen, 1))[0]), axis=0)
    image = image[np.isfinite(image).all(1)]
    last, first = (np.arctan2(*(image[i] - 100)[::-1]) for i in (-1, 0))
    around = np.linspace(last, last + np.angle(np.exp(1j * (first - last))), 60)
    return np.concatenate([image, 100 + CAMERA.radius * np.stack([np.cos(around), np.sin(around)], -1)])


def tangents(corners):
    """For each edge: both ends and the crossing of the tangents there, (3, 3, 2)."""
    step, lines = 1e-5, []
    for p, q in zip(corners, np.roll(corners, -1, 0), strict=True):
        a, b = CAMERA.project(np.stack([p, q])).pixel[:, 0]
        a1, b1 = CAMERA.project(np.stack([p + (q - p) * step, q + (p - q) * step])).pixel[:, 0]
        reach = np.linalg.solve(np.stack([a1 - a, b - b1], 1), b - a)
        lines.append([a, a + (a1 - a) * reach[0], b])
    return np.array(lines)


def sector(corners, count=60):
    """Boundary (N, 2) of the annular sector that holds the triangle's bounding cone."""
    axis = corners.sum(0) / np.linalg.norm(corners.sum(0))
    spread = np.arccos((corners @ axis).min())
    theta, phi = np.arccos(axis[2]), np.arctan2(axis[1], axis[0])
    half = np.arcsin(np.sin(spread) / np.sin(theta))
    inner, outer = (CAMERA.pixels_per_radius * np.tan(0.5 * (theta + s * spread)) for s in (-1, 1))
    around = np.linspace(phi - half, phi + half, count)
    ring = np.stack([np.cos(around), np.sin(around)], -1)
    return np.concatenate([inner * ring, min(outer, CAMERA.radius) * ring[::-1]]) + 100


def rectangle(axes, box, **style):
    axes.add_patch(Rectangle(box.low, *(box.high - box.low), fill=False, **style))


def camera_outline(corners):
    """Box of the camera's outline, and the triangle of its lines (3, 2), None where it has no lines."""
    found = outline(CAMERA, *corners[:, :, None])
    lines = np.array(found.lines)[:, :, 0]
    box = mp.Box(found.low[:, 0], found.high[:, 0], found.valid[0])
    if not lines[:, :2].any(1).all():
        return box, None
    pairs = zip(lines, np.roll(lines, -1, 0), strict=True)
    return box, np.array([np.linalg.solve(np.stack(pair)[:, :2], -np.stack(pair)[:, 2]) for pair in pairs])


def draw(theme):
    blue, orange, green, violet, _ = theme.palette
    figure, axes = pyplot.subplots(1, 3, figsize=(theme.width, 3.0))
    triangles = {
        "a  tangents at the corners": np.array([direction(60, 112), direction(68, 158), direction(25, 140)]),
        "b  sector of the cone": np.array([direction(45, 100), direction(76, 160), direction(38, 160)]),
        "c  a rim point": np.array([direction(55, 140), direction(120, 185), direction(55, 215)]),
    }
    for place, (title, corners) in zip(axes, triangles.items(), strict=True):
        place.add_patch(Circle((100, 100), 100, fill=False, color=theme.weak, linewidth=0.8))
        image = boundary(corners)
        place.add_patch(Polygon(region(image), color=blue, alpha=0.25, linewidth=0))
        place.plot(*image.T, color=blue, linewidth=1.6, label="image")
        rectangle(place, CAMERA.bound(corners), color=green, linewidth=1.4, label="exact box")
        place.set(title=title, xlim=(-3, 127), ylim=(203, 73), aspect="equal")
        place.set_axis_off()
    first, second, third = triangles.values()
    for start, crossing, end in tangents(first):
        axes[0].plot(*np.stack([start, crossing, end]).T, color=orange, linewidth=1, label="tangents")
        axes[0].plot(*np.stack([start, end]).T, color=theme.weak, linewidth=0.8, linestyle=":", label="chords")
    axes[1].add_patch(Polygon(sector(second), fill=False, color=orange, linewidth=1, label="sector"))
    for place, corners in zip(axes, (first, second), strict=False):
        box, lines = camera_outline(corners)
        rectangle(place, box, color=violet, linewidth=1.2, linestyle="--", label="outline")
        if lines is not None:
            place.add_patch(Polygon(lines, fill=False, color=violet, linewidth=1.2, linestyle="--"))
    axes[2].plot(0, 100, "o", color=orange, markersize=5, label="rim point")
    axes[0].set(xlim=(20, 92), ylim=(167, 95))
    axes[2].set_ylim(165, 35)
    named = {}
    for place in axes:
        handles, labels = place.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=len(named), handlelength=1.6)
    return figure
