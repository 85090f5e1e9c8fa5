"""The figures that Yu et al. 2009 print of their city (Fig. 1) and of mirrors (Figs. 8 and 10)."""

PAPER = "Yu, Yu, McMillan: Towards multi-perspective rasterization, The Visual Computer 25, 2009"
CARD = (
    "Ratios compare with the paper's, frame rates do not: the paper's are of a graphics card of 2009 or before, which "
    "it does not name."
)
STAND_IN = "The scenes are stand-ins, made by formula with the paper's numbers of triangles."

FIG_1_FPS = 70.0
"""Of the city with 15,000 triangles at 1024 x 320 pixels."""
FIG_8_FPS, FIG_8_PATCH, FIG_8_CAMERAS = 10.0, 6, 960
"""Of the mirror sphere in the butterfly scene with 1,100 triangles, each general linear camera of 256 x 256 pixels."""

FIG_10_CAMERAS = {
    (126, 128): 87.1,
    (126, 512): 43.1,
    (360, 128): 27.8,
    (360, 512): 16.7,
    (640, 128): 16.6,
    (640, 512): 10.4,
}
"""Frames per second by the number of cameras and the side of the image of each; 1,100 triangles, patch 6."""
FIG_10_SCENES = {
    (550, 6): 28.4,
    (550, 10): 14.4,
    (1100, 6): 22.4,
    (1100, 10): 10.8,
    (2200, 6): 9.5,
    (2200, 10): 6.9,
}
"""Frames per second by scene triangles and patch; 480 cameras of 256 x 256 pixels each."""
