"""Picture and table of the README from what `make demo` wrote: `python tools/readme.py [out/demo]`."""

import json
import re
import sys
from pathlib import Path

import numpy as np

import mpcam as mp

ROOT = Path(__file__).resolve().parent.parent
SHOWN = (("invert", ""), ("vertex", "level 1"), ("cubemap", "128"), ("raytrace", ""))
ROWS = (*SHOWN[:1], ("vertex", "level 0"), *SHOWN[1:2], ("vertex", "level 2"), ("vertex", "level 4"),
        ("cubemap", "128"), ("cubemap", "512"), ("hemicube", "512"), *SHOWN[3:])  # fmt: skip


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo") / "facade"
    result = json.loads((folder / "results.json").read_text())
    rows = {(row["method"], row["setting"]): row for row in result["rows"]}
    picture(folder, rows)
    readme = ROOT / "README.md"
    text = readme.read_text()
    block = f"<!-- demo table -->\n\n{table(result, rows)}\n\n<!-- end of demo table -->"
    text = re.sub(r"<!-- demo table -->(.*<!-- end of demo table -->)?", lambda _: block, text, flags=re.DOTALL)
    readme.write_text(text)


def table(result: dict, rows: dict) -> str:
    """The main columns in Markdown, with a line that says what they are."""
    lines = ["| method | FLIP | hits wrong | projection error, median | still frame | moving frame |"]
    lines.append("|---|--:|--:|--:|--:|--:|")
    for key in ROWS:
        row = rows[key]
        numbers = (f"{row['flip']:.2g}", f"{100 * row['hit_mismatch']:.2g} %", f"{row['projection_median']:.2g} px")
        times = (f"{row['still_ms']:.1f} ms", f"{row['moving_ms']:.1f} ms")
        lines.append(f"| {' '.join(key).strip()} | " + " | ".join((*numbers, *times)) + " |")
    facts = f"{int(result['scene']['triangles'].replace(',', '')):,} triangles, paraboloid, 512 x 512"
    machine = f"{result['machine']['threads']} threads of {result['machine']['processor']}"
    note = (
        f"Some of the rows that the demo prints for its first scene ({facts}; {machine}; medians of interleaved "
        "rounds). `raytrace` is the truth; what is left of its projection error is that of float32. A moving frame "
        "starts with new vertices, and the ray tracer with a new tree."
    )
    return "\n".join([*lines, "", note])


def picture(folder: Path, rows: dict) -> None:
    """The frame by some methods, above what differs from the truth."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 6.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, len(SHOWN))
    for column, key in enumerate(SHOWN):
        name = " ".join(key).strip()
        stem = name.replace(" ", "-")
        for line, suffix in enumerate(("", "-difference")):
            image = mp.read_image(folder / "images" / f"{stem}{suffix}.png")
            shown = np.clip(image, 0, 1) ** (1 / 2.2)
            axes[line, column].imshow(shown[..., :3])
            axes[line, column].axis("off")
        row = rows[key]
        axes[0, column].set_title(f"{name}\nFLIP {row['flip']:.2g}   {row['moving_ms']:.1f} ms", fontsize=11)
    figure.savefig(ROOT / "docs" / "_static" / "demo.png")


if __name__ == "__main__":
    main()
