"""The numbers of a comparison by column: headings, units, and what they mean."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """How a number of `Row` is shown: its field, a heading, the unit ("" for none), and what it means."""

    name: str
    title: str
    unit: str
    help: str


ERROR_COLUMNS = (
    Quantity("flip", "FLIP", "", "Mean LDR-FLIP error of the image, 0 to 1: what a viewer sees flipping between them."),
    Quantity("rmse", "Image RMSE", "", "Root mean squared difference of the images in sRGB space, peak 1."),
    Quantity("hit_mismatch", "Hits wrong", "%", "Share of the pixels that hit where the truth misses, or the reverse."),
    Quantity(
        "triangle_mismatch",
        "Triangles wrong",
        "%",
        "Share of the pixels that show another triangle, at a depth off by more than 1e-4 of the true one.",
    ),
    Quantity("depth_median", "Depth error, median", "", "Median of |depth - truth| / truth over the common hits."),
    Quantity("depth_p999", "Depth error, 99.9%", "", "99.9th percentile of |depth - truth| / truth."),
    Quantity(
        "projection_median",
        "Projection error, median",
        "px",
        "Median distance from a pixel's center to the exact image of the point shown there.",
    ),
    Quantity("projection_p95", "Projection error, 95%", "px", "95th percentile of the projection error."),
    Quantity("projection_max", "Projection error, largest", "px", "Largest projection error."),
    Quantity(
        "ray_angle", "Ray error", "mrad", "Root mean square angle between camera triangles' rays and the true ones."
    ),
)
PSNR_COLUMN = Quantity("psnr", "PSNR", "dB", "Peak signal-to-noise ratio in sRGB space, peak 1; infinite when equal.")
TIME_COLUMNS = (
    Quantity("still_ms", "Still frame", "ms", "Median time of a frame when nothing moves: all building is done."),
    Quantity("moving_ms", "Moving frame", "ms", "Median time to take new vertices, rebuild what needs it, and render."),
)
OTHER_COLUMNS = (
    Quantity("still_spread", "Still, spread", "ms", "Interquartile range of the still frames."),
    Quantity("moving_spread", "Moving, spread", "ms", "Interquartile range of the moving frames."),
    Quantity("shade_ms", "Shading", "ms", "Median time to shade first hits, barycentric weights worked out included."),
    Quantity("compile_ms", "First frame", "ms", "Preparing and the first frame together, kernels compiled or loaded."),
    Quantity("tests", "Tests", "", "Tests of a pixel against a triangle; 0 where a method makes none of its own."),
    Quantity("rendered", "Rendered", "", "Tests that hit, before the nearest hit of each pixel is chosen."),
    Quantity("overdraw", "Tests per hit", "", "Tests divided by tests that hit; 1 is ideal."),
)
COLUMNS = {c.name: c for c in (*ERROR_COLUMNS, PSNR_COLUMN, *TIME_COLUMNS, *OTHER_COLUMNS)}
