"""The lenses, answers and judgements of opencv_inverse.py, which see.

The truth is the inverse of the published formula at 50 digits, by bracketing. An answer's error in pixels is the
distance of its image, by that formula, from the pixel it was asked for; rays beyond the lens's largest angle count as
imaged on its rim.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import cv2
import mpmath
import numpy as np
from mpmath import mpf

import mpcam

Lens = mpcam.KannalaBrandt | mpcam.UnifiedOmni | mpcam.DoubleSphere

DIGITS = 50
TOLERANCE = 0.01
"""Pixels; beyond it an answer is wrong. the corners of calibration targets are found to a few times that."""

LENSES: dict[str, Lens] = {
    # Of an action camera; monotone, and its image ends before 90 degrees.
    "narrow": mpcam.KannalaBrandt(640, 480, 293.1, 293.4, 319.2, 241.1, (0.0443, 0.0094, -0.0056, 0.0017)),
    # The first camera of the TUM-VI data set, in two models.
    "TUM-VI": mpcam.KannalaBrandt(
        512,
        512,
        190.978477,
        190.973307,
        254.931706,
        256.897443,
        (0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182),
    ),
    # OpenCV's issue 26174.
    "wide": mpcam.KannalaBrandt(640, 480, 150, 150, 320, 240, (0.05, -0.01, 0, 0)),
    "strongly stretched": mpcam.KannalaBrandt(640, 640, 60, 60, 320, 320, (0.5, 0.2, 0, 0.01)),
    "negative k": mpcam.KannalaBrandt(640, 480, 190, 190, 320, 240, (-0.1, 0, 0, 0)),
    # r hardly grows around 60 degrees.
    "nearly flat": mpcam.KannalaBrandt(640, 480, 250, 250, 320, 240, (-0.37, -0.08, 0.07, 0.0044)),
    "folds in the image": mpcam.KannalaBrandt(640, 480, 190, 190, 320, 240, (0.35, -0.07, -0.043, 0.0005)),
    "Mei, xi = 1.4": mpcam.UnifiedOmni.mei(640, 480, 220, 220, 320, 240, 1.4),
    "TUM-VI, double sphere": mpcam.DoubleSphere(
        512, 512, 158.286, 158.274346, 254.961166, 256.889439, -0.172131, 0.593118
    ),
}

KINDS = {
    "right": "right",
    "mirrored": "on the right line through the eye, at its other end: beyond 90 degrees (x, y, 1) points forward",
    "folded": "beyond the angle where the lens folds; its polynomial still gives the pixel back",
    "wrong": "wrong in another way",
    "missed": "no answer for a pixel that has a ray",
    "invented": "an answer for a pixel that has no ray",
    "refused": "no answer for a pixel that has no ray",
}
UNFLAGGED = ("mirrored", "folded", "wrong")


@dataclass(frozen=True)
class Answer:
    """One answer: its kind, and its errors in pixels and milliradians, NaN where there is none to measure."""

    kind: str
    px: float = np.nan
    mrad: float = np.nan


@dataclass(frozen=True)
class Sample:
    """A pixel of a lens and the answers for it.

    angle: degrees of its true ray from the axis, NaN if it has none. azimuth: degrees from u towards v. radius: from
    the center, in focal lengths. opencv: None where OpenCV does not have the model.
    """

    lens: str
    angle: float
    azimuth: float
    radius: float
    u: float
    v: float
    opencv: Answer | None
    ours: Answer


@dataclass(frozen=True)
class Summary:
    """What a lens came to. Angles and fields of view in degrees, errors in pixels and milliradians.

    field_of_view: twice the largest angle sampled. with_ray, without_ray: pixels sampled. opencv_first: the smallest
    angle with a wrong answer that is not flagged, to 0.01. opencv_unflagged: wrong answers for pixels with a ray.
    opencv_image_percent: pixels of the whole image with a wrong answer that is not flagged. None: nothing to tell.
    """

    lens: str
    field_of_view: float
    with_ray: int
    without_ray: int
    opencv_worst_px: float | None
    opencv_worst_mrad: float | None
    opencv_first: float | None
    opencv_unflagged: int | None
    opencv_missed: int | None
    opencv_invented: int | None
    opencv_image_percent: float | None
    ours_worst_px: float
    ours_worst_mrad: float
    ours_unflagged: int
    ours_missed: int
    ours_invented: int


# The truth


def published_radius(lens: Lens, theta: Any) -> Any:
    """r in focal lengths of an angle in radians from the axis, by the formula of the lens's paper, in mpmath."""
    if isinstance(lens, mpcam.KannalaBrandt):
        return theta * (1 + sum(mpf(k) * theta ** (2 * power) for power, k in enumerate(lens.k, 1)))
    side, ahead, alpha = mpmath.sin(theta), mpmath.cos(theta), mpf(lens.alpha)
    if isinstance(lens, mpcam.DoubleSphere):
        ahead = ahead + mpf(lens.xi)
        return side / (alpha * mpmath.hypot(side, ahead) + (1 - alpha) * ahead)
    return side / (alpha * mpmath.sqrt(mpf(lens.beta) * side**2 + ahead**2) + (1 - alpha) * ahead)


def plane_point(lens: Lens, pixel: np.ndarray) -> tuple[Any, Any, Any]:
    """A pixel (2,) relative to the center in focal lengths, and its distance from there, in mpmath."""
    x, y = (mpf(float(pixel[0])) - lens.cx) / lens.fx, (mpf(float(pixel[1])) - lens.cy) / lens.fy
    return x, y, mpmath.hypot(x, y)


def pixel_error(lens: Lens, pixel: np.ndarray, direction: list[Any]) -> float:
    """Pixels from a pixel (2,) to the image of a direction; beyond the lens's largest angle, to the rim."""
    across = mpmath.hypot(direction[0], direction[1])
    theta = mpmath.atan2(across, direction[2])
    r = published_radius(lens, min(theta, mpf(lens.limit))) / across if across else mpf(0)
    x, y, _ = plane_point(lens, pixel)
    return float(mpmath.hypot(lens.fx * (r * direction[0] - x), lens.fy * (r * direction[1] - y)))


def angle_between(a: list[Any], b: list[Any]) -> float:
    """Milliradians."""
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    sine, cosine = mpmath.norm(cross), mpmath.fdot(a, b)
    return float(1000 * mpmath.atan2(sine, cosine))


# The answers


def opencv_rays(lens: Lens, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Directions (N, 3) that OpenCV gives pixels (N, 2), and whether it gives one (N,). None: it has no such model.

    Its pixels lie half a pixel to the upper left of ours, and so does its center: the two cancel.
    """
    matrix: Any = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1]])
    if isinstance(lens, mpcam.KannalaBrandt):
        found = cv2.fisheye.undistortPoints(pixels[:, None], matrix, np.array(lens.k, float))
    elif isinstance(lens, mpcam.UnifiedOmni) and lens.beta == 1 and hasattr(cv2, "omnidir"):  # not in every build
        matrix[:2, :2] *= 1 + lens.xi
        found = cv2.omnidir.undistortPoints(pixels[:, None], matrix, np.zeros(4), np.array([lens.xi]), np.eye(3))
    else:
        return None
    plane = found[:, 0]
    # The fisheye's mark for a failure is (-1000000, -1000000); omnidir's is NaN.
    answered = np.isfinite(plane).all(1) & (plane != -1e6).any(1)
    return np.concatenate([plane, np.ones_like(plane[:, :1])], 1), answered


def judge(lens: Lens, pixel: np.ndarray, truth: list[Any] | None, given: np.ndarray, answered: bool) -> Answer:
    """Kind and errors of a direction (3,) given for a pixel (2,). truth: its ray, None if it has none."""
    if truth is None:
        return Answer("invented" if answered else "refused")
    if not answered:
        return Answer("missed")
    direction = [mpf(float(number)) for number in given]
    error = Answer("right", pixel_error(lens, pixel, direction), angle_between(direction, truth))
    if error.px <= TOLERANCE:
        return error
    theta = mpmath.atan2(mpmath.hypot(*direction[:2]), direction[2])
    focal, r = max(lens.fx, lens.fy), plane_point(lens, pixel)[2]
    if pixel_error(lens, pixel, [-number for number in direction]) <= TOLERANCE:
        kind = "mirrored"
    elif theta > lens.limit and focal * abs(published_radius(lens, theta) - r) <= TOLERANCE:
        kind = "folded"
    else:
        kind = "wrong"
    return Answer(kind, error.px, error.mrad)


# The pixels


def farthest_corner(lens: Lens) -> np.ndarray:
    """Corner (2,) of the image that is farthest from the center, relative to it, in focal lengths."""
    u, v = np.meshgrid([0.0, lens.width], [0.0, lens.height])
    corners = np.stack([(u.ravel() - lens.cx) / lens.fx, (v.ravel() - lens.cy) / lens.fy], -1)
    return corners[np.argmax(np.hypot(*corners.T))]


def folds(lens: Lens) -> bool:
    """Whether the formula itself ends the domain, so that pixels beyond it have no ray."""
    return lens.limit < min(lens.max_angle, np.pi - 1e-5)


def sample(name: str, lens: Lens, step: float) -> list[Sample]:
    """All pixels of one lens in order of their angle, or of their radius beyond the rim. step: degrees."""
    far = farthest_corner(lens)
    reach, rim = float(np.hypot(*far)), float(lens.radius_at(lens.limit))
    angles = np.arange(step / 2, np.degrees(lens.limit), step)  # not 90, where the answer (x, y, 1) is infinite
    if folds(lens):
        angles = np.append(angles, np.degrees(lens.limit) - [0.2, 0.05, 0.01])  # where r hardly grows
    radii = [float(published_radius(lens, mpmath.radians(float(angle)))) for angle in np.sort(angles)]
    if folds(lens):
        radii += [*rim * (1 + np.array([1e-6, 1e-3])), *np.arange(rim * 1.02, max(reach, rim), 0.02 * rim)]
    azimuths = np.radians([0, 90, 200, np.degrees(np.arctan2(far[1], far[0]))])
    r, azimuth = (grid.ravel() for grid in np.meshgrid(radii, azimuths, indexing="ij"))
    pixels = np.stack([lens.cx + lens.fx * r * np.cos(azimuth), lens.cy + lens.fy * r * np.sin(azimuth)], -1)
    seen = ((pixels >= 0) & (pixels <= [lens.width, lens.height])).all(1)
    pixels, azimuth = pixels[seen], azimuth[seen]
    theirs, ours = opencv_rays(lens, pixels), lens.ray(pixels)
    samples = []
    for i, pixel in enumerate(pixels):
        truth = true_ray(lens, pixel)
        x, y, r = plane_point(lens, pixel)
        opencv = None if theirs is None else judge(lens, pixel, truth, theirs[0][i], bool(theirs[1][i]))
        mine = judge(lens, pixel, truth, ours.direction[i], bool(ours.valid[i]))
        angle = np.nan if truth is None else float(mpmath.degrees(mpmath.acos(truth[2])))
        place = (float(np.degrees(azimuth[i])), float(r), float(pixel[0]), float(pixel[1]))
        samples.append(Sample(name, angle, *place, opencv, mine))
    return samples


def true_ray(lens: Lens, pixel: np.ndarray) -> list[Any] | None:
    """The unit direction whose angle is the smallest with the pixel's radius; None if there is none."""
    x, y, r = plane_point(lens, pixel)
    low, high = mpf(0), mpf(lens.limit)
    if r >= published_radius(lens, high):
        return None
    # r grows on the whole interval, so there is one root; the solver brackets it, and raises if it falls short.
    theta = mpmath.findroot(lambda angle: published_radius(lens, angle) - r, (low, high), solver="anderson")
    return [mpmath.sin(theta) * x / r, mpmath.sin(theta) * y / r, mpmath.cos(theta)]


def wrong_unflagged(lens: Lens, pixels: np.ndarray) -> np.ndarray | None:
    """Whether OpenCV gives pixels (N, 2) a wrong answer, (N,); None: it has no such model.

    In float64, with our own inverse in place of the truth.
    """
    theirs, ours = opencv_rays(lens, pixels), lens.ray(pixels)
    if theirs is None:
        return None
    direction, answered = theirs
    direction = np.where(answered[:, None], direction, [0.0, 0.0, 1.0])
    image, _ = lens.local_image(direction.T)  # on the rim, where the direction is beyond it
    right = np.hypot(*(image - pixels.T)) <= TOLERANCE
    return answered & ~(right & ours.valid)


def image_percent(lens: Lens, stride: int = 4) -> float | None:
    """Percent of the image's pixels with a wrong answer that is not flagged, on a grid of every `stride`th pixel."""
    axes = (np.arange(stride / 2, size, stride) for size in (lens.width, lens.height))
    wrong = wrong_unflagged(lens, np.stack([grid.ravel() for grid in np.meshgrid(*axes)], -1))
    return None if wrong is None else float(100 * wrong.mean())


def first_wrong(lens: Lens) -> float | None:
    """The smallest angle with a wrong answer that is not flagged, to 0.01 degrees; None if there is none to tell."""
    far = farthest_corner(lens)
    r = np.linspace(0, 1, 50001)[1:, None] * far
    r = r[np.hypot(*r.T) < lens.radius_at(lens.limit)]
    pixels = np.array([lens.cx, lens.cy]) + r * [lens.fx, lens.fy]
    wrong = wrong_unflagged(lens, pixels)
    if wrong is None or not wrong.any():
        return None
    return float(np.degrees(lens.angle_at(np.hypot(*r[np.argmax(wrong)]))))


def summarize(name: str, samples: list[Sample]) -> Summary:
    """One row of the table."""
    theirs = [sample.opencv for sample in samples if sample.opencv is not None]
    ours = [sample.ours for sample in samples]
    known, with_ray = bool(theirs), [sample.angle for sample in samples if math.isfinite(sample.angle)]
    return Summary(
        lens=name,
        field_of_view=2 * max(with_ray),
        with_ray=len(with_ray),
        without_ray=len(samples) - len(with_ray),
        opencv_worst_px=_worst(answer.px for answer in theirs) if known else None,
        opencv_worst_mrad=_worst(answer.mrad for answer in theirs) if known else None,
        opencv_first=first_wrong(LENSES[name]),
        opencv_unflagged=_count(theirs, *UNFLAGGED) if known else None,
        opencv_missed=_count(theirs, "missed") if known else None,
        opencv_invented=_count(theirs, "invented") if known else None,
        opencv_image_percent=image_percent(LENSES[name]),
        ours_worst_px=_worst(answer.px for answer in ours),
        ours_worst_mrad=_worst(answer.mrad for answer in ours),
        ours_unflagged=_count(ours, *UNFLAGGED),
        ours_missed=_count(ours, "missed"),
        ours_invented=_count(ours, "invented"),
    )


def _worst(errors: Iterable[float]) -> float:
    return max((error for error in errors if math.isfinite(error)), default=math.nan)


def _count(answers: Iterable[Answer], *kinds: str) -> int:
    return sum(answer.kind in kinds for answer in answers)


def run(step: float = 0.25, names: Iterable[str] = tuple(LENSES)) -> tuple[list[Sample], list[Summary]]:
    """All samples and the table of the named lenses. step: degrees between the angles."""
    samples, summaries = [], []
    with mpmath.workdps(DIGITS):
        for name in names:
            found = sample(name, LENSES[name], step)
            samples += found
            summaries.append(summarize(name, found))
    return samples, summaries
