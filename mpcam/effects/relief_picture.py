"""Pictures of scenes with reliefs: meshes by any method, copies of reliefs among them, with shadows both ways."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.effects.lookup import check_size
from mpcam.effects.relief_hits import ReliefHits, relief_hits
from mpcam.effects.relief_shading import shade_reliefs
from mpcam.effects.shadows import shadow_maps
from mpcam.errors import InputError
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import check_shading, check_shadows, shade_device
from mpcam.scene.scene import Scene


class ReliefPicture:
    """Frames of a scene with reliefs.

    scene: with `reliefs`; where they are is theirs to say, by `ReliefInstances.update`, and the next frame shows it.
    camera: any; default the scene's. method and settings: of the meshes, see `rasterize`. shading: see `render`.
    shadows: maps of the scene's lights, as they are. shadow_size: pixels along a side of maps that are made anew for
    each frame. coarse, fine: steps in the reliefs, see `DepthImage.intersect`. Raises InputError.
    """

    @exclusive
    def __init__(
        self,
        scene: Scene,
        camera: Camera | None = None,
        method: str = "invert",
        *,
        shading: str = "light",
        shadows: Sequence[Any] = (),
        shadow_size: int = 0,
        coarse: float | None = 3.0,
        fine: float = 0.5,
        **settings: Any,
    ):
        self.scene, self.shading, self.shadows = scene, shading, tuple(shadows)
        given = camera if camera is not None else scene.camera
        check_shading(shading)
        check_shadows(self.shadows, scene, shading)
        if self.shadows and shadow_size:
            raise InputError("give either shadows=, maps as they are, or shadow_size=, for maps made for each frame")
        self.shadow_size = check_size(shadow_size, "shadow_size") if shadow_size else 0
        self.coarse, self.fine = coarse, fine
        self.prepared = prepare(given, scene.mesh, method, **settings)
        self.camera: Camera = given

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another camera of the same kind, or another pose."""
        self.prepared.aim(camera)
        self.camera = camera

    @exclusive
    def seen(self) -> tuple[Hits, ReliefHits]:
        """First hits of one frame, on the meshes and on those reliefs that are nearer."""
        hits = self.prepared.frame()
        return hits, relief_hits(self.camera, self.scene.reliefs, hits.device_depth, coarse=self.coarse, fine=self.fine)

    @exclusive
    def frame(self) -> Any:
        """One frame on the device: an evaluated Array3f, one entry per pixel."""
        import drjit as dr

        maps = shadow_maps(self.scene, self.shadow_size, self.shading) if self.shadow_size else self.shadows
        hits, found = self.seen()
        behind = shade_device(hits, self.scene, self.shading, maps)
        color = shade_reliefs(found, behind, self.scene, self.shading, maps)
        dr.eval(color)
        return color

    @exclusive
    def image(self) -> np.ndarray:
        """One frame: (H, W, 3) float32, linear RGB."""
        shape = (self.camera.height, self.camera.width, 3)
        return np.stack([np.asarray(part.numpy()) for part in self.frame()], -1).reshape(shape)

    @exclusive
    def depth(self) -> np.ndarray:
        """How far the first surface is along each pixel's ray: (H, W) float32, infinite where nothing is."""
        hits, found = self.seen()
        return np.minimum(hits.depth, found.depth)
