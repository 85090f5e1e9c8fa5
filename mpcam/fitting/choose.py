"""Which decomposition to take: fitted or not, of how many camera triangles, with how many pixels each."""

import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import is_number, shown, whole_number
from mpcam.decomposition.decompose import MOST, decompose
from mpcam.decomposition.fewest import fewest
from mpcam.decomposition.ray_error import bent, error_beside, in_world
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.views import seen_samples
from mpcam.errors import InputError
from mpcam.fitting.fit import fit
from mpcam.fitting.general_linear import GeneralLinearFit, fit_general_linear
from mpcam.fitting.result import Fit
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface

LADDER = (26, 52, 104, 208, 416, 832, 1664)
"""Numbers of camera triangles that are tried for a budget of time."""
LARGEST_FIT = 4_000
"""Camera triangles up to which fits are tried."""
LARGEST_SIDE = 512
SLIVER = 1.5
"""Times the side of a triangle of equal area with two equal sides, beyond which more pixels would be wasted."""
_GAIN = 4.0
_SAMPLES = 20_000

FrameTime = Callable[[list[CameraTriangles]], list[float]]
"""Seconds that a frame takes with each of several decompositions, measured side by side."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A decomposition that was looked at.

    kind: "decomposed", "fitted" or "curved" (fitted, of degree 2). angle: root mean square of the angles of its rays to
    the true ones, radians, on pixels that were not fitted. seconds: to make it. frame: seconds that a frame takes, None
    where nobody measured. fit: what was fitted, or None.
    """

    kind: str
    camera: CameraTriangles
    angle: float
    seconds: float
    frame: float | None = None
    fit: Fit | None = None

    @property
    def rays(self) -> int:
        """Pixels of its atlas that have a ray."""
        sides = np.broadcast_to(np.asarray(self.camera.resolution, np.int64), self.camera.count)
        return int((sides * (sides + 1) // 2).sum())

    def __repr__(self) -> str:
        return f"Candidate({self.kind}, {self.camera.count} camera triangles, {1e3 * self.angle:.3g} mrad)"


@dataclass(frozen=True, eq=False)
class Chosen:
    """What to take, and what was left out.

    best: the candidate chosen. others: those left out, best first. single: the one general linear camera that is
    nearest to all rays, None where they go too many ways for one. single_angle: how far its rays are off two radii
    away, over that distance; where it is small enough, no decomposition is needed at all.
    """

    best: Candidate
    others: tuple[Candidate, ...]
    single: GeneralLinearFit | None
    single_angle: float

    @property
    def camera(self) -> CameraTriangles:
        """The camera triangles chosen."""
        return self.best.camera


def choose_decomposition(
    reflector: Mesh | Surface,
    eye: Any,
    *,
    triangles: int | None = None,
    max_angle: float | None = None,
    frame_time: float | None = None,
    time_of: FrameTime | None = None,
    index: float | None = None,
    resolution: int | None = None,
    progress: Callable[[str], Any] | None = None,
    **settings: Any,
) -> Chosen:
    """The decomposition that does what is asked for at the least cost, among decomposed and fitted ones.

    Give one of three. triangles: the smallest error with so many at most. max_angle: the fewest whose rays are off by
    at most so many radians, root mean square. frame_time: the smallest error with which a frame takes at most so many
    seconds, as `time_of` measures it. eye: a point or a camera. resolution: pixels along the short sides of each; by
    default as many as the camera has there, each triangle its own, and 64 for a point. progress: told what comes next.
    index: see `decompose`. settings: of `fit` (iterations, samples, seed, rim, fixed). Raises InputError for none or
    several of the three, what cannot be reached, and other values.
    """
    given = {"triangles": triangles, "max_angle": max_angle, "frame_time": frame_time}
    asked = [name for name, value in given.items() if value is not None]
    if len(asked) != 1:
        raise InputError(f"give one of triangles, max_angle and frame_time, not {' and '.join(asked) or 'none'}")
    for name in ("max_angle", "frame_time"):
        value = given[name]
        if value is not None and (not is_number(value) or value <= 0):
            raise InputError(f"{name}={shown(value)}: give a finite number above 0")
    if frame_time is not None and time_of is None:
        raise InputError("frame_time= needs time_of=, which measures what a frame takes")
    search = _Search(reflector, eye, index, resolution, settings, progress or (lambda text: None))
    if triangles is not None:
        many = whole_number("triangles", triangles, 1, MOST)
        found = [search.decomposed(many), search.fitted(many), search.curved(many)]
    elif max_angle is not None:
        found = search.within(max_angle)
    else:
        found = [search.decomposed(many) for many in LADDER]
    found = [one for one in found if one is not None]
    if time_of is not None:
        times = time_of([one.camera for one in found])
        found = [dataclasses.replace(one, frame=seconds) for one, seconds in zip(found, times, strict=True)]
    if frame_time is not None and time_of is not None:
        found = search.in_time(found, frame_time, time_of)
    order = sorted(found, key=lambda one: _rank(one, max_angle, frame_time))
    single, single_angle = search.single()
    return Chosen(order[0], tuple(order[1:]), single, single_angle)


def _rank(one: Candidate, max_angle: float | None, frame_time: float | None) -> tuple[float, ...]:
    """Smaller is better: what keeps within the limit first, then few triangles or small errors."""
    if max_angle is not None:
        return float(one.angle > max_angle), float(one.camera.count), one.angle
    late = frame_time is not None and one.frame is not None and one.frame > frame_time
    return float(late), one.angle, float(one.camera.count)


class _Search:
    """Makes candidates, each of them once."""

    def __init__(
        self,
        reflector: Mesh | Surface,
        eye: Any,
        index: float | None,
        resolution: int | None,
        settings: dict[str, Any],
        tell: Callable[[str], Any],
    ):
        self.reflector, self.eye, self.index, self.resolution = reflector, eye, index, resolution
        self.settings, self.tell = settings, tell
        self.made: dict[tuple[str, int], Candidate] = {}
        self.whole = reflector_of(reflector)
        self.view = seen_samples(self.whole, eye, _SAMPLES)

    def decomposed(self, many: int) -> Candidate:
        def make() -> tuple[CameraTriangles, None, float]:
            cams = self._cut(many, 1)
            return cams, None, self._angle(cams)

        return self._once("decomposed", many, make)

    def fitted(self, many: int) -> Candidate:
        return self._once("fitted", many, lambda: self._fit(self.decomposed(many).camera))

    def curved(self, many: int) -> Candidate:
        return self._once("curved", many, lambda: self._fit(self._cut(many, 2)))

    def _cut(self, many: int, degree: int) -> CameraTriangles:
        settings: dict[str, Any] = {"index": self.index, "resolution": self.resolution or 64, "degree": degree}
        return decompose(self.reflector, self.eye, many, **settings)

    def _fit(self, start: CameraTriangles) -> tuple[CameraTriangles, Fit, float]:
        found = fit(start, reflector=self.reflector, eye=self.eye, **self.settings)
        return found.camera, found, 1e-3 * found.error.angle_rms

    def within(self, max_angle: float) -> list[Candidate]:
        """The fewest within an angle, decomposed, fitted and curved. Raises InputError where no number is enough."""
        what = f"max_angle={max_angle:g}"

        def angle(one: Candidate) -> float:
            return one.angle

        tried: list[Candidate] = []
        problem: InputError | None = None
        for make, largest in ((self.decomposed, MOST), (self.fitted, LARGEST_FIT), (self.curved, LARGEST_FIT)):
            start = 104 if not tried else max(round(tried[-1].camera.count / _GAIN), 4)
            try:
                tried.append(fewest(make, angle, max_angle, start, largest, what, below=largest == MOST))
            except InputError as error:
                problem = error
        if not tried and problem is not None:
            raise problem
        return tried

    def in_time(self, found: list[Candidate], most: float, time_of: FrameTime) -> list[Candidate]:
        """With the largest decomposition in time fitted, too."""
        early = [one for one in found if one.frame is not None and one.frame <= most]
        if not early:
            fastest = min(one.frame for one in found if one.frame is not None)
            raise InputError(
                f"frame_time={most:g}: the fastest of these takes {fastest:.3g} s: allow more, or a smaller picture"
            )
        many = max(number for (kind, number), one in self.made.items() if any(one.camera is e.camera for e in early))
        more = [self.fitted(many), self.curved(many)]
        times = time_of([one.camera for one in more])
        return [*found, *(dataclasses.replace(one, frame=seconds) for one, seconds in zip(more, times, strict=True))]

    def single(self) -> tuple[GeneralLinearFit | None, float]:
        """The general linear camera nearest to the true rays, and how far its rays are off them, radians."""
        self.tell("one general linear camera for all")
        view = self.view
        true, passes = bent(view.points - view.eye, view.normals, self.index)
        far = 2.0 * (self.whole.radius or 1.0)
        found = fit_general_linear(view.points[passes], true[passes], depth=far)
        if found.status == "rank_deficient" or not found.used.all():
            return None, math.inf
        return found, found.residual / far

    def _once(self, kind: str, many: int, make: Callable[[], tuple[CameraTriangles, Fit | None, float]]) -> Candidate:
        if (kind, many) not in self.made:
            self.tell(f"{many:,} camera triangles, {kind}")
            start = time.perf_counter()
            cams, found, angle = make()
            seconds = time.perf_counter() - start
            if self.resolution is None and isinstance(self.eye, Camera):
                cams = dataclasses.replace(cams, resolution=sides_seen(cams, self.eye))
                found = None if found is None else dataclasses.replace(found, camera=cams)
            self.made[kind, many] = Candidate(kind, cams, angle, seconds, fit=found)
        return self.made[kind, many]

    def _angle(self, cams: CameraTriangles) -> float:
        return 1e-3 * error_beside(in_world(cams), self.whole, self.view, 2.0 * self.whole.radius).angle_rms


def sides_seen(cams: CameraTriangles, camera: Camera) -> np.ndarray:
    """(F,) pixels along the short sides of camera triangles, 2 to LARGEST_SIDE, as many as a camera has there: what is
    far away or seen at a grazing angle needs few. Slivers, which would waste most of them, have fewer along.
    """
    world = in_world(cams)
    found = camera.project(world.vertices[world.faces[:, :3]].reshape(-1, 3))
    pixel = np.asarray(found.pixel)[:, 0].reshape(-1, 3, 2)
    known = np.asarray(found.valid)[:, 0].reshape(-1, 3).all(axis=1)
    legs = [np.linalg.norm(pixel[:, j] - pixel[:, i], axis=-1) for i, j in ((0, 1), (0, 2), (1, 2))]
    side = np.maximum(np.maximum(legs[0], legs[1]), legs[2] / math.sqrt(2.0))
    (ax, ay), (bx, by) = ((pixel[:, k] - pixel[:, 0]).T for k in (1, 2))
    side = np.minimum(side, SLIVER * np.sqrt(np.abs(ax * by - ay * bx)) + 1)
    side = np.where(known, np.nan_to_num(side, posinf=LARGEST_SIDE), LARGEST_SIDE)
    return np.clip(np.ceil(side) + 1, 2, LARGEST_SIDE).astype(np.int64)
