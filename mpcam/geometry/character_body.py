"""A standing person as closed smooth tubes and ellipsoids, 1.75 m tall, at the origin, facing -y."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mpcam.geometry.mesh import Material
from mpcam.geometry.shapes import MeshPart, ellipsoid, join, loft, smooth_curve, unit
from mpcam.geometry.textures import painted

Pieces = list[tuple[MeshPart, Material]]

# shoulder, elbow and wrist of the left arm (x > 0), then of the right arm with x mirrored
_ARMS = {
    "stand": [[(0.19, 0.0, 1.41), (0.27, 0.03, 1.13), (0.27, -0.06, 0.88)]] * 2,
    "hips": [[(0.19, 0.0, 1.41), (0.41, 0.06, 1.19), (0.23, -0.08, 0.99)]] * 2,
    "wave": [
        [(0.19, 0.0, 1.41), (0.42, -0.05, 1.5), (0.47, -0.1, 1.77)],
        [(0.19, 0.0, 1.41), (0.27, 0.03, 1.13), (0.25, -0.1, 0.89)],
    ],
    "walk": [
        [(0.19, 0.0, 1.41), (0.25, -0.14, 1.15), (0.22, -0.36, 1.03)],
        [(0.19, 0.0, 1.41), (0.26, 0.15, 1.15), (0.27, 0.16, 0.89)],
    ],
}
# hip, knee and ankle, in the same way
_LEGS = {
    "walk": [
        [(0.09, 0.0, 0.92), (0.1, 0.0, 0.5), (0.1, 0.2, 0.1)],
        [(0.09, 0.0, 0.92), (0.1, -0.14, 0.51), (0.1, -0.24, 0.1)],
    ],
}
_STANDING = [[(0.09, 0.0, 0.92), (0.11, -0.01, 0.5), (0.12, 0.02, 0.1)]] * 2


@dataclass(frozen=True)
class Look:
    """Web colors of skin, hair, shirt, trousers or skirt. pose: stand, hips, wave or walk. hat: a color or none."""

    skin: str
    hair: str
    shirt: str
    below: str
    pose: str
    skirt: bool = False
    long_hair: bool = False
    hat: str | None = None


class Sizes:
    """How many lines and columns of points each part gets, for one resolution; it remembers what was asked of it."""

    def __init__(self, resolution: float) -> None:
        self.resolution = resolution
        self.asked: list[tuple[float, float]] = []

    def __call__(self, along: float, around: float) -> tuple[int, int]:
        """Lines and columns of a part with these sizes in meters, times about 3 where it matters."""
        self.asked.append((along, around))
        return _lines(along * self.resolution), _columns(around * self.resolution)

    def resolution_for(self, triangles: float) -> float:
        """The resolution at which the parts asked for so far have about this many triangles."""
        along, around = np.array(self.asked).T

        def count(resolution: float) -> int:
            return int(
                sum(
                    2 * _columns(a * resolution) * (_lines(b * resolution) - 2)
                    for a, b in zip(around, along, strict=True)
                )
            )

        low, high = 1.0, 10_000.0
        for _ in range(60):
            middle = (low * high) ** 0.5
            low, high = (middle, high) if count(middle) < triangles else (low, middle)
        return low if abs(count(low) - triangles) < abs(count(high) - triangles) else high


def _lines(size: float) -> int:
    return max(round(size), 7)


def _columns(size: float) -> int:
    return max(round(size), 6)


def figure(look: Look, sizes: Sizes) -> Pieces:
    """The parts of one person with their materials."""
    skin, shirt, below = painted("skin", look.skin), painted("shirt", look.shirt), painted("clothes", look.below)
    pieces: Pieces = [
        (_torso(sizes), shirt),
        (_tube(sizes, _BELT, 0.1, 0.45, power=2.4, caps=(0.1, 0.1)), painted("belt", "#2a2019")),
        (_hair(sizes, look.long_hair), painted("hair", look.hair)),
        *_face(sizes, skin),
    ]
    if look.hat:
        rows, columns = sizes(0.1, 0.4)
        brim = ellipsoid((0, 0.01, 1.705), (0.17, 0.185, 0.009), rows - 1, columns)
        pieces.append((join([brim, _tube(sizes, _HAT, 0.24, 0.36, caps=(0.05, 0.25))]), painted("hat", look.hat)))
    if not look.skirt:
        pieces.append((_tube(sizes, _PELVIS, 0.2, 0.45, power=2.4, caps=(0.5, 0.05)), below))
    for side, leg in zip((1, -1), _LEGS.get(look.pose, _STANDING), strict=True):
        pieces.append((_leg(sizes, leg, side), skin if look.skirt else below))
        pieces.append((_shoe(sizes, leg, side), painted("shoe", "#3b2a22")))
    if look.skirt:
        pieces.append((_tube(sizes, _SKIRT, 0.5, 0.7, ripple=_folds, caps=(0.02, 0.1)), below))
    for side, arm in zip((1, -1), _ARMS[look.pose], strict=True):
        sleeve, bare = _arm(sizes, arm, side)
        pieces += [(sleeve, shirt), (bare, skin)]
    return pieces


def _tube(
    sizes: Sizes,
    knots,
    along: float,
    around: float,
    power: float = 2.0,
    ripple: Callable | None = None,
    caps: tuple[float, float] = (1.0, 1.0),
    across=(1.0, 0.0, 0.0),
) -> MeshPart:
    """A closed tube through knots of x, y, z, half-width, half-depth (K, 5).

    caps: how far the rounded ends reach, in radii. ripple(v, angle): factors on the radius, v from 0 to 1 along it.
    """
    lines, columns = sizes(along, around)
    rounding = max(lines // 8, 2)
    curve = smooth_curve(np.asarray(knots, dtype=np.float64), lines - 2 * rounding)
    angle = np.linspace(0, np.pi / 2, rounding + 1)[1:]
    shrink = np.cos(angle)
    shrink[-1] = 0.0
    ends = []
    for end, inner, cap in ((curve[0], curve[1], caps[0]), (curve[-1], curve[-2], caps[1])):
        outwards = unit(end[:3] - inner[:3])
        centers = end[:3] + cap * end[3:].min() * np.sin(angle)[:, None] * outwards
        ends.append(np.concatenate([centers, shrink[:, None] * end[3:]], axis=1))
    curve = np.concatenate([ends[0][::-1], curve, ends[1]])
    factors = None
    if ripple is not None:
        factors = ripple(np.linspace(0, 1, lines)[:, None], np.linspace(0, 2 * np.pi, columns + 1))
    return loft(curve[:, :3], curve[:, 3:], columns, across=across, power=power, ripple=factors)


_TORSO = [
    (0, 0.0, 0.95, 0.172, 0.124),
    (0, 0.0, 1.08, 0.148, 0.108),
    (0, -0.01, 1.26, 0.178, 0.125),
    (0, 0.0, 1.37, 0.19, 0.115),
    (0, 0.01, 1.44, 0.14, 0.088),
    (0, 0.01, 1.475, 0.075, 0.068),
    (0, 0.01, 1.5, 0.06, 0.06),
]
_PELVIS = [(0, 0.0, 0.9, 0.153, 0.113), (0, 0.0, 0.95, 0.176, 0.128), (0, 0.0, 1.0, 0.168, 0.126)]
_BELT = [(0, 0, 0.985, 0.166, 0.124), (0, 0, 1.005, 0.166, 0.124), (0, 0, 1.028, 0.163, 0.122)]
_HAT = [(0, 0.01, 1.7, 0.095, 0.11), (0, 0.01, 1.74, 0.092, 0.108), (0, 0.01, 1.8, 0.08, 0.096)]
_SKIRT = [(0, 0, 0.44, 0.265, 0.245), (0, 0, 0.62, 0.235, 0.205), (0, 0, 0.88, 0.192, 0.148), (0, 0, 1.0, 0.16, 0.12)]
_SKULL = [
    (0, -0.03, 1.545, 0.042, 0.05),
    (0, -0.018, 1.575, 0.06, 0.076),
    (0, -0.005, 1.62, 0.07, 0.09),
    (0, 0.005, 1.675, 0.074, 0.094),
    (0, 0.01, 1.715, 0.064, 0.082),
]
_NECK = [(0, 0.02, 1.46, 0.056, 0.056), (0, 0.015, 1.51, 0.05, 0.052), (0, 0.0, 1.57, 0.046, 0.048)]
_NOSE = [(0, -0.088, 1.66, 0.006, 0.008), (0, -0.094, 1.64, 0.009, 0.011), (0, -0.097, 1.622, 0.013, 0.013)]
_LONG_HAIR = [
    (0, 0.078, 1.38, 0.07, 0.032),
    (0, 0.07, 1.47, 0.085, 0.042),
    (0, 0.045, 1.58, 0.087, 0.07),
    (0, 0.03, 1.67, 0.086, 0.088),
    (0, 0.024, 1.725, 0.07, 0.078),
]
_SHORT_HAIR = [
    (0, 0.045, 1.57, 0.06, 0.055),
    (0, 0.035, 1.63, 0.08, 0.075),
    (0, 0.027, 1.69, 0.083, 0.09),
    (0, 0.02, 1.73, 0.068, 0.078),
]


def _strands(v, angle):
    return 1 + 0.02 * np.sin(26 * angle + 3 * v) * np.sin(np.pi * v)


def _folds(v, angle):
    return 1 + 0.09 * (1 - v) ** 1.5 * np.sin(11 * angle) + 0.03 * (1 - v) * np.sin(5 * angle + 1)


def _torso(sizes: Sizes) -> MeshPart:
    return _tube(sizes, _TORSO, 0.55, 0.45, power=2.4, caps=(0.2, 0.2))


def _hair(sizes: Sizes, long: bool) -> MeshPart:
    """A cap behind the face, down to the shoulders if long."""
    return _tube(sizes, _LONG_HAIR if long else _SHORT_HAIR, 0.36, 0.5, ripple=_strands, caps=(0.6, 0.6))


def _face(sizes: Sizes, skin: Material) -> Pieces:
    """Skull, neck, nose and ears; eyes and lips."""
    flesh = [
        _tube(sizes, _SKULL, 0.34, 0.34, caps=(0.5, 0.6)),
        _tube(sizes, _NECK, 0.12, 0.24, caps=(0.1, 0.1)),
        _tube(sizes, _NOSE, 0.1, 0.1),
    ]
    lines, columns = sizes(0.1, 0.12)
    flesh += [ellipsoid((side * 0.073, 0.01, 1.635), (0.01, 0.02, 0.032), lines - 1, columns) for side in (1, -1)]
    pieces = [(join(flesh), skin)]
    for color, name, y, radii, size in (
        ("#f4f2ec", "eye white", -0.079, (0.015, 0.012, 0.009), 0.08),
        ("#2a2420", "pupil", -0.0865, (0.0065, 0.0065, 0.0065), 0.05),
    ):
        lines, columns = sizes(size, size)
        both = [ellipsoid((side * 0.03, y, 1.655), radii, lines - 1, columns) for side in (1, -1)]
        pieces.append((join(both), painted(name, color)))
    lines, columns = sizes(0.06, 0.09)
    lips = ellipsoid((0, -0.083, 1.577), (0.022, 0.012, 0.008), lines - 1, columns)
    return [*pieces, (lips, painted("lips", "#b05a50"))]


def _mirrored(joints, side: int) -> np.ndarray:
    return np.array(joints) * (side, 1.0, 1.0)


def _leg(sizes: Sizes, joints, side: int) -> MeshPart:
    hip, knee, ankle = _mirrored(joints, side)
    places = [ankle, 0.2 * knee + 0.8 * ankle, 0.65 * knee + 0.35 * ankle, knee, 0.5 * (hip + knee), hip]
    widths = [(0.034, 0.038), (0.036, 0.04), (0.058, 0.066), (0.056, 0.062), (0.078, 0.088), (0.09, 0.1)]
    return _tube(sizes, np.concatenate([places, widths], axis=1), 0.5, 0.32, caps=(0.5, 0.5))


def _shoe(sizes: Sizes, joints, side: int) -> MeshPart:
    """An ellipsoid with a flat sole."""
    ankle = _mirrored(joints, side)[2]
    lines, columns = sizes(0.16, 0.24)
    part = ellipsoid((0, 0, 0), (0.052, 0.14, 0.06), lines - 1, columns)
    points = part.vertices.copy()
    points[:, 2] = np.where(points[:, 2] < -0.035, -0.035 + 0.15 * (points[:, 2] + 0.035), points[:, 2])
    points += (ankle[0], ankle[1] - 0.055, ankle[2] - 0.1 - points[:, 2].min() + 0.002)
    return MeshPart(points, part.faces, part.normals, part.uv)


def _arm(sizes: Sizes, joints, side: int) -> tuple[MeshPart, MeshPart]:
    """The sleeve, and the forearm with hand and fingers."""
    shoulder, elbow, wrist = _mirrored(joints, side)
    across = (0.0, 1.0, 0.2)
    # the elbow is rounded, so that the inside of the sleeve does not cross itself
    places = [shoulder, 0.5 * (shoulder + elbow), 0.24 * shoulder + 0.7 * elbow + 0.06 * wrist]
    places += [0.06 * shoulder + 0.7 * elbow + 0.24 * wrist, 0.52 * elbow + 0.48 * wrist]
    widths = [(0.064, 0.068), (0.056, 0.058), (0.05, 0.052), (0.048, 0.05), (0.05, 0.052)]
    sleeve = _tube(sizes, np.concatenate([places, widths], axis=1), 0.34, 0.26, caps=(0.6, 0.1), across=across)
    along = unit(wrist - elbow)
    places = [0.85 * elbow + 0.15 * wrist, 0.55 * elbow + 0.45 * wrist, 0.2 * elbow + 0.8 * wrist, wrist]
    widths = [(0.03, 0.03), (0.038, 0.04), (0.026, 0.029), (0.023, 0.022)]
    bare = _tube(sizes, np.concatenate([places, widths], axis=1), 0.2, 0.2, caps=(0.2, 0.5), across=across)
    return sleeve, join([bare, *_hand(sizes, wrist, along, side)])


def _hand(sizes: Sizes, wrist, along, side: int) -> list[MeshPart]:
    """A palm, four fingers and a thumb, pointing along the forearm, the thumb forward."""
    thumb = np.array((0.0, -1.0, 0.0)) + along[1] * along
    thumb = unit(thumb)
    back = np.cross(thumb, along) * side
    places = [wrist, wrist + 0.02 * along, wrist + 0.06 * along, wrist + 0.09 * along]
    widths = [(0.024, 0.016), (0.03, 0.016), (0.041, 0.018), (0.04, 0.015)]
    parts = [_tube(sizes, np.concatenate([places, widths], axis=1), 0.1, 0.14, across=thumb)]
    for k, reach in enumerate((0.065, 0.075, 0.07, 0.055)):
        root = wrist + 0.088 * along + (0.029 - 0.0195 * k) * thumb
        places = [root + reach * (t * along - 0.25 * t * t * back) for t in (0.0, 0.5, 1.0)]
        widths = [(0.0095, 0.0095), (0.009, 0.009), (0.007, 0.007)]
        parts.append(_tube(sizes, np.concatenate([places, widths], axis=1), 0.09, 0.08, across=thumb))
    places = [wrist + a * along + b * thumb for a, b in ((0.025, 0.024), (0.055, 0.048), (0.085, 0.058))]
    widths = [(0.012, 0.012), (0.011, 0.011), (0.0085, 0.0085)]
    parts.append(_tube(sizes, np.concatenate([places, widths], axis=1), 0.09, 0.08, across=back))
    return parts
