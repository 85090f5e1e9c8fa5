"""The Characters scene: people of many small triangles on a plain ground of two.

Stands in for the scene of that name in Gascuel et al. 2008, section 5.1 (177,000 triangles).
"""

import numpy as np

from mpcam.geometry.character_body import Look, Sizes, figure
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, copies, placements, quads
from mpcam.geometry.textures import plaster, textured

# distance from the eye, bearing from +x in degrees, height, look
_PEOPLE = [
    (1.25, 88, 1.78, Look("#e2b08c", "#3a2a20", "#b23a3a", "#2f3f5f", "wave")),
    (1.35, 45, 1.66, Look("#8d5a3c", "#1d1612", "#e3b23c", "#4a7a6a", "stand", skirt=True, long_hair=True)),
    (1.4, 133, 1.84, Look("#f0c8a8", "#8a5a2b", "#3f6fa0", "#5a5048", "hips", hat="#4b3a2a")),
    (1.5, 6, 1.72, Look("#c98d63", "#241a14", "#5f8f4a", "#38342f", "walk")),
    (1.5, 175, 1.70, Look("#f2d0b4", "#c9a050", "#8a4f8f", "#7a3f5f", "hips", skirt=True, long_hair=True)),
    (2.5, 67, 1.70, Look("#6f452e", "#15110f", "#d8d4c8", "#30505f", "wave", long_hair=True)),
    (2.6, 111, 1.80, Look("#e6bd98", "#7a7a7a", "#2f5a50", "#6a5a40", "stand", hat="#233a36")),
    (2.7, 27, 1.74, Look("#d8a27a", "#2a1d16", "#c8743a", "#2b2b38", "walk")),
    (2.7, 154, 1.68, Look("#f0cdb0", "#5a3220", "#d06a80", "#e0d8c8", "stand", skirt=True, long_hair=True)),
    (1.7, 235, 1.76, Look("#a86f4a", "#2a1a12", "#46728c", "#7a6a50", "hips")),
    (1.8, 300, 1.64, Look("#efc3a0", "#7a2f1a", "#e8dcc0", "#9a4a3a", "wave", skirt=True, long_hair=True)),
]


def characters(triangles: int) -> Mesh:
    """Eleven people around the eye, most of them towards +y. triangles: 25,000 to 2,000,000; met within 3 %."""
    builder = Builder()
    ground = textured("ground", plaster("#b7b09c", 51, contrast=0.07))
    corners = np.array([(-40.0, -40.0, 0.0), (40.0, -40.0, 0.0), (40.0, 40.0, 0.0), (-40.0, 40.0, 0.0)])
    builder.add(quads(corners, corners[:, :2] / 3.0), ground)
    for done, (distance, bearing, height, look) in enumerate(_PEOPLE):
        share = (triangles - builder.count) / (len(_PEOPLE) - done)
        sizes = Sizes(1.0)
        figure(look, sizes)
        parts = figure(look, Sizes(sizes.resolution_for(share)))
        angle = np.radians(bearing)
        spot = (distance * np.cos(angle), distance * np.sin(angle), 0.0)
        # a figure is 1.75 tall and faces -y
        matrix = placements([spot], angle - np.pi / 2, height / 1.75)
        for part, material in parts:
            builder.add(copies(part, matrix), material)
    return builder.mesh("characters")
