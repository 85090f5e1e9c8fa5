"""A comparison of plain data, made without a renderer."""

from dataclasses import replace

import numpy as np

from mpcam.cameras import Radial
from mpcam.comparison.pareto import pareto_front
from mpcam.comparison.rows import Row
from mpcam.comparison.table import Comparison

HOSTILE = """a <b>"scene"</b> & </script><img src=x onerror="window.broken=1"> 'x' {{DATA}} <!-- $1$ ünï"""
SIZE = 48


def comparison(name: str = HOSTILE) -> Comparison:
    """Fifteen rows with images whose noise grows with their error: plain data, no renderer."""
    random = np.random.default_rng(3)
    y, x = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    truth = np.stack([0.5 + 0.4 * np.sin(9 * x), 0.3 + 0.5 * x * y, 0.6 - 0.4 * x], -1).astype(np.float32)
    settings = [("invert", "", None, 2e-4, 2.31, 3.05), ("raytrace", "", None, 0.0, 1.4, 5.1)]
    settings += [("vertex", f"level {k}", k, 0.21 / 4**k, 0.9 * 1.9**k, 1.4 * 2.5**k) for k in range(5)]
    for k, n in enumerate((64, 128, 256, 512)):
        settings += [("cubemap", f"{n}", n, 0.12 / 2**k, 1.5 * 1.5**k, 3.3 * 1.5**k)]
        settings += [("hemicube", f"{n}", n, 0.121 / 2**k, 1.1 * 1.5**k, 2.2 * 1.5**k)]
    rows, images = [], {}
    for method, setting, parameter, error, still, moving in settings:
        row = Row(
            method,
            setting,
            parameter,
            hit_mismatch=error / 10,
            triangle_mismatch=error / 5,
            depth_median=error / 9,
            depth_p999=error,
            rmse=error,
            psnr=np.inf if error == 0 else -20 * np.log10(error),
            flip=error,
            projection_median=error * 10,
            projection_p95=error * 30,
            projection_max=error * 900,
            still_ms=still,
            still_spread=0.05 * still,
            moving_ms=moving,
            moving_spread=0.07 * moving,
            shade_ms=1.9,
            compile_ms=600.0,
            stages_ms={"build": moving - still, "trace": still},
            tests=1e6 * still,
            rendered=2e5,
            overdraw=5 * still,
            note="=note <i>",
        )
        rows.append(row)
        images[row.label] = np.clip(truth + error * random.standard_normal(truth.shape), 0, None).astype(np.float32)
    front = pareto_front([r.flip for r in rows], [r.still_ms for r in rows])
    depth = np.where(truth[..., 0] > 0.5, 2.0, np.inf).astype(np.float32)
    return Comparison(
        tuple(replace(r, on_front=bool(on)) for r, on in zip(rows, front, strict=True)),
        name,
        {"scene": name},
        {"processor": "a <b>chip</b>"},
        {"rounds": "9"},
        {"other": "it <i>does not</i> apply"},
        images,
        truth,
        depth,
        Radial.paraboloid(SIZE, SIZE),
    )
