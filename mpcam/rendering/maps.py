"""Frames that hold less than hits: how far the first surface is, or only whether there is one."""

from functools import cached_property
from typing import Any

import numpy as np

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera

OUTPUTS = ("hits", "depth", "coverage")


class DepthMap:
    """Distances along each pixel's ray (unit direction) to the first surface.

    depth: (H, W) float32, scene units, infinite where nothing is hit. device_depth: the same, flat, on the device.
    """

    def __init__(self, camera: Camera, device_depth: Any):
        self.camera, self.device_depth = camera, device_depth

    @cached_property
    @exclusive
    def depth(self) -> np.ndarray:
        """(H, W) float32, infinite where nothing is hit."""
        return np.asarray(self.device_depth.numpy()).reshape(self.camera.height, self.camera.width)

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool, where something is hit."""
        return np.isfinite(self.depth)

    def __repr__(self) -> str:
        return f"DepthMap({self.camera.width}x{self.camera.height})"


class CoverageMap:
    """Which pixels see any surface.

    mask: (H, W) bool. fraction: share of the camera's valid pixels that see one. device_mask: the mask, flat, on the
    device.
    """

    def __init__(self, camera: Camera, device_mask: Any, valid: Any):
        self.camera, self.device_mask, self._valid = camera, device_mask, valid

    @cached_property
    @exclusive
    def mask(self) -> np.ndarray:
        """(H, W) bool, where something is hit."""
        return np.asarray(self.device_mask.numpy()).reshape(self.camera.height, self.camera.width)

    @cached_property
    @exclusive
    def fraction(self) -> float:
        """Share of the valid pixels that see a surface; 0 for a camera without valid pixels."""
        import drjit as dr

        valid: Any = dr.count(self._valid)
        covered: Any = dr.count(self.device_mask)
        return float(covered[0]) / max(int(valid[0]), 1)

    def __repr__(self) -> str:
        return f"CoverageMap({self.camera.width}x{self.camera.height})"
