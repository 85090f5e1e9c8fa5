"""Rows, the front, the sentences, the plan of methods, and numbers as text."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpcam.comparison.columns import COLUMNS
from mpcam.comparison.numbers import format_column, format_number, format_spread
from mpcam.comparison.pareto import headline, is_exact, pareto_front, winner_sentence, winners
from mpcam.comparison.plan import MAX_TRIANGLES, make_plan
from mpcam.comparison.rows import Row
from mpcam.comparison.table import Comparison
from mpcam.errors import InputError


def row(method, flip, still, setting="", moving=np.nan, p95=1.0, **more) -> Row:
    return Row(
        method,
        setting,
        flip=flip,
        still_ms=still,
        still_spread=0.01,
        moving_ms=moving,
        moving_spread=0.01,
        projection_p95=p95,
        hit_mismatch=flip / 10,
        **more,
    )


def table() -> Comparison:
    return Comparison(
        (
            row("vertex", 0.2, 0.5, "level 0", 1.0, parameter=0),
            row("vertex", 0.05, 2.0, "level 1", 9.0, parameter=1),
            row("cubemap", 0.03, 0.8, "128", 2.0, parameter=128),
            row("invert", 2e-4, 2.3, moving=2.6, p95=1e-4),
            row("raytrace", 0.0, 2.9, moving=17.0, p95=1e-4),
        ),
        name="a scene",
    )


numbers = st.floats(0, 10, allow_nan=False) | st.just(np.nan) | st.just(np.inf)


@given(st.lists(st.tuples(numbers, numbers), max_size=12))
def test_the_front_is_what_nothing_beats(points):
    errors, times = [p[0] for p in points], [p[1] for p in points]
    front = pareto_front(errors, times)
    for i, (e, t) in enumerate(points):
        beaten = any(f <= e and s <= t and (f < e or s < t) for f, s in points)
        assert front[i] == (not np.isnan(e) and not np.isnan(t) and not beaten)


def test_winners_end_at_float_precision():
    won = winners(table())
    assert [w.row.label for w in won] == ["vertex level 0", "cubemap 128", "invert"]
    assert [w.start_ms for w in won] == [0.5, 0.8, 2.3]
    assert is_exact(won[-1].row)


def test_the_winner_sentence():
    assert winner_sentence(table()) == (
        "From 0.5 ms: vertex level 0 (FLIP 0.2); from 0.8 ms: cubemap 128 (FLIP 0.03); from 2.3 ms: invert "
        "(FLIP 2e-4, at float precision). Below 0.5 ms no method finishes a frame."
    )
    assert winner_sentence(table(), "hit_mismatch", "moving_ms").startswith(
        "From 1 ms: vertex level 0 (Hits wrong 2%);"
    )


def test_a_tie_within_the_spread_is_named():
    base = table()
    near = replace(base.rows[4], still_ms=2.3001)
    tied = replace(base, rows=(*base.rows[:4], near))
    assert "raytrace within the spread" in winner_sentence(tied)


def test_nothing_measured_gives_no_winner():
    empty = Comparison((Row("invert"),))
    assert winners(empty) == []
    assert "nothing can be said" in winner_sentence(empty)
    assert headline(empty) == "No method reaches float precision in this scene."


def test_the_headline_names_losses_too():
    assert headline(table()) == (
        "At float precision invert is fastest, whether the scene moves or not. "
        "Still and moving frames: invert 2.3 and 2.6 ms, raytrace 2.9 and 17 ms."
    )
    slow = replace(table(), rows=tuple(replace(r, still_ms=5.0) if r.method == "invert" else r for r in table().rows))
    assert headline(slow).startswith(
        "At float precision raytrace is fastest when nothing moves, invert is fastest when all"
    )


def test_the_headline_calls_no_winner_within_the_spread():
    rows = table().rows
    tied = replace(table(), rows=(*rows[:4], replace(rows[4], still_ms=2.3001)))
    assert headline(tied).startswith(
        "At float precision invert and raytrace are level when nothing moves, invert is fast"
    )


def test_rows_are_found_by_method_and_setting():
    assert table().row("invert").flip == 2e-4
    assert table().row("vertex", 1) is not table().row("vertex", "level 0")
    assert table().row("cubemap", 128).setting == "128"
    with pytest.raises(InputError, match="2 rows for method 'vertex'"):
        table().row("vertex")
    with pytest.raises(InputError, match="no row for method 'two_pass'"):
        table().row("two_pass")
    with pytest.raises(InputError, match="Unknown column"):
        table().column("speed")


def test_csv_and_json_hold_every_number():
    rows = (row("invert", 0.1, 1.0, psnr=np.inf, stages_ms={"bounds": 0.5}), row("raytrace", np.nan, 2.0, note="=1+1"))
    found = list(csv.DictReader(io.StringIO(Comparison(rows).to_csv())))
    assert [float(r["still_ms"]) for r in found] == [1.0, 2.0]
    assert (found[0]["psnr"], found[1]["flip"], found[0]["stage_bounds_ms"], found[1]["stage_bounds_ms"]) == (
        "inf",
        "",
        "0.5",
        "",
    )
    assert found[1]["note"] == "'=1+1"  # no formula for a spreadsheet
    data = json.loads(Comparison(rows).to_json())
    assert (data["rows"][0]["psnr"], data["rows"][1]["flip"]) == ("inf", None)
    assert set(COLUMNS) <= set(data["rows"][0])


def test_the_table_fits_a_terminal():
    text = str(replace(table(), left_out={"hemicube": "it covers the half space"}))
    assert max(len(line) for line in text.splitlines()) <= 100
    assert "vertex level 0" in text
    assert "2.30 ±0.01" in text
    assert "hemicube is left out: it covers the half space." in text
    assert "…" not in text


def test_markup_in_names_is_shown_as_it_is():
    assert "[red]x[/red]" in str(replace(table(), name="[red]x[/red]"))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.nan, "-"),
        (np.inf, "inf"),
        (0, "0"),
        (0.9, "0.9"),
        (2.3, "2.3"),
        (0.99951, "1"),
        (12345.6, "12,346"),
        (2_867_200, "2,867,200"),
        (1.5e-5, "1.5e-5"),
        (0.00123, "0.00123"),
        (9.999e-4, "0.001"),
        (-0.5, "-0.5"),
    ],
)
def test_numbers_as_text(value, text):
    assert format_number(value) == text


def test_shares_and_spreads_as_text():
    assert format_column("hit_mismatch", 0.0123) == "1.23"
    assert format_column("flip", 0.0123) == "0.0123"
    assert format_spread(1.654, 0.08) == "1.65 ±0.04"
    assert format_spread(0.9, np.nan) == "0.9"


def test_the_default_plan():
    assert [c.label for c in make_plan(1000)] == [
        "invert",
        *(f"vertex level {k}" for k in range(5)),
        *(f"cubemap {n}" for n in (64, 128, 256, 512)),
        *(f"hemicube {n}" for n in (64, 128, 256, 512)),
        "raytrace",
    ]


def test_tessellation_stays_below_the_limit_and_says_so():
    plan = make_plan(177_000, ["vertex"])
    levels = [c.parameter for c in plan]
    assert levels == [0, 1, 2]
    assert 177_000 * 4 ** levels[-1] <= MAX_TRIANGLES < 177_000 * 4 ** (levels[-1] + 1)
    assert "4,000,000" in plan[-1].note
    assert [c.parameter for c in make_plan(9_000_000, ["vertex"])] == [0]


def test_settings_replace_the_defaults():
    plan = make_plan(10, ["vertex", "invert"], {"vertex": [1, {"level": 3}], "invert": [{"bound": "tight"}]})
    assert [c.label for c in plan] == ["vertex level 1", "vertex level 3", "invert bound=tight"]
    assert plan[1].settings == {"level": 3}


@pytest.mark.parametrize(
    ("methods", "settings", "text"),
    [
        (["inverse"], None, "Unknown method 'inverse'"),
        (None, {"inverse": [1]}, "Unknown method 'inverse'"),
        (["invert"], {"vertex": [1]}, "not among the methods"),
        (["invert"], {"invert": [3]}, "no number to set"),
        (["vertex"], {"vertex": [3, {"level": 3}]}, "twice"),
    ],
)
def test_plans_that_make_no_sense_are_refused(methods, settings, text):
    with pytest.raises(InputError, match=text) as caught:
        make_plan(10, methods, settings)
    assert "\n" not in str(caught.value)
