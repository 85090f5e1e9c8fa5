"""What a fit hands back."""

from dataclasses import dataclass
from typing import Any

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.ray_error import RayError
from mpcam.fitting.levenberg import Step

STATUSES = ("converged", "stalled", "rank_deficient", "budget", "interrupted")
ERRORS = ("error", "before", "fitted", "near", "far")
"""Fields of a Fit that are a RayError."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted camera triangles.

    camera: CameraTriangles in the frame of those that were given; they have rays everywhere that the start had. error:
    of its rays on pixels that were not fitted, in a plane 2 radii away (`mpcam.ray_error`). near, far: the same at half
    a radius, and at 20. before: `error` of the start. fitted: `error` on what was fitted; `overfit` is the ratio of the
    two. status: "converged", "stalled" (no step made it better), "rank_deficient" (fewer rays than unknowns), "budget"
    (iterations were up) or "interrupted". history: each iteration.
    """

    camera: CameraTriangles
    error: RayError
    status: str
    history: tuple[Step, ...]
    before: RayError
    fitted: RayError
    near: RayError
    far: RayError

    @property
    def gain(self) -> float:
        """Error of the start over that of the fit."""
        return self.before.rms / self.error.rms if self.error.rms > 0 else 1.0

    @property
    def overfit(self) -> float:
        """Error on what was not fitted over that on what was."""
        return self.error.rms / self.fitted.rms if self.fitted.rms > 0 else 1.0

    def __repr__(self) -> str:
        return (
            f"Fit({self.camera.count} camera triangles, {self.status}: {self.before.rms:.3g} -> {self.error.rms:.3g} "
            f"in {len(self.history)} iterations)"
        )


def as_start(given: Any) -> tuple[Any, tuple[Step, ...]]:
    """The camera and history to go on from: those of a Fit, or a camera with none."""
    return (given.camera, given.history) if isinstance(given, Fit) else (given, ())
