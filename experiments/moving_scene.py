"""Rasterizing against rebuilding and tracing: whole frames of moving and still scenes by number of triangles.

    python experiments/moving_scene.py [--repeats 31] [--output out/moving_scene]

A wavy sphere around a paraboloid camera, 512 x 512 pixels, at four levels of detail, and the built-in scenes. `invert`
and `raytrace` run interleaved in one process; both upload the new vertices, then one bounds and inverts, the other
rebuilds its tree and traces the same rays. Writes moving_scene.csv and prints the ratios of the medians.
"""

import argparse
import csv
from pathlib import Path

import numpy as np

import mpcam as mp
from mpcam.io.atomic import atomic_path

LEVELS = (80, 1280, 20480, 327680)


def wavy_sphere(triangles: int) -> mp.Scene:
    """A closed surface around the camera whose distance varies between 0.8 and 1.2."""
    sphere = mp.builtin_mesh("sphere", triangles=triangles)
    scale = 1 + 0.2 * np.sin(5 * sphere.vertices[:, :1])
    mesh = mp.Mesh(sphere.vertices * scale, sphere.faces, name=f"sphere {triangles}")
    return mp.Scene((mesh,), camera=mp.Radial.paraboloid(512, 512), name=mesh.name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=31)
    parser.add_argument("--output", type=Path, default=Path("out/moving_scene"))
    options = parser.parse_args()
    scenes = [wavy_sphere(count) for count in LEVELS]
    scenes += [mp.builtin_scene(name) for name in ("facade", "temple", "characters", "patio")]
    rows = []
    print(f"{'scene':16s}{'triangles':>10s}{'invert':>20s}{'raytrace':>20s}{'ratio':>16s}")
    print(f"{'':26s}{'still      moving':>20s}{'still      moving':>20s}{'still   moving':>16s}   (ms)")
    for scene in scenes:
        table = mp.compare(scene, ["invert", "raytrace"], repeats=options.repeats)
        ours, theirs = table.row("invert"), table.row("raytrace")
        row = {
            "scene": scene.name,
            "triangles": scene.mesh.triangle_count,
            "invert_still_ms": ours.still_ms,
            "invert_moving_ms": ours.moving_ms,
            "raytrace_still_ms": theirs.still_ms,
            "raytrace_moving_ms": theirs.moving_ms,
            "still_ratio": ours.still_ms / theirs.still_ms,
            "moving_ratio": ours.moving_ms / theirs.moving_ms,
            "overdraw": ours.overdraw,
        }
        rows.append(row)
        numbers = f"{ours.still_ms:10.2f}{ours.moving_ms:10.2f}{theirs.still_ms:10.2f}{theirs.moving_ms:10.2f}"
        print(f"{scene.name:16s}{row['triangles']:10d}{numbers}{row['still_ratio']:8.2f}{row['moving_ratio']:8.2f}")
    options.output.mkdir(parents=True, exist_ok=True)
    with atomic_path(options.output / "moving_scene.csv") as path, open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    print(f"written: {options.output / 'moving_scene.csv'}")


if __name__ == "__main__":
    main()
