"""Levels of detail of procedural meshes: numbers of segments by a factor, and the factor for a number of triangles."""

from collections.abc import Callable, Iterator

import numpy as np

from mpcam.geometry.shapes import Builder

_CLOSE, _FAIR = 0.005, 0.02  # of the number of triangles
_TRIES = 8


class Level:
    """Turns numbers of segments at full detail into those of this level. factor: 1 at full detail."""

    def __init__(self, factor: float) -> None:
        self.factor = float(factor)

    def __call__(self, full: float, least: int) -> int:
        return max(round(full * self.factor), least)


def fitted(build: Callable[[Level], Builder], triangles: int, full: int) -> Builder:
    """What `build` makes at the level whose number of triangles comes nearest, of those that are tried.

    full: triangles at factor 1. Counts grow with the square of the factor but for what is the same at all levels, so a
    few steps lead there. As they grow in steps of many triangles at once, those around are tried where that is not
    within 2 %.
    """
    factor, best = (triangles / full) ** 0.5, None
    counts: set[int] = set()
    while len(counts) < _TRIES:
        found = build(Level(factor))
        best = _nearer(best, found, triangles)
        if abs(found.count - triangles) <= _CLOSE * triangles:
            return found
        if found.count in counts:
            break
        counts.add(found.count)
        factor *= (triangles / found.count) ** 0.5
    assert best is not None
    for around in _around(factor):
        if abs(best.count - triangles) <= _FAIR * triangles:
            break
        best = _nearer(best, build(Level(around)), triangles)
    return best


def _around(factor: float) -> Iterator[float]:
    """Factors from near to far, to both sides."""
    for step in np.linspace(0.01, 0.12, 12):
        yield factor * (1 + step)
        yield factor * (1 - step)


def _nearer(first: Builder | None, second: Builder, triangles: int) -> Builder:
    if first is None or abs(second.count - triangles) < abs(first.count - triangles):
        return second
    return first
