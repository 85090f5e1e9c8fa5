"""Timing: order, what is kept apart, and what is counted."""

import time

import numpy as np
import pytest

from mpcam.comparison.timing import measure
from mpcam.errors import InputError


def nothing() -> None:
    """The end of a call on a device that has nothing queued."""


def recorded(labels, **settings):
    calls: list[str] = []
    cases = {label: (lambda label=label: calls.append(label)) for label in labels}
    return calls, measure(cases, finish=nothing, **settings)


def test_every_round_runs_every_case_once():
    labels = list("abcde")
    calls, timings = recorded(labels, repeats=6, warmup=2)
    rounds = [calls[i : i + 5] for i in range(0, len(calls), 5)]
    assert len(rounds) == 1 + 2 + 6
    assert all(sorted(each) == labels for each in rounds)
    assert {timing.n for timing in timings.values()} == {6}


def test_the_order_is_shuffled_and_repeatable():
    calls, _ = recorded("abcde", repeats=6)
    again, _ = recorded("abcde", repeats=6)
    other, _ = recorded("abcde", repeats=6, seed=1)
    assert calls == again
    assert calls != other
    rounds = {tuple(calls[i : i + 5]) for i in range(5, len(calls), 5)}
    assert len(rounds) > 3


def test_the_first_call_is_kept_apart():
    waits = iter([0.05, *[0.0] * 20])
    timing = measure({"a": lambda: time.sleep(next(waits))}, repeats=5, warmup=1, finish=nothing)["a"]
    assert timing.first >= 0.05
    assert timing.median < 0.02
    assert timing.quartiles[0] <= timing.median <= timing.quartiles[1]
    assert timing.spread == timing.quartiles[1] - timing.quartiles[0]


def test_waiting_for_the_device_counts_and_what_comes_before_does_not():
    asleep = {"now": False}

    def queue() -> None:
        asleep["now"] = True

    def finish() -> None:
        if asleep["now"]:
            time.sleep(0.01)
            asleep["now"] = False

    timing = measure({"a": queue}, 3, 0, before={"a": lambda: time.sleep(0.05)}, finish=finish)["a"]
    assert 0.01 <= timing.median < 0.05


def test_stages_are_medians_of_the_timed_calls():
    values = iter([100.0, 1.0, 5.0, 2.0])  # of the warm-up round first
    timing = measure({"a": nothing}, 3, 1, stages={"a": lambda: {"build": next(values), "trace": 1.0}}, finish=nothing)[
        "a"
    ]
    assert timing.stages == {"build": 2.0, "trace": 1.0}
    assert list(timing.stages) == ["build", "trace"]


def test_calls_are_reported():
    seen: list[str] = []
    measure({"a": nothing, "b": nothing}, 2, 1, finish=nothing, on_call=seen.append)
    assert sorted(seen) == ["a"] * 4 + ["b"] * 4


def test_no_repeats_are_refused():
    with pytest.raises(InputError, match="repeats=0"):
        measure({"a": nothing}, 0, finish=nothing)


def test_the_default_waits_for_drjit():
    import drjit as dr
    from drjit.llvm import Float

    total = 1 << 22

    def heavy() -> None:
        x = dr.linspace(Float, 0, 1, total)
        for _ in range(20):
            x = dr.sin(x) + x
        dr.eval(x)

    waited = measure({"a": heavy}, 3, 1)["a"].median
    queued = measure({"a": heavy}, 3, 1, finish=nothing)["a"].median
    dr.sync_thread()
    assert np.isfinite(waited)
    assert waited > queued
