"""Stand-ins for the scenes of Yu et al. 2009: solids on a ground plane, a cow, a teapot. Metres, z up.

The paper's models are not public: these are made by formula, with about its numbers of triangles.
"""

import functools
from typing import Any

import numpy as np

from mpcam.experiments.hou2006_scenes import checker
from mpcam.experiments.hou2006_solids import plane
from mpcam.experiments.hou2006_teapot import teapot
from mpcam.geometry.mesh import Material, Mesh
from mpcam.geometry.shapes import Builder, boxes, copies, ellipsoid, lathe, loft, moved, smooth_curve
from mpcam.geometry.textures import noise, painted, rgb, textured
from mpcam.scene.scene import DirectionalLight, Scene

SPHERE, CYLINDER, BOX = 260, 40, 12
"""Triangles of a solid, as in the paper's Fig. 5."""
GROUND = (6.0, 7.0)
"""Half the width of the ground, and half its depth."""
SKY = (0.78, 0.86, 0.94)
LIGHTS = (
    DirectionalLight((0.45, 0.6, -0.9), (0.62, 0.6, 0.55)),
    DirectionalLight((-0.8, -0.35, -0.35), (0.3, 0.31, 0.34)),
    DirectionalLight((0.7, -0.6, -0.2), (0.22, 0.22, 0.24)),
)
"""From all sides, so that no column of a panorama is in the dark."""
AMBIENT = (0.3, 0.31, 0.34)


def solids_scene() -> Scene:
    """Spheres, cylinders and boxes on a ground of two triangles with a chessboard."""
    builder, (wide, deep) = Builder(), GROUND
    builder.add(plane((-wide, -deep), (wide, deep), 1), textured("ground", checker("#efe9da", "#7d8f86", 512)))
    for x, y, radius, code in (
        (-1.9, -2.6, 0.75, "#d2452f"),
        (0.6, -0.4, 0.9, "#2f7fb5"),
        (3.3, 2.2, 1.0, "#e3b23c"),
        (-3.4, 3.4, 1.1, "#7a4fa3"),
    ):
        builder.add(ellipsoid((x, y, radius), (radius, radius, radius), 11, 13), painted(code, code))
    for x, y, radius, height, code in (
        (2.4, -2.7, 0.5, 1.5, "#3f9a63"),
        (-1.6, 1.2, 0.5, 2.2, "#c2560b"),
        (1.1, 4.3, 0.6, 2.6, "#3f9a63"),
    ):
        shape = lathe([(0, 0), (radius, 0), (radius, height), (0, height)], 10, smooth=False)
        builder.add(moved(shape, (x, y, 0.002)), painted(code, code))
    for x, y, size, height, turn, code in (
        (-3.7, -0.6, 1.1, 1.1, 0.4, "#8a6d00"),
        (3.6, -0.7, 1.0, 1.8, -0.3, "#b03060"),
        (-0.6, -4.2, 1.2, 0.7, 0.15, "#0a7f6b"),
    ):
        half = 0.5 * size
        builder.add(moved(boxes((-half, -half, 0), (half, half, height)), (x, y, 0.002), turn), painted(code, code))
    return Scene((builder.mesh("solids"),), None, LIGHTS[:2], AMBIENT, SKY, "solids on a ground plane")


@functools.cache
def cow() -> Mesh:
    """A cow of 5,840 triangles, 2.5 long, its head towards +x and its middle on the z axis."""
    builder = Builder()
    hide = textured("hide", _patches())
    white, dark, pink, horn = (painted(code, code) for code in ("#f3ede2", "#2b2522", "#e2a593", "#d8cba6"))

    def tube(knots: Any, radii: Any, rows: int, segments: int, material: Material, across: Any = (0, 1, 0)) -> None:
        """A tube along a smooth curve; each knot has a radius, or one across and one at right angles."""
        widths = np.asarray(radii, float)
        widths = widths.reshape(len(knots), -1)
        ends = np.maximum(smooth_curve(widths, rows), 0.01)
        ends[[0, -1]] = widths[[0, -1]]  # exactly: no radius closes a tube
        ends = np.repeat(ends, 2, axis=1) if ends.shape[1] == 1 else ends
        builder.add(loft(smooth_curve(knots, rows), ends, segments, across), material)

    tube(
        [
            (-0.92, 0, 1.1),
            (-0.86, 0, 1.1),
            (-0.45, 0, 1.06),
            (0, 0, 1.0),
            (0.45, 0, 1.04),
            (0.78, 0, 1.1),
            (0.86, 0, 1.1),
        ],
        [(0, 0), (0.2, 0.24), (0.33, 0.36), (0.37, 0.4), (0.33, 0.37), (0.2, 0.26), (0, 0)],
        *(29, 28, hide),
    )
    tube([(0.6, 0, 1.14), (0.82, 0, 1.3), (1.0, 0, 1.52)], [(0.2, 0.28), (0.15, 0.23), (0.11, 0.15)], 11, 22, hide)
    tube(
        [(0.92, 0, 1.66), (0.95, 0, 1.64), (1.1, 0, 1.54), (1.3, 0, 1.4), (1.42, 0, 1.31)],
        [(0, 0), (0.13, 0.12), (0.16, 0.16), (0.11, 0.12), (0.1, 0.1)],
        *(15, 22, white),
    )
    tube([(1.36, 0, 1.355), (1.42, 0, 1.31), (1.47, 0, 1.27), (1.5, 0, 1.25)], [0.1, 0.125, 0.1, 0], 8, 18, pink)
    for side in (1, -1):
        for x in (0.55, -0.62):
            top = [(x, 0.2 * side, 0.95), (x - 0.02, 0.21 * side, 0.6), (x + 0.02, 0.21 * side, 0.35)]
            foot = [(x, 0.21 * side, 0.1), (x, 0.21 * side, 0.09)]
            tube([*top, *foot], [0.15, 0.11, 0.075, 0.07, 0.07], 11, 14, hide if x < 0 else white, (1, 0, 0))
            hoof = [
                (x, 0.21 * side, 0.11),
                (x, 0.21 * side, 0.1),
                (x + 0.02, 0.21 * side, 0.0),
                (x, 0.21 * side, -0.01),
            ]
            tube(hoof, [0, 0.08, 0.1, 0], 5, 12, dark, (1, 0, 0))
        points = [
            (1.0, 0.09 * side, 1.68),
            (1.0, 0.21 * side, 1.74),
            (1.06, 0.27 * side, 1.88),
            (1.09, 0.25 * side, 1.96),
        ]
        tube(points, [0.045, 0.04, 0.025, 0], 9, 11, horn, (1, 0, 0))
        ear = copies(ellipsoid((0, 0, 0), (0.05, 0.13, 0.07), 8, 12), _turned(side))
        builder.add(ear, hide)
        builder.add(ellipsoid((1.17, 0.145 * side, 1.54), (0.03, 0.02, 0.03), 6, 10), dark)
        builder.add(ellipsoid((1.475, 0.05 * side, 1.3), (0.03, 0.018, 0.022), 4, 8), dark)
    builder.add(ellipsoid((-0.42, 0, 0.7), (0.2, 0.15, 0.13), 10, 16), pink)
    tail = [(-0.88, 0, 1.2), (-1.02, 0, 1.2), (-1.08, 0, 0.95), (-1.06, 0.03, 0.6)]
    tube(tail, [0.05, 0.035, 0.025, 0.02], 14, 9, white)
    builder.add(ellipsoid((-1.06, 0.03, 0.5), (0.05, 0.05, 0.14), 8, 12), dark)
    return builder.mesh("cow")


def cow_scene() -> Scene:
    """The cow alone before a plain ground."""
    return Scene((cow(),), None, LIGHTS, AMBIENT, SKY, "cow")


def teapot_scene(level: int = 76) -> Scene:
    """A teapot of about 14,000 triangles, whose sides differ in color."""
    mesh = teapot(level)
    x, y, z = np.asarray(mesh.vertices).T
    turn = np.arctan2(y, x)
    hues = 0.5 + 0.38 * np.stack([np.cos(turn), np.cos(turn - 2.1), np.cos(turn + 2.1)], axis=1)
    bands = np.where((z > 0.3) & (z < 0.56), 0.25 + 0.75 * (np.cos(8 * turn) > 0), 1.0)
    found = Mesh(mesh.vertices, mesh.faces, normals=mesh.normals, colors=hues * bands[:, None], name="teapot")
    return Scene((found,), None, LIGHTS, AMBIENT, SKY, "teapot")


def _turned(side: int) -> np.ndarray:
    """Where an ear is: it points to a side, and down a little."""
    c, s = np.cos(0.35), np.sin(0.35) * -side
    return np.array([[(1.0, 0, 0, 0.98), (0, c, -s, 0.22 * side), (0, s, c, 1.58), (0, 0, 0, 1)]])


def _patches(size: int = 256) -> np.ndarray:
    """Brown patches on white."""
    dark = noise(size, 5, 0.1) > 0.35
    return np.where(dark[..., None], rgb("#6b4226"), rgb("#f3ede2")).astype(np.float32)
