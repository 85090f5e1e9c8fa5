"""The figures that Yu et al. 2009 print for Figs. 5 to 7 and 9, and how they compare with ours."""

PAPER = "Yu, Yu, McMillan: Towards multi-perspective rasterization, The Visual Computer 2009"
CARD = "Frame rates are not to be compared: the paper's are of an NVidia 8800 GTX."
STAND_IN = "The scenes are procedural stand-ins: the paper's models are not public."
PATCHES = (5, 10, 20)
"""Samples along a side of a triangle in Fig. 5."""
SIZE = (800, 600)
"""Pixels of Figs. 6 and 7."""
FPS = {"cow": 47, "teapot": 32}
"""Frames per second of Figs. 6 and 7, of models of 5,800 and 14,000 triangles."""
TRIANGLES = {"cow": 5800, "teapot": 14000}
