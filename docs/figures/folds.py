"""Where a distortion folds: the plane in front of the camera with the domain, and the image of a polar grid."""

import numpy as np
from matplotlib import pyplot
from matplotlib.patches import Circle

import mpcam as mp

LENS = mp.BrownConrady(64, 64, 1, 1, 0, 0, k=(-0.28, 0.01), p=(0.03, -0.05))


def rim(count=721):
    """Radii at azimuths where the domain ends, by bisection of what `project` says."""
    phi = np.linspace(-np.pi, np.pi, count)
    low, high = np.zeros(count), np.full(count, 3.0)
    for _ in range(50):
        r = 0.5 * (low + high)
        inside = LENS.project(np.stack([r * np.cos(phi), r * np.sin(phi), 1 + 0 * r], -1)).valid[:, 0]
        low, high = np.where(inside, r, low), np.where(inside, high, r)
    return phi, low


def draw(theme):
    figure, (plane, image) = pyplot.subplots(1, 2, figsize=(theme.width, 3.5))
    phi, end = rim()
    strong, weak = theme.palette[0], theme.palette[1]
    plane.fill(end * np.cos(phi), end * np.sin(phi), color=strong, alpha=0.18, linewidth=0)
    plane.plot(end * np.cos(phi), end * np.sin(phi), color=strong)
    inner, outer = LENS.reach[:2]
    for radius, name in ((inner, "inner"), (outer, "outer")):
        plane.add_patch(Circle((0, 0), radius, fill=False, color=theme.weak, linewidth=0.9, linestyle="--"))
        plane.annotate(name, (0, -radius), color=theme.weak, ha="center", va="bottom" if radius == outer else "top")
    p1, p2 = LENS.p
    toward = np.array([p2, p1]) / np.hypot(p1, p2)
    plane.annotate("", 0.75 * toward, (0, 0), arrowprops={"arrowstyle": "->", "color": theme.text})
    plane.annotate("q", 0.8 * toward, color=theme.text, ha="right", va="bottom")
    widest = 1.3 * outer
    plane.set(xlim=(-widest, widest), ylim=(widest, -widest), aspect="equal", title="plane z = 1")

    step = np.linspace(0, 1, 200)
    lines = [(widest * 0.92 * step, np.full(200, a)) for a in np.linspace(-np.pi, np.pi, 33)]
    lines += [(np.full(200, r), (2 * step - 1) * np.pi) for r in np.linspace(0, 0.92 * widest, 13)[1:]]
    for r, angle in lines:
        u, v = LENS.distortion.image(r * np.cos(angle), r * np.sin(angle))
        inside = r <= np.interp(angle, phi, end)
        for color, width, shown in ((weak, 0.6, ~inside), (strong, 0.8, inside)):
            image.plot(np.where(shown, u, np.nan), np.where(shown, v, np.nan), color=color, linewidth=width)
    u, v = LENS.distortion.image(end * np.cos(phi), end * np.sin(phi))
    image.plot(u, v, color=theme.text, linewidth=1.2)
    image.set(aspect="equal", title="image, in focal lengths")
    image.invert_yaxis()
    return figure
