"""WoodScape's JSON of one fisheye: a polynomial of the angle, and the camera's pose in the vehicle.

The vehicle's axes are x ahead, y left, z up; the camera's are as here. Offsets of the center are from the middle of the
image.
"""

import numpy as np

from mpcam.cameras import AnglePolynomial, Camera
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_parts import Section
from mpcam.io.calibration_poses import Poses, inverse, quaternion_matrix, rotated

STYLE = "WoodScape's JSON"
POSES = "world"


def recognizes(document: Document) -> bool:
    """Whether there is a mapping of intrinsics with a model called radial_poly, or the offsets of a center."""
    lens = document.mapping().get("intrinsic")
    return isinstance(lens, dict) and (lens.get("model") == "radial_poly" or {"cx_offset", "k1"} <= lens.keys())


def read(document: Document) -> dict[str, Camera]:
    """The camera by its name in the file, or "camera"; world is the vehicle."""
    whole = Section(document.where, document.tree, document.size)
    part = whole.part("intrinsic")
    model = part.get("model", "radial_poly")
    if model != "radial_poly":
        raise part.error(f"model {model!r} is not known here: radial_poly is")
    width, height = part.image_size(("width", "height"))
    names = [key for key in part.data if str(key)[:1] == "k" and str(key)[1:].isdigit()]
    powers = sorted(int(name[1:]) for name in names)
    order = part.number("poly_order", len(powers))
    if powers != list(range(1, len(powers) + 1)) or order != len(powers):
        raise part.error(f"{', '.join(names)} are there and poly_order is {order:g}: k1, k2, ... up to it are needed")
    first, *rest = [part.number(f"k{power}") for power in powers] or [0.0]
    if not first > 0:
        raise part.error(f"k1 is {first:g}: pixels per radian at the center, a number above 0, are needed")
    # The middle of the image is at (width - 1) / 2 for WoodScape, which counts from the first pixel's center.
    center = [0.5 * width + part.number("cx_offset", 0.0), 0.5 * height + part.number("cy_offset", 0.0)]
    focal = [first, first * part.number("aspect_ratio", 1.0)]
    camera = part.camera(AnglePolynomial, width, height, *focal, *center, [value / first for value in rest])
    if "extrinsic" in whole:
        poses = Poses()
        vehicle = poses.made(f"{whole.where}: extrinsic: quaternion", lambda: _place(whole))
        poses.warn()
        camera = camera if vehicle is None else camera.with_pose(inverse(vehicle))
    return {str(whole.get("name", "camera")): camera}


def _place(whole: Section) -> np.ndarray:
    """The camera in the vehicle."""
    place = whole.part("extrinsic")
    x, y, z, w = place.numbers("quaternion", 4)
    return rotated(quaternion_matrix(w, x, y, z), place.numbers("translation", 3))
