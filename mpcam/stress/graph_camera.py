"""Graph cameras at their limits: points on faces and rays along them, needles, tiny faces, centers far and near."""

from typing import Any

import numpy as np

from mpcam.cameras.graph import GraphCamera
from mpcam.cameras.graph_portals import Portal
from mpcam.cameras.pinhole import Pinhole
from mpcam.math.pose import frame_origin
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.exact import DIGITS
from mpcam.stress.graph_camera_truth import Truth
from mpcam.stress.inputs import BAD_PIXELS
from mpcam.stress.projections import bad_image_rows, images, rounded
from mpcam.stress.report import EPS, Case, Progress, StressRow, check_counts, run_cases
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 64
Rows = list[StressRow]


def _rectangle(x: tuple[float, float], y: tuple[float, float], near: float, far: float) -> np.ndarray:
    """Corners of a face that is `near` deep at its left and `far` at its right."""
    return np.array([(x[0], y[0], near), (x[1], y[0], far), (x[1], y[1], far), (x[0], y[1], near)])


def _scaled(camera: GraphCamera, scale: float) -> GraphCamera:
    """The same in a world of another size."""
    portals = [
        Portal(
            scale * np.asarray(portal.polygon),
            None if portal.center is None else scale * np.asarray(portal.center),
            portal.parent,
            portal.into,
            None
            if portal.ends is None
            else np.asarray(portal.ends) * ([1, 1, 1, scale] if portal.ends.shape[1] == 4 else scale),
        )
        for portal in camera.portals
    ]
    return GraphCamera(camera.root, portals, camera.ends)


def cameras() -> dict[str, GraphCamera]:
    """Every kind; faces that are needles or tiny; centers far away, and almost in the face; tiny and huge worlds."""
    root = Pinhole(SIZE, SIZE)
    known: Any = GraphCamera.examples(SIZE, SIZE)
    found = {name: camera.with_pose(np.eye(4)) for name, camera in known.items() if name != "maze"}
    wide = ((-2.5, 2.5), (-2.5, 2.5))
    needle = _rectangle((-1e-5, 1e-5), (-1.5, 1.5), 2.0, 2.0 + 1e-6)
    tiny = _rectangle((0.3, 0.3 + 1e-6), (0.2, 0.2 + 1e-6), 2.0, 2.0)
    halves = [_rectangle((-2.0, 0.1), wide[1], 2.0, 2.0), _rectangle((0.1, 2.0), wide[1], 2.0, 2.0)]
    return found | {
        "needle": GraphCamera(root, [Portal(needle, (0.4, 0.1, 1.0))]),
        "tiny face": GraphCamera(root, [Portal(tiny, (-0.5, 0.4, 1.0))]),
        "center far away": GraphCamera(root, [Portal(_rectangle(*wide, 2.0, 2.2), (1e5, 2e5, -1e6))]),
        "center close to the face": GraphCamera(root, [Portal(_rectangle(*wide, 2.0, 2.0), (0.3, 0.2, 2.0 - 1e-5))]),
        "shared edge": GraphCamera(
            root,
            [
                Portal(halves[0], (-0.3, 0.2, 0.5), ends=[(1.0, 0.0, 0.0, -0.1)]),
                Portal(halves[1], (0.6, 0.1, 0.4), ends=[(-1.0, 0.0, 0.0, 0.1)]),
            ],
        ),
        "many bends": GraphCamera(root, _many(4)),
        "a world of 1e-8": _scaled(found["bend"], 1e-8),
        "a world of 1e8": _scaled(found["merge"], 1e8),
    }


def _many(count: int) -> list[Portal]:
    """Portals one behind the other, from alternating centers, each within the rays of the one before."""
    portals, half = [], 2.0
    for number in range(count):
        depth, side = 2.0 + number, 0.2 * (-1) ** number
        portals.append(
            Portal(_rectangle((-half, half), (-half, half), depth, depth), (side, -side, depth - 3.0), number - 1)
        )
        half *= 0.95
    return portals


def inputs(camera: GraphCamera, count: int, seed: int = 3) -> dict[str, np.ndarray]:
    """Points (N, 3) by kind, in the root's frame."""
    rng = np.random.default_rng(seed)
    pieces = _pieces(camera, rng.uniform(0, 1, (4 * count, 2)) * SIZE)
    level = rng.integers(0, camera.pieces_per_ray, 4 * count)
    start, end = (np.take_along_axis(part, level[:, None], 1)[:, 0] for part in (pieces.start, pieces.end))
    size = max(float(np.abs(camera.numbers.corners).max()), 1e-300)
    end = np.minimum(end, start + 10 * size)
    row = np.arange(4 * count)
    origin, along = pieces.origin[row, level], pieces.direction[row, level]
    there = pieces.valid[row, level]

    def on(part: Any) -> np.ndarray:
        return (origin + (part * (end - start))[:, None] * along)[there][:count]

    number = rng.integers(1, len(camera.tree.parents), count)
    corners = camera.numbers.corners[number]
    weights = rng.dirichlet(np.ones(corners.shape[1]), count)
    faces = np.einsum("nk,nkc->nc", weights, corners)
    edges = corners[:, 0] + rng.uniform(0, 1, (count, 1)) * (corners[:, 1] - corners[:, 0])
    away = faces - camera.numbers.centers[number]
    tiny = 10.0 ** rng.uniform(-16, -3, (count, 1)) * rng.choice([-1, 1], (count, 1))
    return {
        "on rays": on(rng.uniform(0, 1, 4 * count)),
        "where pieces begin": on(0.0),
        "on faces": faces,
        "beside faces": faces + tiny * away,
        "on edges of faces": edges,
        "beyond edges of faces": edges
        + 10.0 ** rng.uniform(-3, 1, (count, 1)) * (edges - camera.numbers.centers[number]),
        "at the centers": camera.numbers.centers[number],
        "anywhere": size * rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-1, 2, (count, 1)),
        "far away": 1e8 * size * on(rng.uniform(0, 1, 4 * count)) / size,
        "near the root": 1e-8 * size * rng.normal(size=(count, 3)),
        "beside the root's plane": size * rng.normal(size=(count, 3)) * [1, 1, 1e-9],
    }


def _pieces(camera: GraphCamera, pixel: np.ndarray) -> Any:
    return camera.with_pose(np.eye(4)).ray_pieces(pixel)


def image_rows(name: str, camera: GraphCamera, count: int) -> Rows:
    """Images of points by kind in both precisions, and of points that are none."""
    import mpmath

    rows = []
    with mpmath.workdps(DIGITS):
        truth = Truth(camera)
        for kind, precision, given in rounded(inputs(camera, count)):
            found = images(camera, given, precision)
            rows.append(judge(name, f"images, {kind}", precision, truth, given, found))
    return rows + bad_image_rows(name, camera)


def judge(name: str, case: str, precision: str, truth: Truth, points: np.ndarray, found: Any) -> StressRow:
    """Images of points against those by the ways that they may belong to, as far as rounding tells."""
    eps, worst, missed, invented = EPS[precision], 0.0, 0, 0
    for point, pixel, depth, claimed in zip(points, *found, strict=True):
        doubt = LIMIT * eps * (float(np.abs(point).sum()) + truth.size)
        every = truth.images(point)
        inner = [image for image in every[1:] if image.outside < -doubt]
        possible = [image for image in every[1:] if image.outside <= doubt]
        sure = bool(inner)
        if not sure and every[0].outside <= doubt:
            possible.append(every[0])
            sure = every[0].outside < -doubt and every[0].pixel_condition * eps < SIZE
        if not possible:
            invented += int(claimed)
        elif not claimed:
            missed += int(sure)
        else:
            worst = max(worst, min(_error(image, pixel, depth, eps) for image in possible))
    return StressRow(name, case, precision, len(points), worst, missed, invented)


def _error(image: Any, pixel: Any, depth: Any, eps: float) -> float:
    aside = max(abs(float(x) - y) for x, y in zip(pixel, image.pixel, strict=True)) / (eps * image.pixel_condition)
    return float(max(aside, abs(float(depth) - image.depth) / (eps * image.depth_condition)))


def ray_rows(name: str, camera: GraphCamera, count: int, seed: int = 4) -> Rows:
    """Pieces of the rays of pixels: points on them have that pixel, at that length, by the way of the piece."""
    import mpmath

    rng = np.random.default_rng(seed)
    tree, rows = camera.tree, []
    borders = []
    for corners, number in zip(camera.numbers.corners[1:], range(1, len(tree.parents)), strict=True):
        unbend = camera.numbers.unbend[tree.parents[number]]
        straight = corners @ unbend[:, :3].T + unbend[:, 3]
        ends = straight[:, :2] / straight[:, 2:] * [camera.root.fx, camera.root.fy] + [camera.root.cx, camera.root.cy]
        part = rng.uniform(0, 1, (count, 1))
        borders.append(ends[0] + part * (ends[1] - ends[0]))
    kinds = {
        "everywhere": rng.uniform(0, 1, (count, 2)) * SIZE,
        "along faces' edges": np.concatenate(borders)[:: max(1, len(borders))],
        "outside of the image": SIZE * rng.normal(size=(count, 2)) * 10.0 ** rng.uniform(0, 4, (count, 1)),
    }
    with mpmath.workdps(DIGITS):
        truth = Truth(camera)
        for kind, precision, given in rounded(kinds):
            rows.append(_judge_rays(name, f"rays, {kind}", precision, camera, truth, given))
    for precision in EPS:
        pieces = _of_precision(camera, BAD_PIXELS, precision)
        invented = sum(
            int(piece[4].sum()) + int((~np.isfinite(np.stack([*piece[0], *piece[1]]))).sum()) for piece in pieces
        )
        rows.append(StressRow(name, "rays, not finite", precision, len(BAD_PIXELS), float("nan"), 0, invented))
    return rows


def _of_precision(camera: GraphCamera, pixel: np.ndarray, precision: str) -> list[tuple[np.ndarray, ...]]:
    """Origin, direction (3, N), start, end, valid (N,) of each piece, as float64."""
    with np.errstate(all="ignore"):
        if precision == "float64":
            return [tuple(np.asarray(part) for part in piece) for piece in camera.local_ray_pieces(pixel.T)]
        from mpcam.backend import opaque_zero, types

        given = types().Array2f(*np.ascontiguousarray(pixel.T, np.float32)) + opaque_zero()
        found = camera.local_ray_pieces(given)
        numbers = [[np.asarray(part.numpy()) for part in piece] for piece in found]
        return [(*(part.astype(np.float64) for part in piece[:4]), piece[4]) for piece in numbers]


def _judge_rays(
    name: str, case: str, precision: str, camera: GraphCamera, truth: Truth, pixel: np.ndarray
) -> StressRow:
    """Every piece: a point of it, exactly on it, has the pixel by the way of one of the frusta at that level."""
    import mpmath

    eps, worst, missed, invented = EPS[precision], 0.0, 0, 0
    pieces = _of_precision(camera, pixel, precision)
    levels = np.array(camera.tree.levels)
    for k, given in enumerate(pixel):
        if not pieces[0][4][k]:
            missed += 1
        for level, (origin, direction, start, end, valid) in enumerate(pieces):
            if not valid[k]:
                continue
            length = min(end[k] - start[k], 10 * truth.size)
            way = mpmath.mpf(0.5 * length)
            point = [mpmath.mpf(float(origin[i, k])) + way * mpmath.mpf(float(direction[i, k])) for i in range(3)]
            doubt = LIMIT * eps * (float(sum(map(abs, point))) + truth.size)
            found = [truth.image(int(number), point) for number in np.flatnonzero(levels == level)]
            found = [image for image in found if level == 0 or image.outside <= doubt]
            if not found:
                invented += int(length > doubt)
                continue
            depth = mpmath.mpf(float(start[k])) + way
            worst = max(worst, min(_error(image, given, depth, eps) for image in found))
    return StressRow(name, case, precision, len(pixel), worst, missed, invented)


def narrow_view(distance: float, width: float) -> GraphCamera:
    """For distant eyes, through a portal halfway that does not bend: see `distant`."""
    root = Pinhole(VIEW, VIEW, focal_length(distance, width), camera_from_world=pose(distance))
    half, matrix = 1.5 * width * 0.5, np.asarray(root.camera_from_world)
    face = _rectangle((-half, half), (-half, half), 0.5 * distance, 0.5 * distance)
    return GraphCamera(root, [Portal((face - matrix[:3, 3]) @ matrix[:3, :3], frame_origin(matrix))])


def run(triangles: int = 30_000, points: int = 20, progress: Progress | None = None) -> Rows:
    """All cases: `points` per kind of point. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases: list[Case] = []
    for name, camera in cameras().items():
        cases.append((name, lambda name=name, camera=camera: image_rows(name, camera, points)))
        cases.append((f"{name}, rays", lambda name=name, camera=camera: ray_rows(name, camera, points)))
    return run_cases([*cases, *distant_cases(narrow_view)], progress)
