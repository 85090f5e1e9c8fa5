"""The figures that Hou et al. 2006 print in Table 1 and Fig. 7, and how they compare with ours."""

from typing import NamedTuple

PAPER = "Hou, Wei, Shum, Guo: Real-time Multi-perspective Rendering on Graphics Hardware, EGSR 2006"
CARD = (
    "Ratios compare with the paper's, frame rates do not: the paper's are of an Nvidia Geforce 7800 GT, and of the "
    "whole picture."
)
STAND_IN = "The scenes are stand-ins, made by formula with the paper's numbers of triangles."


class Scene(NamedTuple):
    """A row of Table 1: scene and camera triangles, pixels tested and rendered, atlas resolution, frames per second."""

    scene_triangles: int
    camera_triangles: int
    tests: int
    rendered: int
    resolution: int
    fps: float

    @property
    def overdraw(self) -> float:
        return self.tests / self.rendered


TABLE_1 = {
    ("reflection", 26): Scene(108, 26, 2002513, 62860, 128, 51),
    ("reflection", 104): Scene(108, 104, 920156, 62734, 64, 63),
    ("reflection", 416): Scene(108, 416, 783566, 62823, 32, 5),
    ("refraction", 12): Scene(252, 12, 2475722, 106349, 128, 46),
    ("caustics", 400): Scene(2, 400, 945962, 475852, 64, 35),
    ("visualization", 400): Scene(6841, 400, 213248, 213248, 64, 46),
}
"""By scene and camera triangles. The 5 frames per second are as printed; beside 51 and 63 they may miss a digit."""

FIG_7 = {
    (800, 100): (4.5, 20.1),
    (1200, 100): (3.6, 14.6),
    (1600, 100): (2.1, 9.2),
    (400, 256): (1.5, 6.0),
    (800, 256): (0.5, 2.1),
    (1200, 256): (0.35, 1.8),
    (400, 512): (0.8, 2.5),
    (800, 512): (0.3, 1.0),
}
"""Frames per second without and with acceleration, by scene and camera triangles."""
