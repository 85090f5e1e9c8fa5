"""The four profiles, and the criterion that decides which way their images of straight lines bend."""

import numpy as np
from matplotlib import pyplot

from mpcam.cameras.profiles import PROFILES


def draw(theme):
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(theme.width, 2.9))
    left.grid(True)
    right.grid(True)
    for profile in PROFILES.values():
        theta = np.linspace(0, min(profile.limit, np.radians(150)), 400)
        left.plot(np.degrees(theta), profile.radius(theta), label=profile.name)
        theta = np.linspace(0.12, min(profile.limit, np.radians(120)), 400)
        right.plot(1 / np.tan(theta), 1 / profile.radius(theta))
    theta = np.radians(np.linspace(0, 65, 200))
    left.plot(np.degrees(theta), np.tan(theta), color=theme.weak, linestyle="--", label="pinhole, tan θ")
    cotangent = np.linspace(0, 5.2, 3)
    right.plot(cotangent, cotangent, color=theme.weak, linestyle="--")
    left.set(xlim=(0, 150), ylim=(0, 2.1), xlabel="θ, degrees", ylabel="r = f(θ)", title="Profiles")
    left.set_xticks(range(0, 151, 30))
    left.legend(loc="lower right", labelspacing=0.25)
    right.set(xlim=(-0.6, 5.2), ylim=(0, 8.5), xlabel="w = cot θ", ylabel="U = 1 / f", title="Convex in cot θ")
    return figure
