"""Which of the eight kinds a general linear camera is, how surely, and where its slits are (Yu and McMillan 2004).

Of three generators (sigma, tau, u, v), U and S hold the differences of (u, v) and of (sigma, tau). The generators'
triangle cut by the plane at depth z has the area det(U + z S) / 2 = (A z^2 + B z + C) / 2: where it vanishes there is a
slit, and how it vanishes tells the kind.
"""

from typing import NamedTuple

import numpy as np

KINDS = (
    "pinhole",
    "orthographic",
    "pushbroom",
    "cross_slit",
    "pencil",
    "twisted_orthographic",
    "bilinear",
    "epi",
    "not a camera",
)
TOLERANCES = {np.dtype(np.float64): 1e-9, np.dtype(np.float32): 1e-4}
"""How far from a special kind generators may be, by rounding, and count as it: relative to their own size."""

_NOISE = 64.0
"""Rounding of a difference of generators, in units of eps times the largest number in it."""


class Line(NamedTuple):
    """A line in space: a point (3,) of it, and its unit direction (3,)."""

    point: np.ndarray
    direction: np.ndarray


class Kind(NamedTuple):
    """name: one of KINDS. margin: how much the generators must change, relative to how far they are apart, to become
    another kind; parallel ones, relative to the depth. nearest: that kind. depths: z of slits or the center, rising.

    Kinds of which this one is a special case do not count for the margin, or that of a pinhole would always be zero.
    """

    name: str
    margin: float
    nearest: str
    depths: tuple[float, ...]


def classify(rays: np.ndarray, tolerance: float | None = None) -> Kind:
    """The kind of a camera from its generators (3, 4), by rows (sigma, tau, u, v).

    tolerance: default by the precision of the generators, TOLERANCES. The margin is an estimate, right but for a small
    factor where it is small.
    """
    table = np.asarray(rays, np.float64)
    eps = np.finfo(rays.dtype).eps if rays.dtype in TOLERANCES else np.finfo(np.float64).eps
    limit = TOLERANCES.get(rays.dtype, 1e-9) if tolerance is None else tolerance
    S, U = (table[1:, :2] - table[0, :2]).T, (table[1:, 2:] - table[0, 2:]).T
    slope, size = (float(np.linalg.norm(part)) for part in (S, U))
    noise = [_NOISE * eps * float(np.abs(table[:, k : k + 2]).max()) for k in (0, 2)]
    parallel, concurrent = slope <= noise[0], size <= noise[1]
    # The unit of z is free: with the one in which U and S are equally large, numbers of both can be compared.
    unit = 1.0 if parallel or concurrent else size / slope
    U, S = U / (size or 1.0), S / (slope or 1.0)
    if parallel:
        S, noise[0] = 0.0 * S, 0.0
    if concurrent:
        U, noise[1] = 0.0 * U, 0.0
    limit = max(limit, noise[0] / (slope or 1.0), noise[1] / (size or 1.0))
    A, B, C = _characteristic(U, S)
    distances = {
        "not a camera": _second(np.concatenate([S, U])),
        "pinhole": 0.0 if concurrent else np.inf if parallel else _second(np.stack([U.ravel(), S.ravel()])),
        "epi": float(np.linalg.norm([A, B, C])),
        "orthographic": 0.0 if parallel else slope,
        "infinite": float(np.linalg.svd(S, compute_uv=False)[1]),
        "endless": float(np.hypot(A, B)) / np.sqrt(2.0),
        "double": _distance(B * B - 4.0 * A * C, U, S),
    }
    name = _name(distances, limit, A, B, C)
    nearest, margin = min(((other, distances[key]) for other, key in _neighbors(name)), key=lambda one: one[1])
    return Kind(name, margin, nearest, tuple(sorted(unit * z + 0.0 for z in _depths(name, U, S, A, B, C))))


def _name(distances: dict[str, float], limit: float, A: float, B: float, C: float) -> str:
    if distances["not a camera"] <= limit:
        return "not a camera"
    if distances["orthographic"] == 0.0:
        return "orthographic"
    if distances["pinhole"] <= limit:
        return "pinhole"
    if distances["epi"] <= limit:
        return "epi"
    if distances["infinite"] <= limit:
        return "twisted_orthographic" if distances["endless"] <= limit else "pushbroom"
    if distances["double"] <= limit:
        return "pencil"
    return "cross_slit" if B * B > 4.0 * A * C else "bilinear"


def _neighbors(name: str) -> list[tuple[str, str]]:
    """Kinds that a kind becomes in its limits, and what measures the distance to each."""
    none, alone = ("not a camera", "not a camera"), ("orthographic", "orthographic")
    double, flat = ("pencil", "double"), ("epi", "epi")
    return {
        "pinhole": [alone, none],
        "orthographic": [none],
        "pushbroom": [double, ("twisted_orthographic", "endless"), alone, flat, none],
        "cross_slit": [("pushbroom", "infinite"), ("pinhole", "pinhole"), double, alone, flat, none],
        "pencil": [("pushbroom", "infinite"), ("pinhole", "pinhole"), alone, flat, none],
        "twisted_orthographic": [alone, flat, none],
        "bilinear": [("pinhole", "pinhole"), double, alone, flat, none],
        "epi": [none],
        "not a camera": [("epi", "not a camera")],
    }[name]


def _characteristic(U: np.ndarray, S: np.ndarray) -> tuple[float, float, float]:
    """A, B and C of det(U + z S)."""
    B = U[0, 0] * S[1, 1] + S[0, 0] * U[1, 1] - U[0, 1] * S[1, 0] - S[0, 1] * U[1, 0]
    return float(np.linalg.det(S)), float(B), float(np.linalg.det(U))


def _second(matrix: np.ndarray) -> float:
    """The second singular value: the distance from matrices of rank one."""
    return float(np.linalg.svd(matrix, compute_uv=False)[1])


def _distance(discriminant: float, U: np.ndarray, S: np.ndarray) -> float:
    """About how far U and S are from a double root, from the value of B^2 - 4 A C, its slope and its curvature."""

    def adjugate(X: np.ndarray) -> np.ndarray:
        return np.array([[X[1, 1], -X[1, 0]], [-X[0, 1], X[0, 0]]])

    A, B, C = _characteristic(U, S)
    slopes = [2.0 * B * adjugate(S) - 4.0 * A * adjugate(U), 2.0 * B * adjugate(U) - 4.0 * C * adjugate(S)]
    slope = float(np.linalg.norm(slopes))
    value, bend = abs(discriminant), 8.0
    return 2.0 * value / (slope + np.sqrt(slope * slope + bend * value)) if value else 0.0


def _depths(name: str, U: np.ndarray, S: np.ndarray, A: float, B: float, C: float) -> list[float]:
    """Where det(U + z S) vanishes, for the kind that it was found to be."""
    if name == "pinhole":
        return [-float((U * S).sum() / (S * S).sum())]
    if name == "pushbroom":
        return [-C / B]
    if name == "pencil":
        return [-B / (2.0 * A)]
    if name == "cross_slit":
        root = -0.5 * (B + np.copysign(np.sqrt(max(B * B - 4.0 * A * C, 0.0)), B))
        return [float(root / A), float(C / root) if root else 0.0]
    return []
