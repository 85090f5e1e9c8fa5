"""Plots of experiments, drawn once for light and once for dark pages, and pictures that move."""

import io
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.experiments.results import Picture, Plot
from mpcam.math.srgb import srgb_from_linear

DPI = 150


@dataclass(frozen=True)
class Theme:
    """Colors of a plot: text, weak text, grid, page, and a palette that color-blind readers can tell apart."""

    name: str
    ink: str
    soft: str
    grid: str
    page: str
    palette: tuple[str, ...]


# The page's own colors.
LIGHT = Theme(
    "light",
    "#1c1e21",
    "#5c6166",
    "#e6e6e1",
    "#ffffff",
    ("#0b62c4", "#c2560b", "#0a7f6b", "#8a3fb0", "#8a6d00", "#5c6166", "#b03060"),
)
DARK = Theme(
    "dark",
    "#e8e8e4",
    "#a3a8ad",
    "#2f3439",
    "#1b1e21",
    ("#6cb0ff", "#ff9d57", "#4fd0b6", "#d09af0", "#d8b94a", "#a3a8ad", "#ff8fb0"),
)


def png(plot: Plot, theme: Theme) -> bytes:
    """A plot as a PNG, on the theme's own ground."""
    return _saved(plot, theme, format="png", dpi=DPI, facecolor=theme.page)


def svg(plot: Plot, theme: Theme) -> bytes:
    """A plot as an SVG without a ground; letters are outlines, so that every reader sees the same."""
    return _saved(plot, theme, format="svg", transparent=True, metadata={"Date": None, "Creator": None})


def _saved(plot: Plot, theme: Theme, **how: Any) -> bytes:
    import matplotlib
    import matplotlib.style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    settings: Any = {
        "axes.edgecolor": theme.soft,
        "axes.facecolor": "none",
        "axes.labelcolor": theme.ink,
        "axes.axisbelow": True,
        "axes.titlecolor": theme.ink,
        "axes.titlesize": 11,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "font.size": 10,
        "grid.color": theme.grid,
        "legend.frameon": False,
        "svg.fonttype": "path",
        "svg.hashsalt": "mpcam",
        "text.color": theme.ink,
        "xtick.color": theme.soft,
        "xtick.labelcolor": theme.ink,
        "ytick.color": theme.soft,
        "ytick.labelcolor": theme.ink,
    }
    with matplotlib.style.context("default"), matplotlib.rc_context(settings):
        figure = Figure(figsize=(plot.width, plot.height), layout="constrained")
        FigureCanvasAgg(figure)
        plot.draw(figure, theme)
        out = io.BytesIO()
        figure.savefig(out, **how)
    return out.getvalue()


def gif(picture: Picture, shrink: int = 1) -> bytes:
    """The frames of a picture as a GIF that runs without end, `shrink` times smaller, all with one palette."""
    from PIL import Image

    bytes_ = [
        np.rint(255 * srgb_from_linear(np.asarray(frame, np.float64))).astype(np.uint8) for frame in picture.frames
    ]
    images = [Image.fromarray(frame).reduce(shrink) for frame in bytes_]
    rows = np.concatenate([np.asarray(image)[::4, ::4] for image in images])
    palette = Image.fromarray(rows).quantize(256)
    flat = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    out = io.BytesIO()
    each = round(1000 * picture.seconds)
    flat[0].save(out, "GIF", save_all=True, append_images=flat[1:], duration=each, loop=0, optimize=False)
    return out.getvalue()


def plain_ticks(axis: Any) -> None:
    """Numbers of a log axis as people write them: 100 and 0.5, not powers of ten. To be called when all is drawn."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 100 * low else (1,)))

    def plain(value: float, _: int) -> str:
        return f"{value:,.3f}".rstrip("0").rstrip(".") if value >= 1 else f"{value:g}"

    axis.set_major_formatter(FuncFormatter(plain))
    axis.set_minor_formatter(NullFormatter())
