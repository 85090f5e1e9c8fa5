"""What caustics are asked for."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.checks import is_number, shown, whole_number
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface


@dataclass(frozen=True)
class Settings:
    """What `caustics` was asked for; reflectance is kept as RGB. Raises InputError for other values."""

    triangles: int = 400
    resolution: Any = 64
    photons: int = 512
    radius: float = 2.0
    index: float | None = None
    back: Mesh | Surface | None = None
    reflectance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    fresnel: bool = True
    show: bool = True

    def __post_init__(self) -> None:
        whole_number("photons", self.photons, 2, 4096, of="caustics")
        if not is_number(self.radius) or not 0 <= self.radius <= 8:
            raise InputError(f"caustics(radius={shown(self.radius)}): give pixels from 0 to 8")
        if self.back is not None and self.index is None:
            raise InputError(
                "caustics: back= is where light leaves a lens: give index= with it, or leave it out for a mirror"
            )
        try:
            color = np.broadcast_to(np.asarray(self.reflectance, np.float64), 3)
        except (TypeError, ValueError):
            color = np.full(3, np.nan)
        if not ((color >= 0) & (color <= 1)).all():
            raise InputError(f"caustics(reflectance={shown(self.reflectance)}): give one number or three from 0 to 1")
        red, green, blue = (float(part) for part in color)
        object.__setattr__(self, "radius", float(self.radius))
        object.__setattr__(self, "reflectance", (red, green, blue))
