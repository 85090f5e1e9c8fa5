"""The cameras of Yu et al. 2009, Figs. 6, 7 and 9: panoramas from all sides, a top view, two cameras on a hinge."""

import numpy as np

from mpcam.cameras.general_linears import GeneralLinears
from mpcam.cameras.pinhole import Pinhole
from mpcam.math.pose import look_at

_ABOVE, _RING, _FAN = 3.0, 0.3, 1.15
_NECK, _AWAY = 1.0, 2.4
"""x of the hinge, and how far the path is from the cow."""
_FIRST, _SECOND = 3.2, 3.4
"""Lengths of both paths."""
_BEHIND = (6.0, 0.45)
"""How far behind the middle of the cow both slits are."""


def cow_around(width: int, height: int, pieces: int = 36) -> GeneralLinears:
    """All sides of the cow: the image begins and ends behind its tail."""
    return GeneralLinears.around((0.1, 0, 1.0), 3.6, 2.9, width, height, pieces, turn=(-1.25 * np.pi, 0.75 * np.pi))


def cow_eye(width: int, height: int) -> Pinhole:
    return _pinhole(width, height, (1.9, -3.4, 1.9), (0.25, 0, 0.97), 43.0)


def teapot_around(width: int, height: int, pieces: int = 36) -> GeneralLinears:
    """Three quarters of the teapot's sides, with spout and handle."""
    turn = (-1.25 * np.pi, 0.25 * np.pi)
    return GeneralLinears.around((0, 0, 0.55), 3.2, 2.6, width, height, pieces, turn=turn)


def teapot_eye(width: int, height: int) -> Pinhole:
    return _pinhole(width, height, (0.9, -3.9, 1.5), (0.1, 0, 0.52), 43.0)


def teapot_top(width: int, height: int, tiles: int = 18) -> GeneralLinears:
    """The teapot from above, with all of its sides: rays go straight down in the middle, and the farther from it the
    more from outside. tiles: across; each is cut into two general linear cameras."""
    down = max(round(tiles * height / width), 2)
    x, y = np.meshgrid(np.linspace(-1, 1, tiles + 1) * width / height, np.linspace(-1, 1, down + 1))
    far = np.hypot(x, y)
    slope = -_FAN * far * np.minimum(far, 1.3)  # over far, so the direction is that of x, y
    fan = slope / np.maximum(far, 1e-9)
    start = 1.05 + (_RING - _ABOVE) * fan  # at a height of _RING a ray is 1.05 far from the middle
    rays = np.stack([fan * x, fan * y, start * x, start * y], axis=-1)
    pose = look_at((0, 0, _ABOVE), (0, 0, 0), (0, 1, 0))
    return GeneralLinears.over_grid(rays, width, height, pose)


def hinged(width: int, height: int, angle: float) -> GeneralLinears:
    """A cross-slit camera along body and tail of the cow, and one on a hinge at its end, whose slit is behind the
    neck.

    angle: degrees that the second path is turned out of the line of the first, toward the cow's face.
    """
    turn = np.radians(angle)
    hinge = np.array([_NECK, -_AWAY, 1.15])
    path = [hinge - (_FIRST, 0, 0), hinge, hinge + _SECOND * np.array([np.cos(turn), np.sin(turn), 0])]
    first = round(0.66 * width)
    slits = [(_NECK, behind, 0.0) for behind in _BEHIND]
    return GeneralLinears.along_path(path, slits, width, height, (-0.6, 0.45), columns=[first, width - first])


def _pinhole(width: int, height: int, eye: tuple, target: tuple, degrees: float) -> Pinhole:
    return Pinhole.from_fov(width, height, np.radians(degrees), camera_from_world=look_at(eye, target))
