"""How far one rendering is from the truth: first hits, projection and images.

A `Hits` here is any object with the arrays of `mpcam.rasterize`: `.triangle` (H, W) int with -1 for none, `.depth`
(H, W) with inf for none, `.barycentric` (H, W, 2) weights of the second and third corner. Everything is float64 NumPy.

Image errors take linear RGB (H, W, 3) and compare in display space: clipped to [0, 1] and sRGB-encoded, so peak = 1.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mpcam.cameras.capabilities import ProjectsNear
from mpcam.errors import InputError
from mpcam.math.srgb import srgb_from_linear

# A hit on another triangle counts as wrong only where the surface is another one too: along shared edges, and where
# triangles coincide, two correct methods may name different triangles at the same depth.
SAME_DEPTH = 1e-4


@dataclass(frozen=True)
class HitErrors:
    """First hits against the true ones.

    hit_mismatch: share of all pixels where one hits and the other does not.
    triangle_mismatch: share of all pixels where both hit, on different triangles whose depths differ by more than
    1e-4 of the true depth.
    depth_median, depth_p999: |depth - truth| / truth over the pixels that both hit; NaN where there are none.
    """

    hit_mismatch: float
    triangle_mismatch: float
    depth_median: float
    depth_p999: float


@dataclass(frozen=True)
class ProjectionErrors:
    """Distances in pixels from each hit pixel's center to the exact image of the point that it shows.

    NaN without hits; a point that the camera does not see at all counts as infinitely far.
    """

    median: float
    p95: float
    max: float


def hit_errors(hits: Any, truth: Any) -> HitErrors:
    """Compare first hits with the true ones; raises `InputError` when the images differ in size."""
    triangle, true_triangle = np.asarray(hits.triangle), np.asarray(truth.triangle)
    _same_shape(triangle, true_triangle)
    if triangle.size == 0:
        return HitErrors(np.nan, np.nan, np.nan, np.nan)
    found, expected = triangle >= 0, true_triangle >= 0
    both = found & expected
    true_depth = np.asarray(truth.depth, np.float64)[both]
    difference = np.abs(np.asarray(hits.depth, np.float64)[both] - true_depth)
    relative = difference / np.maximum(np.abs(true_depth), np.finfo(np.float32).tiny)
    other = (triangle[both] != true_triangle[both]) & (relative > SAME_DEPTH)
    return HitErrors(
        hit_mismatch=float(np.mean(found != expected)),
        triangle_mismatch=float(np.count_nonzero(other) / triangle.size),
        depth_median=_quantile(relative, 0.5),
        depth_p999=_quantile(relative, 0.999),
    )


def projection_distances(camera: Any, mesh: Any, hits: Any) -> NDArray[np.float64]:
    """Pixel distances (H, W) from each center to the exact image of the point hit there; NaN where nothing is hit.

    The point is the one that the triangle and the barycentrics name on `mesh`, projected in float64 by the camera, at
    first into the part of the pixel alone where it has many; of several images the nearest counts, and with none the
    distance is infinite.
    """
    triangle = np.asarray(hits.triangle)
    distance = np.full(triangle.shape, np.nan)
    rows, columns = np.nonzero(triangle >= 0)
    if len(rows) == 0:
        return distance
    weights = np.asarray(hits.barycentric, np.float64)[rows, columns]
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)[triangle[rows, columns]]]
    first = corners[:, 0]
    points = first + weights[:, :1] * (corners[:, 1] - first) + weights[:, 1:] * (corners[:, 2] - first)
    center = np.stack([columns + 0.5, rows + 0.5], axis=-1)
    nearest = np.full(len(rows), np.inf)
    if isinstance(camera, ProjectsNear):
        nearest = _distances(camera.project_near(points, center), center)
    rest = ~np.isfinite(nearest)  # rounding puts the image of an edge into a neighboring part
    if rest.any():
        nearest[rest] = _distances(camera.project(points[rest]), center[rest])
    distance[rows, columns] = nearest
    return distance


def _distances(projection: Any, center: np.ndarray) -> NDArray[np.float64]:
    """Pixels (N,) from centers to the nearest image."""
    pixel, valid = np.asarray(projection.pixel, np.float64), np.asarray(projection.valid)
    return np.where(valid, np.linalg.norm(pixel - center[:, None, :], axis=-1), np.inf).min(axis=-1)


def projection_errors(camera: Any, mesh: Any, hits: Any) -> ProjectionErrors:
    """Median, 95th percentile and largest of `projection_distances` over the hit pixels."""
    distance = projection_distances(camera, mesh, hits)
    distance = distance[~np.isnan(distance)]
    return ProjectionErrors(_quantile(distance, 0.5), _quantile(distance, 0.95), _quantile(distance, 1.0))


def display(image: ArrayLike) -> NDArray[np.float64]:
    """Linear RGB as shown: clipped to [0, 1], sRGB-encoded, float64."""
    return srgb_from_linear(np.asarray(image, np.float64))


def image_rmse(image: ArrayLike, truth: ArrayLike) -> float:
    """Root of the mean squared difference of two linear images over pixels and channels, in sRGB space."""
    image, truth = np.asarray(image), np.asarray(truth)
    _same_shape(image, truth)
    return float(np.sqrt(np.mean(np.square(display(image) - display(truth)))))


def psnr(rmse: float) -> float:
    """Peak signal-to-noise ratio in dB of an `image_rmse` (peak 1); infinite for equal images."""
    return float("inf") if rmse == 0.0 else float(-20.0 * np.log10(rmse))


def flip_map(image: ArrayLike, truth: ArrayLike) -> NDArray[np.float64]:
    """LDR-FLIP error per pixel (H, W) in [0, 1] of two linear images, by OpenImageIO.

    Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020, at the 67 pixels per degree
    that the authors propose. OpenImageIO takes linear Rec. 709 and clips to [0, 1]; its default mode is the HDR one
    of 2021, whose exposures would make the number depend on the brightness range, hence `hdr=0`.
    """
    import OpenImageIO as oiio

    image, truth = np.asarray(image), np.asarray(truth)
    _same_shape(image, truth)
    buffers = []
    for pixels in (truth, image):
        buffer = oiio.ImageBuf(np.ascontiguousarray(pixels, np.float32))
        buffer.specmod().attribute("oiio:ColorSpace", "lin_rec709_scene")
        buffers.append(buffer)
    result = oiio.ImageBufAlgo.FLIP_diff(*buffers, hdr=0)
    if result.has_error:
        raise InputError(f"FLIP failed for images of shape {truth.shape}: {result.geterror()}; pass (H, W, 3) images.")
    return np.asarray(result.get_pixels(oiio.FLOAT), np.float64)[..., 0]


def _quantile(values: NDArray[np.float64], share: float) -> float:
    """A quantile that allows infinities; NaN for an empty array. The value at or above the share: no interpolation,
    which would make NaN of two infinities and invents values between an outlier and its neighbor."""
    return float(np.quantile(values, share, method="higher")) if values.size else float("nan")


def _same_shape(first: NDArray[Any], second: NDArray[Any]) -> None:
    if first.shape != second.shape:
        raise InputError(f"Images of shapes {first.shape} and {second.shape} cannot be compared; render both alike.")
