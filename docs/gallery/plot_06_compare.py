"""
Compare, and read the Pareto front
==================================

Which method should draw this scene? `mpcam.compare` renders it by each, measures the
error against ray-traced first hits and the time of a frame, and marks what nothing else
beats in both.
"""

from operator import attrgetter

import matplotlib.pyplot as plt

import mpcam as mp

scene = mp.builtin_scene("facade", width=256, height=256)
table = mp.compare(
    scene,
    settings={
        "vertex": [0, 1, 2, 3],
        "cubemap": [64, 128, 256],
        "hemicube": [64, 128, 256],
    },
    repeats=5,
)

# %%
# The rows are plain data. Times depend on the machine that ran this; errors do not.
print(f"{'':15s} {'FLIP':>8s} {'error 95%':>12s} {'still':>9s} {'moving':>9s}")
for row in table:
    mark = "*" if row.on_front else " "
    print(
        f"{mark} {row.label:14s} {row.flip:7.4f} {row.projection_p95:9.5f} px"
        f" {row.still_ms:6.2f} ms {row.moving_ms:6.2f} ms"
    )

# %%
# A row is on the front if no other row is better in one of error and time and no worse
# in the other. Left and low is good. Ray tracing is the truth here, so its error is 0 by
# definition; it is drawn on the lower edge.
figure, axes = plt.subplots(1, 2, figsize=(7.6, 3.1), sharey=True)
floor = 1e-5
for one, time in zip(axes, ("still_ms", "moving_ms"), strict=True):
    for method in dict.fromkeys(row.method for row in table):
        rows = [row for row in table if row.method == method]
        x = [getattr(row, time) for row in rows]
        y = [max(row.flip, floor) for row in rows]
        one.loglog(x, y, "o-", label=method)
    one.set_xlabel(time.replace("_ms", " frame, ms"))
    one.xaxis.set_major_formatter("{x:g}")
    one.xaxis.set_minor_formatter("{x:g}")
    one.grid(True)
axes[0].set_ylabel("FLIP")
axes[1].legend()

# %%
# The same numbers in a sentence, which is what `mpcam compare` prints under its table.
# `table.write("out/facade")` writes CSV, JSON, the plot, all images and one web page.
exact = [row for row in table if row.projection_p95 < 2e-3]
for time in ("still_ms", "moving_ms"):
    best = min(exact, key=attrgetter(time))
    print(f"Fastest at float precision, {time}: {best.label}")
