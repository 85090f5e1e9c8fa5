"""A statue of a winged dragon on four legs: limbs that hide each other from every side."""

import numpy as np

from mpcam.geometry.levels import Level, fitted
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, MeshPart, copies, ellipsoid, join, smooth_curve, surface, unit
from mpcam.geometry.solids import tapered
from mpcam.geometry.textures import painted

FULL = 60_000
_ACROSS = (0.0, 1.0, 0.0)

# from the tip of the tail to the snout: x, y, z, half-width, half-height
_SPINE = np.array(
    [
        (-2.75, 0.62, 0.2, 0.02, 0.02),
        (-2.35, 0.32, 0.08, 0.055, 0.055),
        (-1.9, -0.02, 0.2, 0.1, 0.1),
        (-1.35, -0.1, 0.56, 0.17, 0.18),
        (-0.75, 0.0, 0.86, 0.29, 0.31),
        (-0.1, 0.0, 0.84, 0.36, 0.38),
        (0.5, 0.0, 0.93, 0.34, 0.38),
        (0.95, 0.0, 1.22, 0.2, 0.25),
        (1.12, 0.02, 1.6, 0.14, 0.17),
        (1.25, 0.05, 1.9, 0.15, 0.16),
        (1.52, 0.06, 1.98, 0.16, 0.15),
        (1.8, 0.06, 1.88, 0.1, 0.085),
        (1.98, 0.06, 1.83, 0.075, 0.06),
    ]
)
# one front and one hind leg, of the side at +y: knots and half-widths, from the hip down
_LEGS = (
    (((0.5, 0.2, 0.85), (0.55, 0.42, 0.62), (0.42, 0.47, 0.36), (0.55, 0.46, 0.09)), (0.2, 0.16, 0.095, 0.085)),
    (((-0.78, 0.16, 0.86), (-0.64, 0.38, 0.62), (-0.75, 0.45, 0.36), (-0.72, 0.45, 0.09)), (0.22, 0.17, 0.11, 0.09)),
)


def statue(triangles: int) -> Mesh:
    """4.7 long, 3.5 wide and 2.6 high on z = 0, its head towards +x: within 4 % of so many triangles."""
    return fitted(_parts, triangles, FULL).mesh("statue")


def _parts(level: Level) -> Builder:
    half = [part for leg in _LEGS for part in _leg(level, *leg)] + _wing(level) + _horn(level)
    body = _body(level), _jaw(level), *_ridge(level), *half, *(_mirrored(part) for part in half)
    builder = Builder()
    builder.add(join(list(body)), painted("bronze", "#8f9a86"))
    return builder


def _body(level: Level) -> MeshPart:
    """Tail, trunk, neck and head in one, with a little of scales."""
    return tapered(_SPINE[:, :3], _SPINE[:, 3:], level(170, 40), level(64, 14), _ACROSS)


def _jaw(level: Level) -> MeshPart:
    knots = [(1.38, 0.055, 1.86), (1.6, 0.06, 1.8), (1.88, 0.06, 1.735)]
    return tapered(knots, [(0.1, 0.05), (0.085, 0.045), (0.05, 0.03)], level(24, 8), level(20, 8), _ACROSS)


def _leg(level: Level, knots, radii) -> list[MeshPart]:
    """A leg with a foot of three toes."""
    leg = tapered(knots, radii, level(40, 12), level(32, 8), (1.0, 0.0, 0.0))
    foot = np.array(knots[-1])
    toe = ellipsoid((0.0, 0.0, 0.0), (0.15, 0.05, 0.06), level(12, 6), level(16, 8))
    matrices = np.tile(np.eye(4), (3, 1, 1))
    for number, turn in enumerate((-0.5, 0.0, 0.5)):
        c, s = np.cos(turn), np.sin(turn)
        matrices[number, :2, :2] = (c, -s), (s, c)
        matrices[number, :3, 3] = foot + (0.1 * c, 0.1 * s, 0.06 - foot[2])
    return [leg, copies(toe, matrices)]


def _horn(level: Level) -> list[MeshPart]:
    """A horn and an eye, of the side at +y."""
    horn = [(1.3, 0.12, 2.0), (1.12, 0.19, 2.14), (0.9, 0.22, 2.2), (0.72, 0.2, 2.32)]
    return [
        tapered(horn, (0.055, 0.045, 0.03, 0.008), level(24, 8), level(16, 6), _ACROSS),
        ellipsoid((1.58, 0.19, 2.02), (0.045, 0.03, 0.035), level(8, 6), level(12, 8)),
    ]


def _ridge(level: Level) -> list[MeshPart]:
    """Spikes along the back, the largest on the shoulders."""
    along = smooth_curve(_SPINE, 200)
    parts = []
    for place in np.linspace(22, 160, 15).astype(int):
        x, y, z, _, high = along[place]
        ahead = along[place + 1, :3] - along[place - 1, :3]
        up = np.cross(ahead, (0.0, 1.0, 0.0) if abs(ahead[1]) < 0.8 * np.linalg.norm(ahead) else (-1.0, 0.0, 0.0))
        up = up / np.linalg.norm(up) * (-1.0 if up[2] > 0 else 1.0)
        size = 0.12 + 0.4 * high
        foot = np.array((x, y, z)) - (high - 0.06) * up
        tip = foot - size * up - 0.35 * size * ahead / np.linalg.norm(ahead)
        wide = 0.3 * size * np.array([1.0, 0.65, 0.12])[:, None] * (0.4, 1.0)
        knots = [foot, foot - 0.5 * size * up, tip]
        parts.append(tapered(knots, wide, level(14, 6), level(12, 6), np.cross(ahead, up)))
    return parts


def _wing(level: Level) -> list[MeshPart]:
    """The wing at +y: an arm, four fingers, and a thin skin between them with a hollow edge."""
    shoulder, wrist = np.array((0.25, 0.22, 1.12)), np.array((0.45, 0.85, 2.1))
    tips = np.array([(0.05, 1.72, 2.58), (-0.65, 1.75, 1.98), (-1.05, 1.42, 1.45), (-1.05, 0.85, 1.12)])
    root = np.array((-0.55, 0.2, 1.1))
    arm = tapered([shoulder, (0.62, 0.5, 1.6), wrist], (0.11, 0.075, 0.05), level(24, 8), level(20, 8), (1.0, 0.0, 0.0))
    parts = [arm]
    bows = []
    for number, tip in enumerate(tips):
        middle = 0.5 * (wrist + tip) + (0.06 - 0.03 * number, 0.05, 0.13)
        knots = [wrist, middle, tip]
        bows.append(knots)
        parts.append(tapered(knots, (0.04, 0.03, 0.014), level(28, 8), level(12, 6), (1.0, 0.0, 0.0)))
    fingers = [smooth_curve(knots, level(30, 8)) for knots in (*bows, [wrist, 0.5 * (shoulder + wrist), root])]
    parts.append(_skin(fingers, level(14, 4)))
    return parts


def _skin(fingers: list[np.ndarray], across: int, thick: float = 0.011) -> MeshPart:
    """A closed sheet between curves (R, 3) from one point, drawn in between their ends, bulging a little."""
    rows = len(fingers[0])
    sheets = []
    for first, second in zip(fingers[:-1], fingers[1:], strict=True):
        t = np.linspace(0, 1, across + 1)[None, :, None]
        bay = np.sin(np.pi * t[0, :, 0])
        # Towards the middle of a bay the edge draws back to the wrist: rows are closer together there.
        reach = np.linspace(0, 1, rows)[:, None] * (1 - 0.2 * bay)
        position = reach * (rows - 1)
        low = np.minimum(position.astype(int), rows - 2)
        part = (position - low)[..., None]
        a = first[low] * (1 - part) + first[low + 1] * part
        b = second[low] * (1 - part) + second[low + 1] * part
        sheet = a * (1 - t) + b * t
        sheet[..., 2] += 0.1 * reach**2 * bay
        sheets.append(sheet if not sheets else sheet[:, 1:])
    grid = np.concatenate(sheets, axis=1)
    grid[0] = fingers[0][0]
    # Both sides are moved one way each, so that creases do not fold over. At the rim they meet, and towards the wrist,
    # where cells are narrow, they come near.
    out = unit(_normals(grid).sum(axis=(0, 1)))
    lift = np.repeat(thick * np.minimum(1.5 * np.linspace(0, 1, rows), 1.0)[:, None], grid.shape[1], axis=1)
    lift[-1] = 0.0
    lift[:, [0, -1]] = 0.0
    sides = grid + lift[..., None] * out, (grid - lift[..., None] * out)[:, ::-1]
    return join([surface(side, normals=_normals(side)) for side in sides])


def _normals(grid: np.ndarray) -> np.ndarray:
    """Vertex normals of a grid of points from the faces around."""
    plain = surface(grid, normals=np.zeros_like(grid))
    return Mesh(plain.vertices, plain.faces).smooth_normals().reshape(grid.shape)


def _mirrored(part: MeshPart) -> MeshPart:
    """The part on the other side of y = 0."""
    flip = np.array((1.0, -1.0, 1.0))
    return MeshPart(part.vertices * flip, part.faces[:, [0, 2, 1]], part.normals * flip, part.uv)
