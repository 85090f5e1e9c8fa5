"""Images of points in cameras with three rays, and how sure they are, in 50 digits."""

from fractions import Fraction
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from mpcam.math import polynomial
from mpcam.stress.report import LIMIT


class Truth(NamedTuple):
    """One solution in 50 digits, away from folds.

    values, condition: w1, w2, c, and what relative errors of the input's components make of them. margins: w1, w2, w3,
    c over eps times their condition, so how surely they are positive.
    """

    values: np.ndarray
    condition: np.ndarray
    margins: np.ndarray


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


def determinant(a: Any, b: Any, c: Any) -> Any:
    return _dot(a, _cross(b, c))


def _cubic(a: Any, d: Any) -> list[Any]:
    """Coefficients of det[a_i + c d_i], the highest first."""
    k2 = determinant(a[0], d[1], d[2]) + determinant(d[0], a[1], d[2]) + determinant(d[0], d[1], a[2])
    k1 = determinant(d[0], a[1], a[2]) + determinant(a[0], d[1], a[2]) + determinant(a[0], a[1], d[2])
    return [determinant(*d), k2, k1, determinant(*a)]


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
