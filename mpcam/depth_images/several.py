"""Rays against several depth images at once: the nearest hit of each ray wins."""

from collections.abc import Sequence
from typing import Any

from mpcam.backend import exclusive, types
from mpcam.depth_images.depth_image import DepthImage, Walk
from mpcam.depth_images.intersections import Intersections
from mpcam.depth_images.nearest import nearer_of
from mpcam.depth_images.rays import far_of, rays_of, side_for
from mpcam.errors import InputError


@exclusive
def intersect(
    images: Sequence[DepthImage],
    origins: Any,
    directions: Any = None,
    coarse: float | None = 6.0,
    fine: float = 0.25,
    far: Any = None,
    walk: Walk = "march",
    leaving: bool = True,
) -> Intersections:
    """Where rays first meet the surface of any of several depth images.

    images: at least one. The rest: see `DepthImage.intersect`. Each image is marched only as far as the nearest hit
    that is known; of equal distances the earlier image wins. `steps` are those in all of them. Raises InputError.
    """
    import drjit as dr

    if len(images) == 0 or not all(isinstance(image, DepthImage) for image in images):
        raise InputError("images: give a list of mpcam.DepthImage, at least one")
    side, coarse, fine = side_for(coarse, fine)
    rays, shape = rays_of(origins, directions)
    limit = far_of(far, shape)
    best: Any = None
    which: Any = None
    for number, image in enumerate(images):
        found = image.followed(rays, side, coarse, fine, limit, walk, leaving)
        if best is None:
            best, which = found, dr.zeros(types().Int, dr.width(found[0]))
            dr.make_opaque(which)
        elif shape and 0 in shape:
            continue
        else:
            best, which, _ = nearer_of(best, which, found, dr.opaque(types().Int, number))
        if number + 1 < len(images):
            limit = dr.minimum(limit, best[1])
            dr.eval(limit)
    return Intersections(images, best, shape, which)
