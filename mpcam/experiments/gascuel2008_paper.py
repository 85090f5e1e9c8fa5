"""The figures that Gascuel et al. 2008 print: Tables 2 and 3, and the captions of Figs. 8 and 9."""

from typing import NamedTuple

NAN = float("nan")

TABLE_2 = {
    (512, "6 cube faces"): (2590.0, 548.0, 490.0),
    (512, "2 paraboloids"): (716.0, 157.0, 121.0),
    (16, "6 cube faces"): (8.8, 5.2, 4.8),
    (16, "2 paraboloids"): (3.4, 2.6, 2.4),
    (512, "5 hemicube faces"): (1500.0, 375.0, 320.0),
    (512, "1 paraboloid"): (375.0, 79.0, 61.0),
    (512, "1 cosine sphere"): (433.0, 71.0, 61.0),
    (512, "1 Lambert"): (396.0, 80.0, 67.0),
    (16, "5 hemicube faces"): (7.1, 4.3, 4.0),
    (16, "1 paraboloid"): (2.5, 1.9, 1.6),
}
"""Milliseconds for color, depth and coverage. The authors' slides have 2.2 where the table has 2.4."""


class PaperRow(NamedTuple):
    """A row of Table 3: thousands of pixels, per cent, milliseconds, and per cent of the linear view's total."""

    covered: float
    rendered: float
    overdraw: float
    vertex: float
    geometry: float
    raycasting: float
    lighting: float
    shadow: float
    texturing: float
    total: float
    ratio: float


TABLE_3 = {
    ("facade", 2800, "linear", ""): PaperRow(NAN, 249, NAN, 0.40, NAN, NAN, 0.33, 0.06, 0.45, 1.25, 100),
    ("facade", 2800, "cosine sphere", "triangle"): PaperRow(
        308, 173, 78, 0.41, 0.57, 0.13, 0.34, 0.57, 0.24, 2.25, 180
    ),
    ("facade", 2800, "paraboloid", "triangle"): PaperRow(406, 197, 106, 0.41, 0.69, 0.16, 0.39, 0.70, 0.17, 2.52, 202),
    ("facade", 2800, "cosine sphere", "quad"): PaperRow(897, 173, 418, 0.41, 0.40, 0.33, 0.44, 0.26, 0.36, 2.20, 176),
    ("facade", 2800, "paraboloid", "quad"): PaperRow(714, 181, 294, 0.40, 0.36, 0.29, 0.42, 0.22, 0.37, 2.06, 165),
    ("facade", 2800, "fisheye 1", "quad"): PaperRow(5089, 172, 2859, 0.40, 0.47, 2.55, 0.53, 0.61, 0.65, 5.21, 417),
    ("facade", 2800, "fisheye 2", "quad"): PaperRow(5006, 172, 2810, 0.40, 0.44, 2.00, 0.79, 0.49, 0.62, 4.74, 379),
    ("facade", 600, "paraboloid", "quad"): PaperRow(702, 181, 288, 0.39, 0.16, 0.26, 0.44, 0.17, 0.13, 1.55, 128),
    ("facade", 4900, "paraboloid", "quad"): PaperRow(786, 182, 332, 0.45, 0.52, 0.29, 0.43, 0.27, 0.49, 2.44, 185),
    ("temple", 4000, "paraboloid", "quad"): PaperRow(1950, 250, 680, 0.17, 0.33, 0.77, 0.63, 0.42, 0.57, 2.88, 461),
    ("patio", 560_000, "paraboloid", "quad"): PaperRow(
        1271, 335, 279, 7.55, 31.47, 0.86, 0.24, 5.93, 38.28, 79.85, 600
    ),
    # Of these the caption of Fig. 9 has the overdraw and the total.
    ("characters", 177_000, "paraboloid", "triangle"): PaperRow(NAN, NAN, 37, NAN, NAN, NAN, NAN, NAN, NAN, 107, NAN),
    ("characters", 177_000, "paraboloid", "quad"): PaperRow(NAN, NAN, 107, NAN, NAN, NAN, NAN, NAN, NAN, 63, NAN),
}
"""By scene, triangles, projection and bound."""

GROWTH = {600: 1.55, 2800: 2.06, 4900: 2.44, 560_000: 79.85}
"""Total milliseconds of Table 3's paraboloid with quads, by triangles: Facade three times, and Patio."""
