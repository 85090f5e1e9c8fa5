"""`{plot} name`: a figure that docs/figures/NAME.py draws while the pages are built, once for light and once for dark.

The file has a function draw(theme) that returns a matplotlib Figure; FORMAT in it is "svg" or "png".
"""

import runpy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import Directive, directives

DOCS = Path(__file__).parents[1]
WIDTH = 7.3  # inches; text of 9 points then has its size in the column of a wide page


@dataclass(frozen=True)
class Theme:
    """Colors of a figure: text, weak text, lines of a grid, page, and a palette that color-blind readers can tell."""

    name: str
    text: str
    weak: str
    grid: str
    page: str
    palette: tuple[str, ...]
    width: float = WIDTH

    @property
    def settings(self) -> dict[str, Any]:
        """matplotlib's rcParams."""
        return {
            "figure.facecolor": "none",
            "axes.facecolor": "none",
            "savefig.facecolor": "none",
            "axes.edgecolor": self.weak,
            "axes.labelcolor": self.text,
            "axes.titlecolor": self.text,
            "axes.titlesize": 9.5,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.prop_cycle": _cycle(self.palette),
            "text.color": self.text,
            "xtick.color": self.weak,
            "ytick.color": self.weak,
            "xtick.labelcolor": self.text,
            "ytick.labelcolor": self.text,
            "grid.color": self.grid,
            "font.size": 9,
            "legend.frameon": False,
            "legend.fontsize": 8.5,
            "figure.constrained_layout.use": True,
            "svg.hashsalt": "mpcam",
            "savefig.dpi": 200,
        }

    def pictures(self, pictures: dict[str, Any], height: float, rows: int = 1) -> Any:
        """A figure of pictures (H, W, 3) by title, next to each other; height in inches."""
        from matplotlib import pyplot

        figure, axes = pyplot.subplots(rows, -(-len(pictures) // rows), figsize=(self.width, height))
        for place, (title, picture) in zip(axes.flat, pictures.items(), strict=True):
            place.imshow(picture, interpolation="antialiased")
            place.set_title(title)
            place.set_axis_off()
        return figure


def _cycle(palette: tuple[str, ...]) -> Any:
    from cycler import cycler

    return cycler(color=list(palette))


THEMES = (
    Theme("light", "#1f2328", "#6a737d", "#e3e5e8", "#ffffff", ("#0b62c4", "#c2560b", "#0a7f6b", "#8a3fb0", "#8a6d00")),
    Theme("dark", "#d5d8dc", "#8b949e", "#34383d", "#131416", ("#6cb0ff", "#f0955a", "#4cc9ae", "#c792ea", "#e0c04c")),
)


class Plot(Directive):
    """The figure of a script, with the directive's content as its caption."""

    required_arguments = 1
    has_content = True
    option_spec: ClassVar = {"alt": directives.unchanged_required}

    def run(self) -> list[nodes.Node]:
        name = self.arguments[0]
        if "alt" not in self.options:
            raise self.error(f"plot {name}: say in :alt: what is to be seen")
        script = DOCS / "figures" / f"{name}.py"
        self.state.document.settings.env.note_dependency(str(script))
        figure: Any = nodes.figure(classes=["plot"])
        for theme, path in draw(script).items():
            image = nodes.image(uri=f"/{path.relative_to(DOCS).as_posix()}", alt=self.options["alt"])
            image["classes"].append(f"only-{theme}")
            figure += image
        if self.content:
            text: Any = nodes.Element()
            self.state.nested_parse(self.content, self.content_offset, text)
            caption = nodes.caption("", "", *(child for paragraph in text for child in paragraph.children))
            figure += caption
        return [figure]


def draw(script: Path) -> dict[str, Path]:
    """Run a figure's script for each theme; the files by theme name, under docs/_build/figures."""
    import matplotlib
    from matplotlib import pyplot

    matplotlib.use("agg")
    folder = DOCS / "_build" / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    module = runpy.run_path(str(script))
    kind = module.get("FORMAT", "svg")
    files = {}
    for theme in THEMES:
        settings: Any = {**matplotlib.rcParamsDefault, "backend": "agg", **theme.settings}
        with matplotlib.rc_context(settings):
            figure = module["draw"](theme)
            files[theme.name] = folder / f"{script.stem}-{theme.name}.{kind}"
            figure.savefig(files[theme.name], metadata={"Date": None} if kind == "svg" else None)
            pyplot.close(figure)
    return files


def setup(app: Any) -> dict[str, bool]:
    app.add_directive("plot", Plot)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
