"""What several experiments share: scenes, rounds, facts, and how a frame is checked against the truth."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from mpcam.comparison.facts import machine_facts
from mpcam.comparison.metrics import SAME_DEPTH, hit_errors
from mpcam.rendering.registry import OUTLINE_BOUNDS as BOUNDS

WARMUP = 2
PAPER = "Gascuel, Holzschuch, Fournier, Péroche: Fast Non-Linear Projections using Graphics Hardware, I3D 2008"
CARD = (
    "Ratios compare with the paper's, milliseconds do not: ours are times of this machine's processor, the paper's of "
    "an Nvidia 8800 GT."
)
STAND_IN = "The scenes are stand-ins, made by formula with the paper's numbers of triangles."
RENDERED = (
    "tests that hit, before the nearest is chosen; a pixel where parts of one triangle's bound overlap counts in each"
)
WRONG = (
    "against first hits of the same rays in Mitsuba: share of all pixels that hit or miss wrongly, or show another "
    "surface"
)


def rounds(repeats: int | None, quick: bool, usual: int) -> int:
    """Timed rounds: what was asked for, else 2 in a quick run, else the usual number."""
    return repeats if repeats is not None else 2 if quick else usual


def wrong_pixels(percent: float) -> str:
    """How many pixels differ from ray tracing, as a sentence."""
    if percent == 0:
        return "No pixel differs from ray tracing."
    return f"At most {percent:.2g} % of the pixels differ from ray tracing."


def measured(repeats: int, **more: str) -> dict[str, str]:
    """How it was measured, as text by name."""
    return {
        "rounds": f"{repeats} timed rounds after one first call each and {WARMUP} warm-up rounds; every round runs "
        "every case once, in a fresh shuffled order, so that drifts of the machine fall on all alike",
        "times": "wall clock until the device is done; medians",
        **{name.replace("_", " "): text for name, text in more.items()},
    }


def machine() -> Mapping[str, str]:
    """Facts of the machine."""
    return machine_facts()


def known_bounds(wanted: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Which of these bounds there are, and what to say of the others."""
    known = tuple(bound for bound in wanted if bound in BOUNDS)
    return known, tuple(f"bound {bound}, which this version does not have" for bound in wanted if bound not in known)


def mismatch(frame: Any, truth: Any) -> int:
    """Pixels of a frame (Hits, DepthMap or CoverageMap) that differ from the true first hits.

    Hits: one hits and the other does not, or another triangle at a depth off by more than 1e-4. Depths: the same
    without the triangles. Coverage: one hits and the other does not.
    """
    found, expected = np.asarray(frame.mask), np.asarray(truth.mask)
    if hasattr(frame, "triangle"):
        errors = hit_errors(frame, truth)
        return round((errors.hit_mismatch + errors.triangle_mismatch) * expected.size)
    wrong = found != expected
    if hasattr(frame, "depth"):
        true_depth = np.where(expected, truth.depth, 1.0).astype(np.float64)
        depth = np.where(found, frame.depth, 1.0).astype(np.float64)
        wrong |= found & expected & (np.abs(depth - true_depth) > SAME_DEPTH * true_depth)
    return int(np.count_nonzero(wrong))
