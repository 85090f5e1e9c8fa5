"""Cameras with three rays at their limits: images of points against 50 digits, in both precisions."""

from collections.abc import Callable
from fractions import Fraction
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.three_rays import project
from mpcam.errors import InputError
from mpcam.math import polynomial
from mpcam.stress import camera_triangle_bounds as bounds
from mpcam.stress.report import Case

LIMIT = 16.0
"""Largest error that passes, in units of eps times the condition number."""

FAR = 1e3
"""Images that are off by more than this many LIMIT belong to no solution."""

MODEL = "camera-triangles"
Progress = Callable[[int, int, str], None]


Inputs = tuple[np.ndarray, np.ndarray, np.ndarray]


def run(triangles: int = 1_000_000, points: int = 200, progress: Progress | None = None) -> list[Case]:
    """All cases, `points` of each kind and precision. Raises InputError below 1.

    triangles: how many pairs of a camera triangle and a scene triangle are looked at for each kind of rays, to find
    pixels that a bound leaves out.
    """
    if triangles < 1 or points < 1:
        raise InputError(f"stress: triangles={triangles}, points={points}: at least 1 of each is needed")
    steps = 2 * len(KINDS) + len(bounds.KINDS)

    def told(done: int, _: int, what: str) -> None:
        if progress:
            progress(done, steps, what)

    cases = [*projection_cases(points, progress=told), not_finite_case()]
    for number, kind in enumerate(bounds.KINDS):
        told(2 * len(KINDS) + number, steps, f"bounds, {kind}")
        cases += bounds.bound_cases(kind, triangles)
    told(steps, steps, "done")
    return cases


def projection_cases(count: int, seed: int = 1, progress: Progress | None = None) -> list[Case]:
    """`project` of all kinds in float64 (NumPy) and float32 (Dr.Jit, as kernels run it), against 50 digits."""
    given = [kind(np.random.default_rng(seed), count) for kind in KINDS.values()]
    v, d, q = [np.concatenate(parts) for parts in zip(*given, strict=True)]
    cases = []
    for precision, images in (("float64", _images_double), ("float32", _images_single)):
        rounded = [x.astype(precision).astype(np.float64) for x in (v, d, q)]
        found = images(*rounded)
        for number, kind in enumerate(KINDS):
            if progress:
                progress(len(cases), 2 * len(KINDS), f"{kind}, {precision}")
            part = slice(number * count, (number + 1) * count)
            eps = float(np.finfo(precision).eps)
            cases.append(judged(kind, precision, [x[part] for x in rounded], found[:, :, part], eps))
    return cases


def _images_double(v: np.ndarray, d: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Three images, each w1, w2, c, valid, of each input: (3, 4, count)."""
    images = project(v.transpose(1, 2, 0), d.transpose(1, 2, 0), q.T)
    return np.array([[image.w1, image.w2, image.c, image.valid] for image in images])


def _images_single(v: np.ndarray, d: np.ndarray, q: np.ndarray) -> np.ndarray:
    import drjit as dr

    from mpcam.rendering.device import types

    corners, rays = [[types().Array3f(*x[:, i].T.astype(np.float32)) for i in range(3)] for x in (v, d)]
    images = [list(image) for image in project(corners, rays, types().Array3f(*q.T.astype(np.float32)))]
    dr.eval(images)
    return np.array([[np.broadcast_to(x.numpy(), len(q)) for x in image] for image in images], np.float64)


def not_finite_case() -> Case:
    """Numbers that are none in each place in turn, and triangles and rays that are nothing."""
    v, d, q = [x[0] for x in KINDS["everywhere"](np.random.default_rng(1), 1)]
    inputs = [(v, 0 * d, q), (0 * v, d, 0 * q), (0 * v + q, d, q), (0 * v, 0 * d, 0 * q)]
    for which in range(3):
        for bad in (np.nan, np.inf, -np.inf):
            changed = [x.copy() for x in (v, d, q)]
            changed[which].flat[which] = bad
            inputs.append(tuple(changed))
    images = [image for given in inputs for image in project(*given)]
    invented = sum(int(image.valid) or not np.isfinite(image[:3]).all() for image in images)
    return Case(MODEL, "not finite, or nothing", "float64", len(inputs), float("nan"), 0, invented)


class Truth(NamedTuple):
    """One solution in 50 digits, away from folds.

    values, condition: w1, w2, c, and what relative errors of the input's components make of them. margins: w1, w2, w3,
    c over eps times their condition, so how surely they are positive.
    """

    values: np.ndarray
    condition: np.ndarray
    margins: np.ndarray


def judged(kind: str, precision: str, given: Any, found: np.ndarray, eps: float) -> Case:
    """One row: found (3, 4, count) against the truth of each input."""
    worst, missed, invented = 0.0, 0, 0
    for i in range(found.shape[2]):
        one = judge_one(given[0][i], given[1][i], given[2][i], found[:, :, i], eps)
        worst, missed, invented = max(worst, one[0]), missed + one[1], invented + one[2]
    return Case(MODEL, kind, precision, found.shape[2], worst, missed, invented)


def judge_one(v: Any, d: Any, q: Any, found: np.ndarray, eps: float) -> tuple[float, int, int]:
    """Largest error, solutions missed and images invented, for one input; found (3, 4): w1, w2, c, valid.

    Near a fold, and where rounding of the input decides whether a solution is inside, both answers are right.
    """
    known, folds = truths(v, d, q, eps)
    images = [row[:3] for row in found if row[3]]
    worst, taken, invented = 0.0, set(), False
    for image in images:
        errors = [np.max(np.abs(image - t.values) / (eps * t.condition)) for t in known]
        error, nearest = min([(e, i) for i, e in enumerate(errors) if i not in taken], default=(np.inf, -1))
        if error > LIMIT and any(low <= image[2] <= high for low, high in folds):
            continue
        if error > FAR * LIMIT:
            invented = True
            continue
        taken.add(nearest)
        worst = max(worst, float(error))
        invented |= bool((known[nearest].margins < -LIMIT).any())
    sure = [i for i, t in enumerate(known) if (t.margins > LIMIT).all()]
    return worst, int(any(i not in taken for i in sure)), int(invented)


def truths(v: Any, d: Any, q: Any, eps: float) -> tuple[list[Truth], list[tuple[float, float]]]:
    """All solutions of q = sum w_i (v_i + c d_i), wherever they are, and the ranges of c near folds.

    From the exact cubic in c. Two roots, real or complex, are near a fold, and no solutions here, if relative errors of
    4 LIMIT eps in the input can make them one.
    """
    import mpmath

    with mpmath.workdps(50):
        exact = [[[Fraction(float(x)) for x in row] for row in rows] for rows in (v, d)]
        point = [Fraction(float(x)) for x in q]
        a = [[x - y for x, y in zip(row, point, strict=True)] for row in exact[0]]
        coefficients = _cubic(a, exact[1])
        while coefficients and coefficients[0] == 0:
            coefficients.pop(0)
        if len(coefficients) < 2:
            return [], []
        k = [mpmath.mpf(x.numerator) / x.denominator for x in coefficients]
        roots = _roots(coefficients)
        corners, rays = [[[mpmath.mpf(float(x)) for x in row] for row in rows] for rows in (v, d)]
        seen = [mpmath.mpf(float(x)) for x in q]
        known, folds, near = [], [], set()
        for i, j in combinations(range(len(roots)), 2):
            reach = _fold_reach(corners, rays, seen, k, roots[i], roots[j], eps)
            if abs(roots[i] - roots[j]) / 2 <= reach:
                middle = ((roots[i] + roots[j]) / 2).real
                folds.append((float(middle - 2 * reach), float(middle + 2 * reach)))
                near |= {i, j}
        for i, root in enumerate(roots):
            if i in near or abs(root.imag) > mpmath.mpf(10) ** -20 * abs(root):
                continue
            solution = _solution(corners, rays, seen, root.real, eps)
            if solution is not None:
                known.append(solution)
        return known, folds


def _roots(k: list[Fraction]) -> list[Any]:
    """Roots of a linear, quadratic or cubic polynomial, the highest coefficient first, by the closed forms.

    From exact coefficients in 200 digits: what the closed forms cancel, some 60 of them, does not matter.
    """
    import mpmath

    if k[-1] == 0:
        return [*(_roots(k[:-1]) if len(k) > 2 else []), mpmath.mpc(0)]
    with mpmath.workdps(200):
        a = [mpmath.mpf(x.numerator) / x.denominator for x in [x / k[0] for x in k[1:]]]
        if len(a) == 1:
            return [mpmath.mpc(-a[0])]
        if len(a) == 2:
            root = mpmath.sqrt(mpmath.mpc(a[0] ** 2 / 4 - a[1]))
            return [-a[0] / 2 - root, -a[0] / 2 + root]
        p, q = a[1] - a[0] ** 2 / 3, 2 * a[0] ** 3 / 27 - a[0] * a[1] / 3 + a[2]
        root = mpmath.sqrt(mpmath.mpc(q**2 / 4 + p**3 / 27))
        u = max(-q / 2 + root, -q / 2 - root, key=abs) ** (mpmath.mpf(1) / 3)
        if abs(u) == 0:
            return [mpmath.mpc(-a[0] / 3)] * 3
        turns = [u * mpmath.expjpi(mpmath.mpf(2 * i) / 3) for i in range(3)]
        return [t - p / (3 * t) - a[0] / 3 for t in turns]


def _det(a: Any, b: Any, c: Any) -> Any:
    return _dot(a, _cross(b, c))


def _cubic(a: Any, d: Any) -> list[Any]:
    """Coefficients of det[a_i + c d_i], the highest first."""
    k2 = _det(a[0], d[1], d[2]) + _det(d[0], a[1], d[2]) + _det(d[0], d[1], a[2])
    k1 = _det(d[0], a[1], a[2]) + _det(a[0], d[1], a[2]) + _det(a[0], a[1], d[2])
    return [_det(*d), k2, k1, _det(*a)]


def _fold_reach(v: Any, d: Any, q: Any, k: list[Any], root: Any, other: Any, eps: float) -> Any:
    """How far from their middle two roots may be to become one by errors of 4 LIMIT eps: k'' reach^2 / 2 = error."""
    import mpmath

    middle, degree = ((root + other) / 2).real, len(k) - 1
    second = [x * (degree - i) * (degree - i - 1) for i, x in enumerate(k[:-2])]
    bend = abs(polynomial(second[::-1], middle)) if second else mpmath.mpf(0)
    swept, sizes = _swept(v, d, q, middle)
    error = mpmath.mpf(0)
    for i in range(3):
        error += _dot(_size(_cross(swept[(i + 1) % 3], swept[i - 1])), sizes[i])
        # Two errors at once, which is all there is where the swept triangle has no area.
        error += 4 * LIMIT * eps * max(_size(swept[i])) * max(sizes[(i + 1) % 3]) * max(sizes[i - 1])
    # Three roots in one place: the third derivative takes over.
    twist = abs(second[0]) if degree == 3 else mpmath.mpf(0)
    bend = max(bend, twist * abs(root - other))
    return mpmath.sqrt(8 * LIMIT * eps * error / bend) if bend > 0 else mpmath.mpf(0)


def _swept(v: Any, d: Any, q: Any, c: Any) -> tuple[list[Any], list[Any]]:
    """Corners v + c d - q of the swept triangle, and the same sums of magnitudes."""
    swept = [[x + c * y - z for x, y, z in zip(v[i], d[i], q, strict=True)] for i in range(3)]
    return swept, [[abs(x) + abs(c * y) + abs(z) for x, y, z in zip(v[i], d[i], q, strict=True)] for i in range(3)]


def _solution(v: Any, d: Any, q: Any, c: Any, eps: float) -> Truth | None:
    """The weights at a root; None where the swept triangle has collapsed, or a family of rays meets the point."""
    import mpmath

    swept, sizes = _swept(v, d, q, c)
    a, b = [[x - y for x, y in zip(swept[i], swept[2], strict=True)] for i in range(2)]
    normal = _cross(a, b)
    square = _dot(normal, normal)
    extent = max(abs(v[i][j]) + abs(c * d[i][j]) for i in range(3) for j in range(3))
    if mpmath.sqrt(square) <= mpmath.mpf(10) ** -25 * extent**2:
        return None
    w = [_dot(normal, _cross(swept[1], swept[2])) / square, _dot(normal, _cross(swept[2], swept[0])) / square]
    w.append(1 - w[0] - w[1])
    ray = [sum(w[i] * d[i][j] for i in range(3)) for j in range(3)]
    size = [abs(q[j]) + sum(abs(w[i]) * (abs(v[i][j]) + abs(c * d[i][j])) for i in range(3)) for j in range(3)]
    det = _dot(normal, ray)
    if abs(det) <= mpmath.mpf(10) ** -30 * mpmath.sqrt(square * _dot(ray, ray)):
        return None
    rows = [[x / det for x in row] for row in (_cross(b, ray), _cross(ray, a), normal)]
    rows.insert(2, [-x - y for x, y in zip(*rows[:2], strict=True)])
    least = mpmath.mpf(10) ** -300
    condition = [abs(x) + _dot(_size(row), size) + least for x, row in zip((*w, c), rows, strict=True)]
    margins = np.array([float(x / (eps * kappa)) for x, kappa in zip((*w, c), condition, strict=True)])
    return Truth(
        np.array([float(x) for x in (w[0], w[1], c)]), np.array([float(condition[i]) for i in (0, 1, 3)]), margins
    )


def _size(x: Any) -> Any:
    return [abs(component) for component in x]


def _cross(a: Any, b: Any) -> Any:
    return [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3)]


def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _seen(rng: np.random.Generator, v: np.ndarray, d: np.ndarray, decades: tuple[float, float] = (-1, 1)) -> Inputs:
    """With points that appear inside; half of the inputs turned and moved, so that their structure is rounded."""
    count = len(v)
    w, c = rng.dirichlet((1, 1, 1), count), 10 ** rng.uniform(*decades, count)
    return _turned(rng, v, d, np.einsum("ni,nij->nj", w, v + c[:, None, None] * d))


def _turned(rng: np.random.Generator, v: np.ndarray, d: np.ndarray, q: np.ndarray) -> Inputs:
    half = len(v) // 2
    turn = np.linalg.qr(rng.normal(size=(half, 3, 3)))[0]
    move = rng.normal(size=(half, 3))
    v[:half] = v[:half] @ turn + move[:, None]
    d[:half] = d[:half] @ turn
    q[:half] = np.einsum("nj,njk->nk", q[:half], turn) + move
    return v, d, q


def _lattice(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Random multiples of 1/16, so that their sums and products are exact in float32."""
    return np.round(16 * rng.normal(size=shape)) / 16


def _flat(rng: np.random.Generator, count: int) -> np.ndarray:
    """Corners in the plane z = 0, of triangles that are not too thin."""
    v = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]) + 0.3 * _lattice(rng, count, 3, 3)
    v = np.round(16 * v) / 16
    v[:, :, 2] = 0
    return v


def _with_z(d: np.ndarray, z: Any) -> np.ndarray:
    d[:, :, 2] = z
    return d


def _prescribed(rng: np.random.Generator, w: np.ndarray, c: np.ndarray) -> Inputs:
    """Directions for which a point has given images, w (count, 3, 3) and c (count, 3), since D is affine."""
    v, q = rng.normal(size=(len(w), 3, 3)), 2 * rng.normal(size=(len(w), 3))
    d = np.linalg.solve(w, (q[:, None] - w @ v) / c[:, :, None])
    return v, d, q


def _near_fold(rng: np.random.Generator, count: int) -> Inputs:
    w, c = rng.dirichlet((1, 1, 1), (count, 3)), 10 ** rng.uniform(-1, 1, (count, 3))
    apart = 10 ** rng.uniform(-9, -1, count)
    w[:, 1] = w[:, 0] + apart[:, None] * (w[:, 1] - w[:, 0])
    c[:, 1] = c[:, 0] + apart * (c[:, 1] - c[:, 0])
    return _prescribed(rng, w, c)


def _pinhole(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    v, centre = _flat(rng, count), np.round(16 * (np.array([0.5, 0.5, -2]) + 0.3 * rng.normal(size=(count, 3)))) / 16
    return v, v - centre[:, None], centre


def _collapsed(rng: np.random.Generator, count: int) -> Inputs:
    """The point is the centre, or on a slit: points of the swept triangle, which has no area."""
    v, d, q = _pinhole(rng, count)
    half = count // 2
    start, along = _lattice(rng, half, 1, 3), _lattice(rng, half, 1, 3)
    start[..., 2], along[..., 2] = 1, 0
    d[:half] = start + along * np.array([[0.0], [2], [5]]) - v[:half]
    q[:half] = (start + along)[:, 0]
    d[half:] = -d[half:]
    return v, d, q


def _families(rng: np.random.Generator, count: int) -> Inputs:
    """All rays in the camera's plane, points off it and on it."""
    v, d = _flat(rng, count), _with_z(_lattice(rng, count, 3, 3), 0)
    q = _lattice(rng, count, 3)
    q[::2, 2] = 0
    return v, d, q


def _scaled(rng: np.random.Generator, count: int, scale: float) -> Inputs:
    v, d, q = KINDS["everywhere"](rng, count)
    return v * scale, d * scale, q * scale


def _unit(d: np.ndarray) -> np.ndarray:
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def _tiny(rng: np.random.Generator, count: int) -> np.ndarray:
    return 10 ** rng.uniform(-8, -1, (count, 1, 1)) * rng.normal(size=(count, 3, 3))


def _general(rng: np.random.Generator, count: int) -> np.ndarray:
    return rng.normal(size=(count, 3, 3))


def _coplanar(rng: np.random.Generator, count: int) -> Inputs:
    d = _lattice(rng, count, 3, 3)
    d[:, 2] = 0.5 * d[:, 0] + rng.choice([-0.5, 0.5, 1.5], (count, 1)) * d[:, 1]
    return _seen(rng, _lattice(rng, count, 3, 3), d)


def _on_plane(rng: np.random.Generator, count: int) -> Inputs:
    v, d = _flat(rng, count), _lattice(rng, count, 3, 3)
    d[:, :, 2] = np.abs(d[:, :, 2]) + 0.25
    return _turned(rng, v, d, np.einsum("ni,nij->nj", rng.dirichlet((1, 1, 1), count), v))


def _needles(rng: np.random.Generator, count: int) -> Inputs:
    v = _flat(rng, count)
    v[:, 1] = v[:, 0] + 10 ** rng.uniform(-5, -1, (count, 1)) * (v[:, 1] - v[:, 0])
    return _seen(rng, v, np.array([0, 0, 1]) + 0.3 * _general(rng, count))


KINDS: dict[str, Callable[[np.random.Generator, int], Inputs]] = {
    "everywhere": lambda r, n: _seen(r, _general(r, n), _general(r, n)),
    "three images": lambda r, n: _prescribed(r, r.dirichlet((1, 1, 1), (n, 3)), 10 ** r.uniform(-1, 1, (n, 3))),
    "near a fold": _near_fold,
    "parallel rays": lambda r, n: _seen(r, _flat(r, n), (_lattice(r, n, 3, 1) ** 2 + 0.5) * _lattice(r, n, 1, 3)),
    "nearly parallel rays": lambda r, n: _seen(r, _flat(r, n), r.normal(size=(n, 1, 3)) + _tiny(r, n)),
    "general linear": lambda r, n: _seen(r, _flat(r, n), _with_z(_lattice(r, n, 3, 3), 1)),
    "pinhole": lambda r, n: _seen(r, *_pinhole(r, n)[:2]),
    "pinhole, from behind": lambda r, n: _seen(r, (p := _pinhole(r, n))[0], -p[1]),
    "pinhole, unit directions": lambda r, n: _seen(r, (p := _pinhole(r, n))[0], _unit(p[1])),
    "nearly concurrent rays": lambda r, n: _seen(r, (p := _pinhole(r, n))[0], _tiny(r, n) - p[1]),
    "collapsed on the point": _collapsed,
    "coplanar directions": _coplanar,
    "one ray in the plane": lambda r, n: _seen(r, _flat(r, n), _with_z(_lattice(r, n, 3, 3), [0, 1, 2])),
    "nearly in the plane": lambda r, n: _seen(r, _flat(r, n), _with_z(_general(r, n), _tiny(r, n)[:, :, 2])),
    "mixed signs": lambda r, n: _seen(r, _flat(r, n), _with_z(_lattice(r, n, 3, 3), [-1, 1, 0.5])),
    "all rays in the plane": _families,
    "on the plane": _on_plane,
    "near the plane": lambda r, n: _seen(r, _general(r, n), _general(r, n), (-8, -3)),
    "far points": lambda r, n: _seen(r, _general(r, n), np.array([0, 0, 2]) + _general(r, n), (2, 5)),
    "far from the origin": lambda r, n: _seen(r, _general(r, n) + 10 ** r.uniform(1, 4, (n, 1, 1)), _general(r, n)),
    "needles": _needles,
    "rays of unequal length": lambda r, n: _seen(r, _general(r, n), _general(r, n) * 10 ** r.uniform(-2, 2, (n, 3, 1))),
    "scale 1e-8": lambda r, n: _scaled(r, n, 1e-8),
    "scale 1e8": lambda r, n: _scaled(r, n, 1e8),
}
"""Camera triangles and points by kind: v, d (count, 3, 3) and q (count, 3)."""
