"""Lenses from the coefficients of calibration files, and back: each of the models that programs share."""

from mpcam.cameras import AnglePolynomial, BrownConrady, Camera, FieldOfView, KannalaBrandt, Pinhole
from mpcam.errors import InputError
from mpcam.io.calibration_parts import Section

RADTAN = tuple("k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y".split())
"""OpenCV's coefficients in its order: radial and tangential, rational, thin prism, tilted sensor."""

_LENGTHS = (0, 4, 5, 8, 12, 14)

Size = tuple[int, int]
Frame = list[float]  # fx, fy, cx, cy, pixels as here


def undistorted(part: Section, coefficients: list[float], what: str) -> None:
    """See that distortion that no model here has is zero."""
    if any(coefficients):
        raise part.error(f"{what} is not zero: no camera of mpcam has it; undistort the images, or fit another model")


def pinhole_or_fisheye(part: Section, fisheye: bool, size: Size, frame: Frame, coefficients: list[float]) -> Camera:
    """A KannalaBrandt camera, or one with OpenCV's coefficients; zeros beyond those that a model has do no harm."""
    if fisheye:
        if len(coefficients) < 4:
            raise part.error(f"a fisheye needs 4 distortion coefficients k1 to k4, not {len(coefficients)}")
        undistorted(part, coefficients[4:], f"what follows the 4 distortion coefficients of a fisheye, {RADTAN[4]},")
        return part.camera(KannalaBrandt, *size, *frame, coefficients[:4])
    count = len(coefficients)
    while count and count not in _LENGTHS and not coefficients[count - 1]:
        count -= 1
    if count not in _LENGTHS and any(coefficients):
        raise part.error(f"{count} distortion coefficients are there, 0, 4, 5, 8, 12 or 14 are needed")
    return radtan(part, size, frame, dict(zip(RADTAN, coefficients[:count], strict=False)))


def radtan(part: Section, size: Size, frame: Frame, given: dict[str, float]) -> Camera:
    """A camera with radial and tangential distortion, a Pinhole where that is zero; given: coefficients by name."""
    kinds = (("thin prism distortion", ("s1", "s2", "s3", "s4")), ("a tilted sensor", ("tau_x", "tau_y")))
    for kind, names in kinds:
        undistorted(part, [given.get(name, 0.0) for name in names], f"{kind} ({', '.join(names)})")
    k, p = ([given.get(f"{letter}{i + 1}", 0.0) for i in range(count)] for letter, count in (("k", 6), ("p", 2)))
    if not any((*k, *p)):
        return part.camera(Pinhole, *size, *frame)
    return part.camera(BrownConrady, *size, *frame, k, p)


def fisheye_of(part: Section, size: Size, frame: Frame, k: list[float]) -> Camera:
    """A fisheye with any number of coefficients of odd powers of the angle."""
    if not any(k[4:]):
        return part.camera(KannalaBrandt, *size, *frame, (k + [0.0] * 4)[:4])
    return part.camera(AnglePolynomial, *size, *frame, [number for value in k for number in (0.0, value)])


def field_of_view(part: Section, size: Size, frame: Frame, omega: float) -> Camera:
    """The FOV model; a Pinhole where omega is zero."""
    return part.camera(FieldOfView, *size, *frame, omega) if omega else part.camera(Pinhole, *size, *frame)


def coefficients(camera: BrownConrady) -> dict[str, float]:
    """k1 to k6, p1 and p2 by name."""
    return {f"{letter}{i + 1}": float(value) for letter in "kp" for i, value in enumerate(getattr(camera, letter))}


def coefficients_held(camera: BrownConrady, names: str, style: str) -> list[float]:
    """Those that a format has a place for, in its order; raises InputError where others are not zero."""
    given = coefficients(camera)
    lost = [name for name, value in given.items() if value and name not in names.split()]
    if lost:
        raise InputError(f"{style} has no place for {', '.join(lost)} of {camera!r}: it holds {names}")
    return [given[name] for name in names.split()]
