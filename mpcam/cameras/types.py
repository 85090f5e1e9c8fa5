"""What cameras give back: rays, projections and pixel boxes, with fixed shapes and a mask instead of NaN."""

from typing import Literal, NamedTuple

import numpy as np

from mpcam.math import Array

RayGeometry = Literal["central", "parallel", "general"]


class Ray(NamedTuple):
    """Rays of pixels.

    origin (..., 3): scene units. direction (..., 3): unit length. valid (...): False where the pixel has no ray;
    origin and direction are finite there, and mean nothing.
    """

    origin: Array
    direction: Array
    valid: Array


class RayPieces(NamedTuple):
    """The straight pieces of bent rays, in the order in which they are run through; k is the most that a ray can have.

    origin (..., k, 3): where each piece starts. direction (..., k, 3): unit length. start, end (..., k): lengths along
    the bent ray, scene units, so that the point at length s of a piece is origin + (s - start) direction; end is
    infinite where a ray goes on for ever. valid (..., k): False where there is no such piece; the rest is finite there,
    and means nothing. A piece starts where the one before it ends.
    """

    origin: Array
    direction: Array
    start: Array
    end: Array
    valid: Array


class PosedRays(NamedTuple):
    """Rays of pixels in a frame that is not the world's: what hits were found with.

    pose: 4x4, frame from world. ray: on the device, one per pixel, row by row.
    """

    pose: np.ndarray
    ray: Ray


class Projection(NamedTuple):
    """Images of points; k is the number of images that a point can have at most.

    pixel (..., k, 2): u right, v down, center of the top left pixel at (0.5, 0.5). depth (..., k): distance along the
    pixel's ray, scene units. valid (..., k): False where there is no such image. Valid pixels may lie outside of
    [0, width] x [0, height]: `Camera.contains` tells.
    """

    pixel: Array
    depth: Array
    valid: Array


class Box(NamedTuple):
    """Axis-aligned region of the image that holds the whole image of a triangle.

    low, high (..., 2): pixels, not clipped to the image. valid (...): False where the triangle has no image at all.
    """

    low: Array
    high: Array
    valid: Array


class Domain(NamedTuple):
    """Where a camera is defined.

    max_angle: largest angle between the optical axis and a ray, radians; None where rays have no common center.
    image_radius: radius in pixels of the image circle around the camera's (cx, cy), or the larger one of an ellipse;
    None where the image goes on to infinity. slit_depths: z in the camera frame at which images run to infinity, the
    planes of slits and centers, of cameras whose image is not a disc.
    """

    max_angle: float | None
    image_radius: float | None
    slit_depths: tuple[float, ...] = ()
