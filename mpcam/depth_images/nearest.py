"""The nearer of two hits of each ray, on the device."""

import functools
from typing import Any

TIE = 3e-5
"""Of a distance: of hits that are no farther apart, which is what steps and rounding make, the earlier one counts."""


def nearer(best: Any, found: Any) -> tuple[Any, Any]:
    """The nearer hits, with the steps of both, and how far away they are."""
    chosen, _, limit = nearer_of(best, None, found, None)
    return chosen, limit


def nearer_of(best: Any, which: Any, found: Any, number: Any) -> tuple[Any, Any, Any]:
    """As `nearer`, and which of several they are: `number`, an Int on the device, where `found` is chosen."""
    return _frozen_nearer()(best, which, found, number)


@functools.cache
def _frozen_nearer() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def nearer(best: Any, which: Any, found: Any, number: Any) -> tuple[Any, ...]:
        better = found[0] & (~best[0] | (found[1] < best[1] * (1 - TIE)))
        kept = [dr.select(better, new, old) for new, old in zip(found[:-1], best[:-1], strict=True)]
        kept[0] = best[0] | found[0]
        chosen = None if which is None else dr.select(better, number, which)
        return (*kept, best[-1] + found[-1]), chosen, kept[1]

    return nearer
