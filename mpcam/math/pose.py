"""Rigid poses: 4x4 matrices that take world points to camera points (OpenCV axes: x right, y down, z forward)."""

import numpy as np

from mpcam.errors import InputError
from mpcam.math.arrays import Array, library


def look_at(eye: Array, target: Array, up: Array = (0.0, 0.0, 1.0)) -> np.ndarray:
    """`camera_from_world` of a camera at `eye` that looks at `target`, with `up` towards the top of the image.

    eye, target (3,): world, scene units; up (3,): world direction. Where `up` is parallel to the view, another world
    axis takes its place. Raises InputError when eye and target coincide or a number is not finite.
    """
    eye, target, up = (np.asarray(v, np.float64) for v in (eye, target, up))
    if not all(v.shape == (3,) and np.isfinite(v).all() for v in (eye, target, up)):
        raise InputError(f"look_at({eye}, {target}, up={up}): eye, target and up must be 3 finite numbers each")
    forward = target - eye
    length = np.linalg.norm(forward)
    if length == 0:
        raise InputError(f"look_at: eye and target are both {eye.tolist()}; give a target away from the eye")
    forward = forward / length
    for candidate in (up, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])):
        right = np.cross(forward, candidate)
        size = np.linalg.norm(right)
        if size > 1e-6 * np.linalg.norm(candidate):
            break
    right = right / size
    rotation = np.stack([right, np.cross(forward, right), forward])
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = -rotation @ eye
    return pose


def frame_origin(pose: Array) -> np.ndarray:
    """Origin of the camera frame, (3,) in the world."""
    matrix = np.asarray(pose)
    return -matrix[:3, :3].T @ matrix[:3, 3]


def as_pose(matrix: Array | None) -> Array:
    """A checked 4x4 rigid transform; None is the identity, and JAX or Dr.Jit matrices pass unchecked.

    Raises InputError unless the matrix is 4x4, finite, with a rotation (tolerance 1e-5) and last row 0 0 0 1.
    """
    if matrix is None:
        return np.eye(4)
    if library(matrix) != "numpy":
        return matrix
    try:
        pose = np.array(matrix, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"camera_from_world={matrix!r}: give a 4x4 matrix of numbers") from None
    if pose.shape != (4, 4):
        raise InputError(f"camera_from_world has shape {pose.shape}: give a 4x4 matrix, last row 0 0 0 1")
    if not np.isfinite(pose).all():
        raise InputError("camera_from_world holds NaN or infinity: give a 4x4 matrix of finite numbers")
    rotation = pose[:3, :3]
    skew = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if skew > 1e-5 or np.linalg.det(rotation) < 0 or np.abs(pose[3] - [0, 0, 0, 1]).max() > 1e-9:
        raise InputError(
            f"camera_from_world is not a rigid transform (rotation off by {skew:.2g}, determinant "
            f"{np.linalg.det(rotation):.2g}): scale the mesh instead, or see mpcam.look_at"
        )
    pose.flags.writeable = False
    return pose
