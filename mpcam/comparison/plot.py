"""The picture of error against time, drawn by matplotlib."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.comparison.columns import COLUMNS
from mpcam.comparison.pareto import pareto_front
from mpcam.comparison.rows import Findings
from mpcam.effects.mirror_methods import MIRROR_METHODS
from mpcam.rendering.registry import METHODS

STYLES = {name: entry.style for name, entry in (MIRROR_METHODS | METHODS).items()}
OTHER = ("#8a6d00", "P")


ERRORS = ("flip", "projection_median", "ray_angle")


def draw(comparison: Findings, path: Path, errors: tuple[str, ...] = ERRORS) -> None:
    """Write a PNG with a row of log-log panels for each error, one for each time that was measured, with the front.

    Errors that no row has get no panel. Errors of zero have no place on a log axis: they stand in a band marked 0
    below the smallest decade.
    """
    import matplotlib.style

    known = tuple(name for name in errors if not np.isnan(comparison.column(name)).all()) or errors[:1]
    with matplotlib.style.context("default"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")  # a name in a script that the font lacks
        _draw(comparison, path, known)


def _draw(comparison: Findings, path: Path, errors: tuple[str, ...]) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    times = [name for name in ("still_ms", "moving_ms") if np.any(np.isfinite(comparison.column(name)))]
    figure = Figure(figsize=(6.2 * max(len(times), 1), 0.6 + 4.1 * len(errors)), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(_plain(comparison.name), x=0.01, ha="left", fontsize=13, fontweight="bold")
    panels, handles = [], {}
    for row, error in enumerate(errors):
        for column, time in enumerate(times):
            axes = figure.add_subplot(len(errors), len(times), row * len(times) + column + 1)
            panels.append((axes, *_panel(axes, comparison, error, time, handles)))
            unit = COLUMNS[error].unit
            axes.set_ylabel(COLUMNS[error].title + (f" ({unit})" if unit else "") if column == 0 else "")
    if handles:
        names = [_plain(name) for name in handles]
        figure.legend(handles.values(), names, loc="outside lower center", ncols=len(handles), frameon=False)
    labels = [_plain(row.setting.replace("level ", "L") or row.method) for row in comparison.rows]
    colors = [STYLES.get(row.method, OTHER)[0] for row in comparison.rows]
    for axes, x, y, usable in panels:
        _label(figure, axes, x, y, labels, usable, colors)
    figure.savefig(path)


def _panel(
    axes: Any, comparison: Findings, error: str, time: str, handles: dict[str, Any]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, lines and front of one error against one time; returns where the points are, and which are shown."""
    times, errors = comparison.column(time), comparison.column(error) * (100 if COLUMNS[error].unit == "%" else 1)
    positive = errors[np.isfinite(errors) & (errors > 0)]
    low = 10.0 ** np.floor(np.log10(positive.min() * 0.9)) if positive.size else 0.01
    high = max(positive.max() * 2 if positive.size else 1.0, low * 10)
    has_zero = bool(np.any(errors == 0))
    zero = low * 10**-0.45
    usable = np.isfinite(times) & np.isfinite(errors)
    shown = np.where(errors == 0, zero, errors)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major", color="#e3e3e0", linewidth=0.8)
    axes.grid(True, which="minor", color="#f1f1ee", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    front = np.flatnonzero(pareto_front(errors, times) & usable)
    order = sorted(front, key=lambda i: (times[i], -errors[i]))
    if order:
        x = [times[order[0]], *np.repeat(times[order][1:], 2), times[usable].max() * 1.3]
        y = [*np.repeat(shown[order], 2)]
        line = axes.plot(x, y, color="#9a9a94", linewidth=5, alpha=0.35, solid_joinstyle="round", zorder=1)
        handles["Pareto front"] = line[0]
    for method in dict.fromkeys(row.method for row in comparison.rows):
        color, marker = STYLES.get(method, OTHER)
        index = [i for i, row in enumerate(comparison.rows) if row.method == method and usable[i]]
        axes.plot(times[index], shown[index], color=color, linewidth=1, alpha=0.6, zorder=2)
        place = (times[index], shown[index])
        handles[method] = axes.scatter(*place, color=color, marker=marker, s=46, zorder=3, lw=0.8, ec="white")
    span = times[usable] if usable.any() else np.array([1.0])
    axes.set_xlim(span.min() / 1.35, span.max() * 1.7)
    axes.set_ylim(low * (10**-0.8 if has_zero else 0.8), high)
    _ticks(axes, low, zero if has_zero else None)
    axes.set_xlabel(f"{COLUMNS[time].title}, median (ms)")
    return times, shown, usable


def _ticks(axes: Any, low: float, zero: float | None) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogFormatterSciNotation, LogLocator, NullFormatter

    plain = FuncFormatter(lambda value, _: f"{value:g}")
    left, right = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if right / left < 300 else (1,)))
    axes.xaxis.set_major_formatter(plain)
    axes.xaxis.set_minor_formatter(NullFormatter())
    if zero is None:
        return
    top = axes.get_ylim()[1]
    decades = np.arange(round(np.log10(low)), np.floor(np.log10(top)) + 1)
    scientific = LogFormatterSciNotation()
    scientific.set_axis(axes.yaxis)
    axes.yaxis.set_major_locator(FixedLocator([zero, *10.0**decades]))
    axes.yaxis.set_major_formatter(
        FuncFormatter(lambda value, at: "0" if value < low * 0.99 else scientific(value, at))
    )
    axes.yaxis.set_minor_locator(FixedLocator([m * 10.0**d for d in decades for m in range(2, 10)]))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.axhspan(axes.get_ylim()[0], low * 10**-0.2, color="#f4f4f0", zorder=0)


def _label(figure: Any, axes: Any, x: Any, y: Any, labels: list[str], usable: Any, colors: list[str]) -> None:
    """Put each label at the first of eight places around its point that is free; leave it out where none is."""
    from matplotlib.patheffects import withStroke

    figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    box = axes.get_window_extent(renderer)
    index = np.flatnonzero(usable)
    if len(index) == 0:
        return
    points = axes.transData.transform(np.stack([x[index], y[index]], axis=-1))
    reach = 5.0 * figure.dpi / 72
    taken = [(px - reach, py - reach, px + reach, py + reach) for px, py in points]
    for own, (i, (px, py)) in enumerate(zip(index, points, strict=True)):
        if not labels[i]:
            continue
        text = axes.annotate(
            labels[i],
            (x[i], y[i]),
            fontsize=8,
            color=colors[i],
            zorder=4,
            xytext=(0, 0),
            textcoords="offset points",
            path_effects=[withStroke(linewidth=2, foreground="white")],
        )
        extent = text.get_window_extent(renderer)
        width, height, gap = extent.width, extent.height, reach * 1.3
        middle_x, middle_y = px - width / 2, py - height / 2
        near = gap * 0.6
        places = [
            (px + near, py + near),
            (px + gap, middle_y),
            (middle_x, py + gap),
            (px - near - width, py - near - height),
            (middle_x, py - gap - height),
            (px + near, py - near - height),
            (px - gap - width, middle_y),
            (px - near - width, py + near),
        ]
        for left, bottom in places:
            area = (left, bottom, left + width, bottom + height)
            inside = area[0] >= box.x0 and area[2] <= box.x1 and area[1] >= box.y0 and area[3] <= box.y1
            if inside and not any(_overlap(area, other) for k, other in enumerate(taken) if k != own):
                offset = ((left - px) * 72 / figure.dpi, (bottom - py) * 72 / figure.dpi)
                text.set_position(offset)
                taken.append(area)
                break
        else:
            text.remove()


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _plain(text: str) -> str:
    """Text that matplotlib does not take for mathematics."""
    return text.replace("$", r"\$")
