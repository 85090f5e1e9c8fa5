"""Run times of several cases, measured so that they can be compared: interleaved, shuffled, first call apart.

A machine's clock rate and its other work drift over seconds. Timing one case after the other would hand that drift to
single cases; here every round runs each case once in a fresh order, so it falls on all of them alike.
"""

import gc
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from mpcam.errors import InputError

SEED = 20061


@dataclass(frozen=True)
class Timing:
    """Seconds of one case: warm median and quartiles over `n` calls; `first` is the first call, compiling included.

    `stages` holds the warm median of each stage that the case reports about itself.
    """

    median: float
    quartiles: tuple[float, float]
    n: int
    first: float
    stages: dict[str, float] = field(default_factory=dict)

    @property
    def spread(self) -> float:
        """Interquartile range in seconds: how far the middle half of the calls lies apart."""
        return self.quartiles[1] - self.quartiles[0]


def now() -> float:
    """Seconds on the clock that all times here use."""
    return time.perf_counter()


def synchronize() -> None:
    """Wait until Dr.Jit has finished all queued work (its kernels run asynchronously, on the CPU too)."""
    import drjit as dr

    dr.sync_thread()


def measure(
    cases: Mapping[str, Callable[[], object]],
    repeats: int = 9,
    warmup: int = 1,
    *,
    before: Mapping[str, Callable[[], object]] | None = None,
    stages: Mapping[str, Callable[[], Mapping[str, float]]] | None = None,
    finish: Callable[[], None] = synchronize,
    seed: int = SEED,
    on_call: Callable[[str], None] | None = None,
) -> dict[str, Timing]:
    """Time every case: one first call each, then `warmup` + `repeats` rounds of all cases in shuffled order.

    `finish` ends every timed call: it must return only when the device is done. Untimed are `before[label]`, called
    before each call of that case, `stages[label]`, called after it, which returns the seconds that a call spends by
    stage, and `on_call(label)`. The order depends on `seed` alone. Warm-up rounds are run and thrown away. Raises
    `InputError` for `repeats` < 1.
    """
    if repeats < 1 or warmup < 0:
        raise InputError(f"repeats={repeats}, warmup={warmup}: give at least 1 repeat and 0 or more warm-up rounds.")
    labels = list(cases)
    random = np.random.default_rng(seed)
    before, stages = before or {}, stages or {}

    def call(label: str) -> float:
        if label in before:
            before[label]()
        finish()
        start = now()
        cases[label]()
        finish()
        seconds = now() - start
        if on_call is not None:
            on_call(label)
        return seconds

    first = {label: call(label) for label in labels}
    samples: dict[str, list[float]] = {label: [] for label in labels}
    parts: dict[str, list[Mapping[str, float]]] = {label: [] for label in labels}
    collecting = gc.isenabled()
    gc.disable()  # a collection in the middle of one call would be charged to that case
    try:
        for round_ in range(warmup + repeats):
            gc.collect()
            for index in random.permutation(len(labels)):
                label = labels[index]
                seconds = call(label)
                part = dict(stages[label]()) if label in stages else {}
                if round_ >= warmup:
                    samples[label].append(seconds)
                    parts[label].append(part)
    finally:
        if collecting:
            gc.enable()
    return {label: _summary(samples[label], parts[label], first[label]) for label in labels}


def _summary(samples: list[float], parts: list[Mapping[str, float]], first: float) -> Timing:
    low, middle, high = (float(value) for value in np.quantile(samples, [0.25, 0.5, 0.75]))
    names = dict.fromkeys(name for part in parts for name in part)  # in the order of first appearance
    stages = {name: float(np.median([part.get(name, 0.0) for part in parts])) for name in names}
    return Timing(middle, (low, high), len(samples), first, stages)
