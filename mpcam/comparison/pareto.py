"""The Pareto front of error against time, and which method wins at which time budget."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mpcam.comparison.columns import COLUMNS, ERROR_COLUMNS, TIME_COLUMNS
from mpcam.comparison.numbers import format_column, format_number
from mpcam.comparison.rows import Findings, Row

# "At float precision": 95% of the hits this near to their pixel's center, and this share of pixels with the wrong hit.
# float32 pixel coordinates of a 1000-pixel image are 6e-5 apart; a ray's direction and its hit lose a few bits more.
EXACT_PIXELS = 2e-3
EXACT_MISMATCH = 1e-3


@dataclass(frozen=True)
class Winner:
    """The row to take from a time budget of `start_ms` on (up to the next winner's).

    tie: the row with the least error among those that are no worse and slower by less than the two spreads together.
    """

    row: Row
    start_ms: float
    tie: Row | None = None


def pareto_front(errors: ArrayLike, times: ArrayLike) -> NDArray[np.bool_]:
    """Which points (n,) no other point beats: better in one of error and time and not worse in the other.

    Points equal in both are all on the front. A NaN in either keeps a point off it, an infinity does not.
    """
    errors, times = np.asarray(errors, np.float64), np.asarray(times, np.float64)
    usable = ~(np.isnan(errors) | np.isnan(times))
    with np.errstate(invalid="ignore"):
        no_worse = (errors[:, None] <= errors) & (times[:, None] <= times)
        better = (errors[:, None] < errors) | (times[:, None] < times)
    beaten = np.any(no_worse & better & usable[:, None], axis=0)
    return usable & ~beaten


def is_exact(row: Row) -> bool:
    """Whether the row is at float precision: nothing that a user could gain in accuracy is left."""
    return row.projection_p95 <= EXACT_PIXELS and row.hit_mismatch <= EXACT_MISMATCH


def winners(comparison: Findings, error: str = "flip", time: str = "still_ms") -> list[Winner]:
    """The front from fast to exact; it ends at the first row at float precision, beyond which nothing is gained."""
    errors, times = comparison.column(error), comparison.column(time)
    front = pareto_front(errors, times)
    spreads = comparison.column(time.replace("_ms", "_spread"))
    found: list[Winner] = []
    for index in sorted(np.flatnonzero(front), key=lambda i: (times[i], errors[i])):
        if found and times[index] == found[-1].start_ms and errors[index] == getattr(found[-1].row, error):
            continue
        slower = times - times[index]
        near = (slower >= 0) & (slower <= np.nan_to_num(spreads) + np.nan_to_num(spreads[index]))
        near &= errors <= errors[index]
        ties = sorted((i for i in np.flatnonzero(near) if i != index), key=lambda i: (errors[i], times[i]))
        tie = comparison.rows[ties[0]] if ties else None
        found.append(Winner(comparison.rows[index], float(times[index]), tie))
        if is_exact(comparison.rows[index]):
            break
    return found


def quality(winner: Winner, error: str) -> str:
    """What a winner's error is worth, e.g. "FLIP 0.0002, at float precision; raytrace within the spread"."""
    column = COLUMNS[error]
    number = format_column(error, getattr(winner.row, error), 2)
    text = f"{column.title} {number}{'' if column.unit in ('', '%') else ' '}{column.unit}"
    if is_exact(winner.row):
        text += ", at float precision"
    if winner.tie is not None:
        text += f"; {winner.tie.label} within the spread"
    return text


def winner_sentence(comparison: Findings, error: str = "flip", time: str = "still_ms") -> str:
    """Which method wins at which time budget, e.g. "From 0.8 ms: cubemap 128 (FLIP 0.03); from 2.3 ms: invert
    (FLIP 0.0002, at float precision). Below 0.8 ms no method finishes a frame." """
    won = winners(comparison, error, time)
    if not won:
        return "No row has both a time and an error, so nothing can be said."
    parts = [f"from {format_number(w.start_ms)} ms: {w.row.label} ({quality(w, error)})" for w in won]
    return f"F{'; '.join(parts)[1:]}. Below {format_number(won[0].start_ms)} ms no method finishes a frame."


def headline(comparison: Findings) -> str:
    """The result in a sentence or two: which method is fastest at float precision, and what the others there take."""
    exact = [row for row in comparison.rows if is_exact(row) and not np.isnan(row.still_ms)]
    if not exact:
        return "No method reaches float precision in this scene."
    still = _fastest(exact, "still_ms")
    others = [f"{row.label} {format_number(row.still_ms)} ms" for row in exact]
    lead = "Frames"
    text = f"At float precision {still}."
    if not all(np.isnan(row.moving_ms) for row in exact):
        moving = _fastest(exact, "moving_ms")
        text = f"At float precision {still} when nothing moves, {moving} when all does."
        if still == moving:
            text = f"At float precision {still}, whether the scene moves or not."
        others = [f"{row.label} {format_number(row.still_ms)} and {format_number(row.moving_ms)} ms" for row in exact]
        lead = "Still and moving frames"
    return f"{text} {lead}: {', '.join(others)}." if len(others) <= 4 else text


def _fastest(rows: list[Row], time: str) -> str:
    """ "invert is fastest", or "invert and raytrace are level" where the spreads overlap."""
    timed = sorted((row for row in rows if not np.isnan(getattr(row, time))), key=lambda row: getattr(row, time))
    best, spread = timed[0], time.replace("_ms", "_spread")
    level = [
        row.label
        for row in timed
        if getattr(row, time) - getattr(best, time) <= np.nan_to_num(getattr(row, spread) + getattr(best, spread))
    ]
    if len(level) == 1:
        return f"{level[0]} is fastest"
    return f"{', '.join(level[:-1])} and {level[-1]} are level"


def fronts(comparison: Findings) -> list[dict[str, Any]]:
    """For each time and error column that has numbers: the front and the winners, fast to slow, and the sentence."""
    found = []
    for time in TIME_COLUMNS:
        times = comparison.column(time.name)
        for error in ERROR_COLUMNS:
            errors = comparison.column(error.name)
            front = np.flatnonzero(pareto_front(errors, times))
            if len(front) == 0:
                continue
            found.append(
                {
                    "error": error.name,
                    "time": time.name,
                    "rows": [comparison.rows[i].label for i in sorted(front, key=lambda i: (times[i], -errors[i]))],
                    "winners": [
                        {"start_ms": w.start_ms, "row": w.row.label, "quality": quality(w, error.name)}
                        for w in winners(comparison, error.name, time.name)
                    ],
                    "sentence": winner_sentence(comparison, error.name, time.name),
                }
            )
    return found
