"""Depth images at their limits: planes seen by every kind of camera, met by rays of all kinds, against closed forms.

The image of a plane is made from each pixel's ray in float64, piece by piece where rays are bent, and not by a
rasterizer; where a ray meets the plane follows from the plane alone. Errors are counted in fine steps of the image.
"""

from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends
from mpcam.cameras.registry import MODELS, snake_case
from mpcam.depth_images.depth_image import DepthImage
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import look_at
from mpcam.stress.report import Case, Progress, StressRow, check_counts, run_cases

LIMIT = 4.0
"""Fine steps, which are one pixel; nearly all errors are within one step."""
FINE = 0.25
SIZE = (160, 120)
POSE = look_at((0.3, -0.2, 0.1), (0.5, 1.0, 0.7))
_BORDER = 3.0  # pixels around the image's border, and the plane's end in it, that decide nothing
_GRAZING = 0.05  # cosine to the plane below which a ray need not be met where it should be
_EDGE_ON = 0.25  # cosine below which the camera's own rays do not show the plane
_CONTACT = 0.2  # distance from the plane, some pixels' width, below which a ray may be taken to start on it


def cameras() -> dict[str, Camera]:
    """The examples of all models in the register with one image of a point."""
    found = {}
    for name, model in MODELS.items():
        for example, camera in model.examples(*SIZE, POSE).items():
            if camera.images_per_point == 1 and hasattr(camera, "local_project"):
                found[f"{snake_case(name)}, {example}"] = camera
    return found


def centers(camera: Camera) -> np.ndarray:
    """(H, W, 2) pixels."""
    return np.stack(np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5), -1)


def plane_depth(camera: Camera, normal: np.ndarray, level: float) -> np.ndarray:
    """(H, W) length along each pixel's ray to the plane normal . x = level, infinite where it does not get there."""
    if isinstance(camera, Bends):
        pieces = camera.ray_pieces(centers(camera))
        origin, direction, start, end, valid = pieces
    else:
        origin, direction, valid = (
            part[..., None, :] if part.ndim == 3 else part[..., None] for part in camera.ray(centers(camera))
        )
        start, end = np.zeros(valid.shape), np.full(valid.shape, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        length = start + (level - origin @ normal) / (direction @ normal)
        met = valid & (length >= start) & (length <= end) & (length > 0)
        met &= np.abs(direction @ normal) > _EDGE_ON
    return np.where(met, length, np.inf).min(-1)


def rays(camera: Camera, depth: np.ndarray, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Toward points of the plane and past them, from before, behind and upon it; short and long directions."""
    rng = np.random.default_rng(seed)
    seen = np.argwhere(np.isfinite(depth))
    row, column = seen[rng.integers(len(seen), size=count)].T
    target = _points(camera, np.stack([column, row], -1) + rng.uniform(0, 1, (count, 2)), depth[row, column])
    size = np.median(depth[np.isfinite(depth)])
    start = target + size * rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-2, 2, (count, 1))
    kind = rng.integers(6, size=count)
    start = np.where(kind[:, None] == 0, camera.eye, start)
    start = np.where(kind[:, None] == 1, camera.eye - (target - camera.eye), start)  # from behind through the eye
    way = (target - start) * 10.0 ** rng.choice([-20.0, 0.0, 15.0], (count, 1))
    way = np.where(kind[:, None] == 2, -way, way)  # away from it
    way[kind == 3] = np.round(rng.normal(size=((kind == 3).sum(), 3)))  # along axes, along none
    return start, way


def _points(camera: Camera, pixel: np.ndarray, length: np.ndarray) -> np.ndarray:
    if not isinstance(camera, Bends):
        ray = camera.ray(pixel)
        return ray.origin + length[:, None] * ray.direction
    pieces = camera.ray_pieces(pixel)
    held = pieces.valid & (length[:, None] >= pieces.start)
    last = np.maximum(held.shape[1] - 1 - held[:, ::-1].argmax(1), 0)
    which = np.arange(len(pixel)), last
    return pieces.origin[which] + (length - pieces.start[which])[:, None] * pieces.direction[which]


def plane_rows(name: str, camera: Camera, count: int) -> list[StressRow]:
    """A plane across the view and an oblique one, met by rays of all kinds."""
    rows = []
    middle = camera.ray(np.array([[0.55 * camera.width, 0.6 * camera.height]]))
    for number, (case, tilt) in enumerate((("plane across", 0.15), ("plane aslant", 1.0))):
        axis, side = middle.direction[0], np.cross(middle.direction[0], (0.3, 0.5, 0.8))
        normal = axis + tilt * side / np.linalg.norm(side)
        normal /= np.linalg.norm(normal)
        level = float(normal @ (middle.origin[0] + 3.0 * axis))
        depth = plane_depth(camera, normal, level)
        if np.isfinite(depth).sum() < 50:
            continue
        image = DepthImage(camera, depth)
        start, way = rays(camera, depth, 200 * count, number)
        rows.append(_judged(f"{name}", case, camera, image, start, way, normal, level))
    return rows


def _judged(
    name: str,
    case: str,
    camera: Camera,
    image: DepthImage,
    start: np.ndarray,
    way: np.ndarray,
    normal: Any,
    level: float,
) -> StressRow:
    found = image.intersect(start, way, fine=FINE)
    largest = np.abs(way).max(-1, keepdims=True)
    unit = way / np.where(largest > 0, largest, 1.0)
    length = np.linalg.norm(unit, axis=-1, keepdims=True)
    unit = unit / np.where(length > 0, length, 1.0)
    cosine = unit @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (level - start @ normal) / cosine
    crosses, apart = np.isfinite(distance) & (distance > 0), np.abs(start @ normal - level) > _CONTACT
    point = start + np.where(crosses, distance, 0.0)[:, None] * unit
    projection = camera.project(point)
    pixel, seen = projection.pixel[:, 0], crosses & projection.valid[:, 0]
    sure, never = seen & apart & (np.abs(cosine) > _GRAZING), ~crosses & apart
    around = [pixel + _BORDER * np.array(step) for step in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))]
    held, any_ = np.ones(len(start), bool), np.zeros(len(start), bool)
    for place in around:
        column, row = np.clip(np.floor(place), -1, max(SIZE)).astype(int).T
        inside = (column >= 0) & (row >= 0) & (column < camera.width) & (row < camera.height)
        there = np.isfinite(image.depth[np.where(inside, row, 0), np.where(inside, column, 0)]) & inside
        held, any_ = held & there, any_ | there
    # Where the camera's ray meets the plane edge-on, or depth and image are of different pieces, nothing is decided.
    width = np.where(held, np.abs(projection.depth[:, 0] - _nearest(image.depth, pixel)), np.inf)
    held &= width < 0.25 * projection.depth[:, 0]
    sure &= held
    off = np.hypot(*(found.pixel - pixel).T) / FINE
    # Pixels with an empty neighbor have no slope of their own there, and at a rim they may be as wide as a view.
    padded = np.pad(np.isfinite(image.depth), 1)
    column, row = np.floor(found.pixel).astype(int).T
    shifts = [(i, j) for i in range(3) for j in range(3)]
    inner = np.all([padded[np.clip(row + j, 0, None), np.clip(column + i, 0, None)] for i, j in shifts], axis=0)
    never, seen, sure = never & inner, seen & inner, sure & (inner | ~found.hit)
    worst = float(np.quantile(off[sure & found.hit], 0.995)) if (sure & found.hit).any() else 0.0
    missed = max(int((sure & ~found.hit).sum()) - len(start) // 200, 0)
    invented = int((found.hit & never).sum() + (found.hit & seen & apart & ~any_ & (np.abs(cosine) > _GRAZING)).sum())
    return StressRow(name, case, "float32", len(start), worst, missed, invented)


def _nearest(depth: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    column, row = (np.clip(np.floor(x), 0, n - 1).astype(int) for x, n in zip(pixel.T, depth.shape[::-1], strict=True))
    return depth[row, column]


def own_rows(name: str, camera: Camera, count: int) -> list[StressRow]:
    """The camera's own rays, whose images are points: each finds its depth. And rays that mean nothing."""
    if isinstance(camera, Bends):
        return []
    ray = camera.ray(centers(camera))
    depth = np.where(ray.valid, 2.0 + 0.1 * np.sin(centers(camera)[..., 0]), np.inf)
    image = DepthImage(camera, depth)
    found, valid = image.intersect(ray.origin, ray.direction), ray.valid
    off = np.abs(found.distance - depth)[valid & found.hit]
    missed = max(int((valid & ~found.hit).sum()) - valid.size // 100, 0)
    early = int((found.hit & valid & (found.distance < depth - 0.01)).sum())
    rows = [StressRow(name, "own rays", "float32", valid.size, 100 * float(np.quantile(off, 0.99)), missed, early)]
    bad = np.array([np.nan, np.inf, -np.inf, 0.0])
    start = np.stack(np.meshgrid(bad, bad, bad), -1).reshape(-1, 3)
    wrong = [
        image.intersect(start[:-1], (0.0, 0.0, 1.0)),
        image.intersect((0.0, 0.0, 0.0), np.where(np.isfinite(start), 0.0, start)),
        DepthImage(camera, np.full(depth.shape, np.inf)).intersect(ray.origin, ray.direction),
    ]
    count = sum(one.hit.size for one in wrong)
    return [*rows, StressRow(name, "nothing", "float32", count, np.nan, 0, sum(int(one.hit.sum()) for one in wrong))]


def needle_rows(name: str, camera: Camera, count: int) -> list[StressRow]:
    """Triangles thinner than pixels: what is met lies in a pixel that sees one, at its depth."""
    rng = np.random.default_rng(5)
    pixel = rng.uniform(0.1, 0.9, (40, 2)) * SIZE
    ray = camera.ray(pixel)
    at = ray.origin + rng.uniform(1, 4, (40, 1)) * ray.direction
    long, thin = 0.7 * rng.normal(size=(40, 3)), 10.0 ** rng.uniform(-5, -1.5, (40, 1)) * rng.normal(size=(40, 3))
    mesh = Mesh(np.stack([at - long, at + long, at + thin], 1).reshape(-1, 3), np.arange(120).reshape(-1, 3))
    image = DepthImage.render(camera, mesh, color=False)
    start = at[rng.integers(40, size=100 * count)] + rng.normal(size=(100 * count, 3))
    way = at[rng.integers(40, size=100 * count)] + 0.2 * rng.normal(size=(100 * count, 3)) - start
    found = image.intersect(start, way)
    again = camera.project(
        start + np.where(found.hit, found.distance, 0.0)[:, None] * (way / np.linalg.norm(way, axis=1)[:, None])
    )
    padded = np.pad(np.isfinite(image.depth), 1)
    shifts = [(1 + i, 1 + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    wide = np.any([padded[j : j + SIZE[1], i : i + SIZE[0]] for i, j in shifts], axis=0)
    column, row = (np.clip(np.floor(x), 0, n - 1).astype(int) for x, n in zip(again.pixel[:, 0].T, SIZE, strict=True))
    return [StressRow(name, "needles", "float32", len(start), np.nan, 0, int((found.hit & ~wide[row, column]).sum()))]


def one_pixel_rows(name: str, count: int) -> list[StressRow]:
    """Images of one pixel: a ray down the middle meets it, one beside it does not."""
    model = MODELS[name]
    rows: list[StressRow] = []
    if model.images_per_point != 1:
        return rows
    for example, camera in model.examples(1, 1).items():
        if camera.images_per_point != 1 or not hasattr(camera, "local_project") or isinstance(camera, Bends):
            continue
        ray = camera.ray(np.array([[0.5, 0.5]]))
        image = DepthImage(camera, [[2.0]])
        hit = image.intersect(ray.origin, ray.direction).hit
        back = image.intersect(ray.origin, -ray.direction).hit
        missed = int((ray.valid & ~hit).sum())
        rows.append(
            StressRow(f"{snake_case(name)}, {example}", "one pixel", "float32", 2, np.nan, missed, int(back.sum()))
        )
    return rows


def run(triangles: int = 1, points: int = 10, progress: Progress | None = None) -> list[StressRow]:
    """All cases: 200 `points` rays per plane, half as many past needles; triangles are not used. Raises InputError
    below 1.
    """
    check_counts(triangles=triangles, points=points)
    cases: list[Case] = []
    for name, camera in cameras().items():
        for what in (plane_rows, own_rows, needle_rows):
            cases.append((name, lambda what=what, name=name, camera=camera: what(name, camera, points)))
    cases += [(name, lambda name=name: one_pixel_rows(name, points)) for name in MODELS]
    return run_cases(cases, progress)
