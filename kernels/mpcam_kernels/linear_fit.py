"""Vectors over a block of pixels as linear functions of the position, by least squares, and what they are off."""

from collections.abc import Callable
from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.samples import HEIGHT, WIDTH, of_block


class Channel(NamedTuple):
    """Vectors within `off` of middle + s right + t down, for s and t from -1 to 1; off is negative for none."""

    middle: Any
    right: Any
    down: Any
    off: Any


class Fit(NamedTuple):
    """count: how many vectors there were. means: of each channel. channels: their linear functions, without `off`."""

    count: Any
    means: list[Any]
    channels: list[tuple[Any, Any, Any]]


Sample = Callable[[Any], tuple[list[Any], Any, Any, Any]]
"""Of a number: the vectors of all channels, s, t, and whether there are any."""


def linear_fit(types: Any, sample: Sample, count: int, channels: int) -> Fit:
    """Linear functions of so many channels through `count` samples each."""
    zero, nothing, empty = types.UInt(0), types.Float(0), types.Array3f(0)

    def below(k: Any, *_: Any) -> Any:
        return k < count

    def add(k: Any, n: Any, s: Any, t: Any, sums: list[Any]) -> Any:
        values, sk, tk, valid = sample(k)
        one = dr.select(valid, types.Float(1), 0)
        return k + 1, n + one, s + sk * one, t + tk * one, [a + v * one for a, v in zip(sums, values, strict=True)]

    _, n, s, t, sums = dr.while_loop((zero, nothing, nothing, nothing, [empty] * channels), below, add)
    inverse = 1.0 / dr.maximum(n, 1)
    s, t, means = s * inverse, t * inverse, [total * inverse for total in sums]

    def vary(k: Any, ss: Any, st: Any, tt: Any, right: list[Any], down: list[Any]) -> Any:
        values, sk, tk, valid = sample(k)
        x, y = dr.select(valid, sk - s, 0), dr.select(valid, tk - t, 0)
        away = [v - mean for v, mean in zip(values, means, strict=True)]
        right = [a + v * x for a, v in zip(right, away, strict=True)]
        down = [a + v * y for a, v in zip(down, away, strict=True)]
        return k + 1, ss + x * x, st + x * y, tt + y * y, right, down

    state = (zero, nothing, nothing, nothing, [empty] * channels, [empty] * channels)
    _, ss, st, tt, rights, downs = dr.while_loop(state, below, vary)
    # Held back where the positions lie on a line.
    ss, tt = ss + 1e-3, tt + 1e-3
    solve = 1.0 / (ss * tt - st * st)
    found = []
    for mean, a, b in zip(means, rights, downs, strict=True):
        right, down = (a * tt - b * st) * solve, (b * ss - a * st) * solve
        found.append((mean - right * s - down * t, right, down))
    return Fit(n, means, found)


def position(types: Any, slot: Any) -> tuple[Any, Any]:
    """Where a slot lies in its block, from -1 to 1 along both sides."""
    x, y = of_block(slot)
    s = (types.Float(x) - 0.5 * (WIDTH - 1)) * (2.0 / (WIDTH - 1))
    return s, (types.Float(y) - 0.5 * (HEIGHT - 1)) * (2.0 / (HEIGHT - 1))
