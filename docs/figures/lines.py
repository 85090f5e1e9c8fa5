"""Images of straight lines under the four profiles, and how far their tangents have turned along the way."""

import numpy as np
from matplotlib import pyplot
from matplotlib.patches import Circle

from mpcam.cameras.profiles import PROFILES

NEAREST = (8, 24, 40, 56, 72)  # degrees between the axis and the nearest point of a line


def great_circle(profile, nearest, azimuth=0.0, count=801):
    """Image (2, count) and its derivative along the arc from one end of the half-sphere to the other."""
    s = np.linspace(-np.pi / 2 + 1e-6, np.pi / 2 - 1e-6, count)
    b = np.radians(nearest)
    x, y, z = np.sin(b) * np.cos(s), np.sin(s), np.cos(b) * np.cos(s)
    theta, phi = np.arccos(np.clip(z, -1, 1)), np.arctan2(y, x) + azimuth
    r = profile.radius(np.minimum(theta, profile.limit))
    return s, np.stack([r * np.cos(phi), r * np.sin(phi)])


def draw(theme):
    figure, axes = pyplot.subplots(2, 4, figsize=(theme.width, 4.0), height_ratios=[1.5, 1])
    shades = pyplot.get_cmap("viridis")(
        np.linspace(*(0.35, 0.95) if theme.name == "dark" else (0.1, 0.8), len(NEAREST))
    )
    for (name, profile), disc, turn in zip(PROFILES.items(), *axes, strict=True):
        disc.add_patch(Circle((0, 0), 1, fill=False, color=theme.weak, linewidth=0.8))
        for nearest, shade in zip(NEAREST, shades, strict=True):
            for azimuth in (0.0, np.pi):
                _, image = great_circle(profile, nearest, azimuth)
                disc.plot(*image, color=shade, linewidth=1.2)
            s, image = great_circle(profile, nearest)
            tangent = np.gradient(image, s, axis=1)
            angle = np.degrees(np.unwrap(np.arctan2(tangent[1], tangent[0]))) - 90
            turn.plot(np.degrees(s), angle, color=shade, linewidth=1.2, label=f"{nearest}°")
        disc.set(xlim=(-1.03, 1.03), ylim=(-1.03, 1.03), aspect="equal", title=name)
        disc.set_axis_off()
        turn.grid(True)
        turn.set(xlim=(-90, 90), ylim=(-95, 95), xticks=(-90, 0, 90), yticks=(-90, 0, 90), xlabel="s, degrees")
    axes[1, 0].set_ylabel("tangent turned by, degrees")
    lines, labels = axes[1, 0].get_legend_handles_labels()
    title = "angle between the axis and the nearest point of the line"
    figure.legend(lines, labels, title=title, loc="outside lower center", ncols=len(NEAREST), handlelength=1.2)
    for turn in axes[1, 1:]:
        turn.set_yticklabels([])
    return figure
