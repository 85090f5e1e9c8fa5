"""Kinds of general linear cameras by construction: random ones of each, in units from 1e-8 to 1e8, and near-ties."""

import numpy as np

from mpcam.cameras.general_linear import GeneralLinear
from mpcam.stress.report import StressRow

_STEEPEST = 6.0  # condition of a random turn
_ESTIMATE = 1.5
"""How much larger than the way back to a special kind its estimate may be."""
KINDS = ("pinhole", "orthographic", "pushbroom", "cross_slit", "pencil", "twisted_orthographic", "bilinear")


def slope_matrix(kind: str, rng: np.random.Generator) -> np.ndarray:
    """M of (sigma, tau) = M (u, v) + constant in the normal form of a kind, with entries around 1."""
    a, b = rng.uniform(0.2, 1.5, 2) * rng.choice([-1, 1], 2)
    rows = {
        "pinhole": ((a, 0), (0, a)),
        "orthographic": ((0, 0), (0, 0)),
        "pushbroom": ((a, 0), (0, 0)),
        "cross_slit": ((a, 0), (0, a + np.copysign(0.3 + abs(b), a))),
        "pencil": ((a, 1), (0, a)),
        "twisted_orthographic": ((0, 1), (0, 0)),
        "bilinear": ((a, -b), (b, a)),
    }
    return np.array(rows[kind], np.float64)


def random_camera(kind: str, rng: np.random.Generator, precision: str, large: float, deep: float) -> GeneralLinear:
    """Three random rays of a camera of a kind. large: unit of places; deep: unit of depths.

    Turns that nearly flatten the plane are left out: they make near-ties, which have a case of their own.
    """
    while True:
        turn, places = rng.normal(size=(2, 2)), rng.normal(size=(3, 2))
        if np.linalg.cond(turn) < _STEEPEST and abs(np.linalg.det(places[1:] - places[0])) > 0.3:
            break
    matrix = turn @ slope_matrix(kind, rng) @ np.linalg.inv(turn)
    slopes = places @ matrix.T + (0.0 if kind == "orthographic" else 1.0) * rng.normal(size=2)
    rays = np.concatenate([slopes * large / deep, places * large], axis=1)
    return GeneralLinear(rays.astype(precision), 8, 8)


def kind_rows(count: int, seed: int = 8) -> list[StressRow]:
    """Random cameras of each kind, and near-ties: invented are kinds that are wrong, or too sure of themselves."""
    rows = []
    for precision in ("float64", "float32"):
        for kind in KINDS:
            rng, wrong = np.random.default_rng(seed), 0
            for _ in range(count):
                large, deep = 10.0 ** rng.uniform(-8, 8, 2)
                wrong += random_camera(kind, rng, precision, large, deep).kind != kind
            rows.append(StressRow("kinds", kind, precision, count, float("nan"), 0, wrong))
    return [*rows, near_ties(count, seed)]


def near_ties(count: int, seed: int) -> StressRow:
    """Special kinds, off by 1e-12 to 1e-3 in a random way: the margin is no larger than the way back to them."""
    rng, wrong = np.random.default_rng(seed), 0
    for number in range(count):
        kind = ("pinhole", "pencil", "pushbroom", "twisted_orthographic")[number % 4]
        rays = np.array(random_camera(kind, rng, "float64", 1.0, 1.0).rays)
        off = 10.0 ** rng.uniform(-12, -3)
        apart = np.repeat([np.linalg.norm(rays[1:, k : k + 2] - rays[0, k : k + 2]) for k in (0, 2)], 2)
        noise = off * rng.normal(size=(3, 4))
        found, way = GeneralLinear(rays + apart * noise, 8, 8), float(np.linalg.norm(noise[1:] - noise[0]))
        wrong += found.margin > _ESTIMATE * way if found.kind != kind else off > 1e-6
    return StressRow("kinds", "near-ties", "float64", count, float("nan"), 0, wrong)
