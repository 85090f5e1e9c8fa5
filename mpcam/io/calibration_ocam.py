"""OCamCalib's calib_results.txt: Scaramuzza's polynomial, a center, and an affine map.

Rows come before columns there, the center of the first pixel is at (0, 0), and the axis points backward: x is down, y
is right. The polynomial of the radius is read; that of the angle, which the toolbox fits to it, is not needed.
"""

import warnings

from mpcam.cameras import Camera, Scaramuzza
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_parts import HALF, Section, as_number

STYLE = "OCamCalib's calib_results.txt"
POSES = "none"

_LINES = ("the polynomial", "its inverse", "the center", "the affine map", "the image size")
_SHIFT = 1.0
"""Pixels by which shear may be off at the rim and still be left out, with a warning."""


def recognizes(document: Document) -> bool:
    """Whether it begins with the toolbox's comment, or with lines of numbers as long as they say."""
    if document.folder or document.binary:
        return False
    head = document.text.lstrip()[:200].lower()
    return head.startswith("#polynomial coefficients") or (head.startswith("#") and "ocam_model" in head)


def read(document: Document) -> dict[str, Camera]:
    """The camera, as "camera"."""
    part = Section(document.where, {}, document.size)
    lines = [line.split() for line in document.text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if len(lines) < 4:
        raise part.error(f"{len(lines)} lines of numbers are there: {', '.join(_LINES)} are needed")
    rows = [
        [as_number(word, f"{part.where}: {name}") for word in line] for name, line in zip(_LINES, lines, strict=False)
    ]
    (count, *polynomial), center, affine = rows[0], rows[2], rows[3]
    if count != len(polynomial) or len(polynomial) < 2:
        raise part.error(f"the polynomial has {len(polynomial)} coefficients, not {count:g} as its line says")
    for name, row, wanted in (("the center", center, 2), ("the affine map", affine, 3)):
        if len(row) != wanted:
            raise part.error(f"{name} has {len(row)} numbers, {wanted} are needed")
    if len(rows) > 4:
        height, width = (rows[4] + [float("nan")] * 2)[:2]
        part.data |= {"height": height, "width": width}
    width, height = part.image_size(("width", "height"))
    first, second = polynomial[:2]
    if not first < 0 or second:
        raise part.error(f"the polynomial begins with {first:g} {second:g}: a number below 0, and 0, are needed")
    focal, stretch = -first, affine[0]
    _shear(part, affine, width, height)
    # z = a0 + a2 rho^2 + ..., backward; in focal lengths r = rho / focal and forward.
    shape = [-value * focal ** (power + 1) for power, value in enumerate(polynomial[2:])]
    frame = [focal, stretch * focal, center[1] + HALF, center[0] + HALF]
    return {"camera": part.camera(Scaramuzza, width, height, *frame, shape)}


def _shear(part: Section, affine: list[float], width: int, height: int) -> None:
    """Say, or refuse, that the affine map is more than a stretch."""
    _, d, e = affine
    off = 0.5 * max(abs(d), abs(e)) * max(width, height)
    if off > _SHIFT:
        raise part.error(
            f"the affine map has shear, d = {d:g} and e = {e:g}, which moves the border of the image by {off:.2g} "
            "pixels: no camera of mpcam has it; calibrate with d = e = 0"
        )
    if off:
        warnings.warn(
            f"{part.where}: the affine map's shear, d = {d:g} and e = {e:g}, is left out: it moves the border of the "
            f"image by {off:.2g} pixels",
            UserWarning,
            stacklevel=5,
        )
