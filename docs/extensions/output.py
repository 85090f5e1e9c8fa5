"""Text that a program prints, taken while the pages are built: it cannot drift from the program."""

import subprocess
import sys
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive

from mpcam.cli import main


class CommandHelp(Directive):
    """`{command-help} compare`: what `mpcam compare --help` prints; without an argument, `mpcam --help`."""

    optional_arguments = 1

    def run(self) -> list[nodes.Node]:
        command = [*self.arguments[:1], "--help"]
        done = subprocess.run(
            [sys.executable, "-m", main.__module__.split(".")[0], *command], capture_output=True, text=True, timeout=60
        )
        if done.returncode:
            raise self.error(f"mpcam {' '.join(command)} fails: {done.stderr.strip()}")
        text = "\n".join(line.rstrip() for line in done.stdout.strip().splitlines())
        block: Any = nodes.literal_block(text, text)
        block["language"] = "text"
        block["classes"].append("command-help")
        return [block]


class WorkCounts(Directive):
    """A table of the pixel tests that each built-in scene takes: counts of the code, the same on every machine."""

    def run(self) -> list[nodes.Node]:
        import mpcam as mp

        titles = ("scene", "triangles", "pixels hit", "tests", "tests that hit", "tests per hit")
        rows = []
        for name in ("facade", "temple", "characters", "patio"):
            scene = mp.builtin_scene(name)
            hits = mp.rasterize(scene.camera, scene.mesh)
            counts = (scene.mesh.triangle_count, int(hits.mask.sum()), hits.stats.tests, hits.stats.rendered)
            rows.append((name, *(f"{count:,}" for count in counts), f"{hits.stats.overdraw:.2f}"))
        return [_table(titles, rows)]


def _table(titles: tuple[str, ...], rows: list[tuple[str, ...]]) -> nodes.table:
    group = nodes.tgroup(cols=len(titles))
    group += [nodes.colspec(colwidth=1) for _ in titles]
    head, body = nodes.thead(), nodes.tbody()
    head += _row(titles)
    body += [_row(row) for row in rows]
    group += [head, body]
    table = nodes.table(classes=["numbers"])
    table += group
    return table


def _row(cells: tuple[str, ...]) -> nodes.row:
    row = nodes.row()
    for cell in cells:
        row += nodes.entry("", nodes.paragraph(cell, cell))
    return row


def setup(app: Any) -> dict[str, bool]:
    app.add_directive("command-help", CommandHelp)
    app.add_directive("work-counts", WorkCounts)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
