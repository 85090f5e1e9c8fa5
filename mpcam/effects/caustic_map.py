"""The photon-location map: where each pixel's light lands, and how much denser it lies there."""

from typing import NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.effects.caustic_photons import solid_angle

_CORNERS = (((0, 0), (1, 0), (0, 1)), ((1, 1), (0, 1), (1, 0)))
"""Columns and rows of the photons of the two triangles of four."""


class Energy(NamedTuple):
    """Flux (3,) RGB: on the reflector, on the receivers after it, and in the eye's view of them."""

    reflector: np.ndarray
    receivers: np.ndarray
    view: np.ndarray


class PhotonMap(NamedTuple):
    """The photon-location map: arrays (P, P) by pixel of the light's view.

    position (P, P, 3): world. receiver: number of the scene's mesh, -1 for none. flux: for a light of intensity 1.
    """

    position: np.ndarray
    receiver: np.ndarray
    flux: np.ndarray


def concentration(photons: PhotonMap, view: Camera, light: np.ndarray) -> np.ndarray:
    """(2, P - 1, P - 1) solid angle of each triangle of photons over that of the landed one, from a light at (3,).

    view: the light's. 0 where the three photons do not lie on one receiver. First the triangles at the upper left of
    four photons, then those at the lower right.
    """
    size = len(photons.receiver)
    v, u = np.indices((size, size)) + 0.5
    before = np.asarray(view.ray(np.stack([u, v], axis=-1)).direction)
    after = photons.position - light
    after = after / np.maximum(np.linalg.norm(after, axis=-1, keepdims=True), 1e-300)
    result = []
    for corners in _CORNERS:
        cut = [(slice(y, size - 1 + y), slice(x, size - 1 + x)) for x, y in corners]
        same = photons.receiver[cut[0]] >= 0
        for other in cut[1:]:
            same &= photons.receiver[other] == photons.receiver[cut[0]]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = solid_angle(*(before[c] for c in cut)) / solid_angle(*(after[c] for c in cut))
        result.append(np.where(same & np.isfinite(ratio), ratio, 0.0))
    return np.stack(result)
