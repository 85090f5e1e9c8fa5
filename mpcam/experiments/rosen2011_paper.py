"""Figures of Rosen et al. 2011, section 7: what the paper measured on a graphics card of 2006."""

PAPER = "Rosen, Popescu, Hayward, Wyman: Non-Pinhole Approximations for Interactive Rendering, IEEE TVCG 17 (10), 2011"
CARD = (
    "Ratios compare with the paper's, milliseconds do not: ours are times of this machine's processor, the paper's of "
    "an Nvidia 8800 Ultra with eight samples a pixel."
)

POLE_STEPS = {(1.0, True): 22.0, (0.5, True): 31.0, (0.25, True): 48.0}
"""Fig. 17: mean steps of a pixel over a single-pole image by fine step, and whether coarse steps are taken."""
GRAPH_STEPS = {(1.0, False): 155.0, (1.0, True): 27.0}
"""Fig. 19: the same over a graph camera's image. The paper does not tell the fine step: it stands in the first row."""
FRAME_RATES = {
    (640, 480): {1.0: 26.5, 0.5: 20.7, 0.25: 15.0},
    (800, 600): {1.0: 20.9, 0.5: 16.5, 0.25: 11.6},
    (1024, 768): {1.0: 15.2, 0.5: 11.8, 0.25: 8.0},
}
"""Table 1: frames a second by output resolution and fine step."""
IMAGE_RATES = {128: 55.8, 256: 36.6, 512: 26.5, 1024: 16.1}
"""Section 7.2: frames a second by the size of the depth image."""
COARSE_RATES = {3: 18.2, 6: 31.0, 9: 37.2, 12: 39.8}
"""Section 7.2: frames a second by coarse step."""
OCCLUSION_MS = {
    "regular": {"output": (5.9, 0.0, 5.9), "graph": (5.9, 16.0, 6.0)},
    "fine": {"output": (5.9, 0.0, 32.0), "graph": (5.9, 16.0, 40.0)},
}
"""Section 7.2: ms of the lit picture, of the graph camera's z-buffer and of occlusion, by setting and z-buffer."""
