"""How matplotlib draws in the gallery: colors that do on light and on dark pages alike, no background."""

from typing import Any

GREY = "#7d8590"


def reset(gallery_conf: Any, name: str, when: str) -> None:
    """Called by sphinx-gallery before and after each example."""
    import matplotlib
    from cycler import cycler

    matplotlib.rcdefaults()
    matplotlib.use("agg")
    matplotlib.rcParams.update(
        {
            "figure.facecolor": "none",
            "axes.facecolor": "none",
            "savefig.facecolor": "none",
            "axes.edgecolor": GREY,
            "axes.labelcolor": GREY,
            "axes.titlecolor": GREY,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.prop_cycle": cycler(color=["#2f81d8", "#d9712b", "#1a9c84", "#a35fc9", "#a8891d"]),
            "text.color": GREY,
            "xtick.color": GREY,
            "ytick.color": GREY,
            "grid.color": "#7d859040",
            "font.size": 9,
            "legend.frameon": False,
            "figure.constrained_layout.use": True,
            "savefig.dpi": 160,
        }
    )
