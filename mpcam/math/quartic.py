"""All roots of quartics with real coefficients, as accurate as the coefficients allow; float64 NumPy.

After Orellana and De Michele, "Algorithm 1010: boosting efficiency in solving quartic equations with no compromise in
accuracy" (ACM TOMS 46(2), 2020): the quartic is the product of two quadratics, which follow from an L D L^T
factorization whose parameter is a root of a cubic; several formulas for their coefficients are tried, the one that
reproduces the quartic best is kept, and Newton's method polishes it.
"""

from typing import Any

import numpy as np

Factors = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

EPS = 2.0**-52
NEWTON_STEPS = 8


def quartic_roots(a: Any, b: Any, c: Any, d: Any, e: Any) -> np.ndarray:
    """Roots (..., 4), complex, of a x^4 + b x^3 + c x^2 + d x + e; broadcasts. Where a = 0, missing roots are infinite.

    What is small is the backward error: each root is one of a quartic whose coefficients differ in the last places.
    """
    given = np.stack(np.broadcast_arrays(*[np.asarray(x, np.float64) for x in (a, b, c, d, e)]))
    flat = given.reshape(5, -1)
    roots = np.full((flat.shape[1], 4), np.inf + 0j)
    full = flat[0] != 0
    with np.errstate(all="ignore"):  # every candidate is tried; those that fail lose
        if full.any():
            roots[full] = _monic_roots(flat[1:, full] / flat[0, full])
    for i in np.flatnonzero(~full):
        found = np.roots(flat[:, i])
        roots[i, : len(found)] = found
    return roots.reshape(*given.shape[1:], 4)


def _monic_roots(k: np.ndarray) -> np.ndarray:
    """Roots (N, 4) for coefficients k (4, N) of x^3, x^2, x, 1."""
    with_shift = k[0] / 4
    candidates = [
        _split_by_size(k),
        *_factored(k),
        *(_moved(f, with_shift) for f in _factored(_shifted(k, with_shift))),
    ]
    candidates += [refined for f in candidates for refined in _refined(k, f)]
    best, error = candidates[0], _error(k, candidates[0])
    for candidate in candidates[1:]:
        best, error = _better(k, best, error, candidate)
    for _ in range(NEWTON_STEPS):
        best, error = _better(k, best, error, _newton(k, best))
    return np.stack([*_quadratic(best[0], best[1]), *_quadratic(best[2], best[3])], axis=-1)


def _error(k: np.ndarray, factors: Factors) -> np.ndarray:
    """How far the product of two quadratics is from the quartic: largest relative error of a coefficient."""
    terms = _terms(factors)
    size = np.abs(k) + EPS * np.sum(np.abs(terms), axis=0)
    error = np.max(np.abs(np.sum(terms, axis=0) - k) / np.where(size > 0, size, 1), axis=0)
    return np.where(np.isfinite(error), error, np.inf)


def _terms(factors: Factors) -> np.ndarray:
    """Summands (3, 4, N) of the coefficients of (x^2 + p x + q) (x^2 + r x + s)."""
    p, q, r, s = factors
    zero = 0 * p
    return np.array([[p, q, p * s, q * s], [r, s, r * q, zero], [zero, p * r, zero, zero]])


def _better(k: np.ndarray, best: Factors, error: np.ndarray, other: Factors) -> tuple[Any, np.ndarray]:
    new = _error(k, other)
    return tuple(np.where(new < error, y, x) for x, y in zip(best, other, strict=True)), np.minimum(error, new)


def _split_by_size(k: np.ndarray) -> Factors:
    """Two large roots and two small ones."""
    a, b, c, d = k.astype(complex)
    return a, b, c / b, d / b


def _factored(k: np.ndarray) -> list[Factors]:
    """From (x^2 + l1 x + l3)^2 + m (x + l2)^2, by the formulas for l2 and m that there are."""
    # In units in which the coefficients are about 1.
    unit = np.max(np.abs(k) ** (1 / np.arange(1, 5)[:, None]), axis=0)
    unit = 2.0 ** np.round(np.log2(np.where(unit > 0, unit, 1)))
    a, b, c, d = k / unit[None] ** np.arange(1, 5)[:, None]
    phi = _dominant_root(a * c / 4 - d - b * b / 12, b * (a * c / 24 + d / 3 - b * b / 108) - c * c / 8 - a * a * d / 8)
    l1, l3 = a / 2, b / 6 + phi
    m1, cross, rest = 2 * b / 3 - 2 * phi - l1 * l1, c / 2 - l1 * l3, d - l3 * l3
    l2, l2_other = cross / m1, rest / cross
    found = [(m1, l2), (m1, l2_other), (cross / l2_other, l2_other), (cross * cross / rest, l2_other)]
    factors = []
    for m, l2 in found:
        root = np.sqrt(-m + 0j)
        factors.append((l1 + root, l3 + root * l2, l1 - root, l3 - root * l2))
    root = np.sqrt(-rest + 0j)
    factors.append((l1 + 0j, l3 + root, l1 + 0j, l3 - root))  # m = 0
    return [(p * unit, q * unit**2, r * unit, s * unit**2) for p, q, r, s in factors]


def _dominant_root(g: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Real root of x^3 + g x + h, the one of largest magnitude where there are three."""
    q, r = -g / 3, np.abs(h) / 2
    three = r * r < q**3
    angle = np.arccos(np.clip(r / np.where(three, np.sqrt(np.abs(q)) ** 3, 1), -1, 1))
    single = np.cbrt(r + np.sqrt(np.where(three, 0, r * r - q**3)))
    single = single + np.where(single > 0, q / np.where(single > 0, single, 1), 0)
    x = -np.where(h >= 0, 1.0, -1.0) * np.where(three, 2 * np.sqrt(np.abs(q)) * np.cos(angle / 3), single)
    for _ in range(3):
        slope = 3 * x * x + g
        step = ((x * x + g) * x + h) / np.where(slope != 0, slope, 1)
        after = x - step
        smaller = np.abs((after * after + g) * after + h) < np.abs((x * x + g) * x + h)
        x = np.where(smaller, after, x)
    return x


def _shifted(k: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Coefficients of the quartic in y = x + by."""
    a, b, c, d = k
    s = -by
    return np.array(
        [a + 4 * s, b + s * (3 * a + 6 * s), c + s * (2 * b + s * (3 * a + 4 * s)), d + s * (c + s * (b + s * (a + s)))]
    )


def _moved(factors: Factors, by: np.ndarray) -> Factors:
    """Factors in x of factors in y = x + by."""
    p, q, r, s = factors
    return p + 2 * by, q + by * (p + by), r + 2 * by, s + by * (r + by)


def _refined(k: np.ndarray, factors: Factors) -> list[Factors]:
    """The factor with the smaller constant from the other one, by each coefficient in turn."""
    p, q, r, s = factors
    swap = np.abs(s) > np.abs(q)
    p, q, r, s = np.where(swap, r, p), np.where(swap, s, q), np.where(swap, p, r), np.where(swap, q, s)
    s = k[3] / q
    return [(p, q, r, s), (p, q, k[0] - p, s), (p, q, (k[1] - q - s) / p, s), (p, q, (k[2] - p * s) / q, s)]


def _newton(k: np.ndarray, factors: Factors) -> Factors:
    """One step on the four equations, in relative unknowns; where they are singular, none."""
    p, q, r, s = factors
    terms = _terms(factors)
    size = np.abs(k) + EPS * np.sum(np.abs(terms), axis=0)
    size = np.where(size > 0, size, 1)
    one, zero = np.ones_like(p), np.zeros_like(p)
    # Unknowns in units of their values, a small one in units of what would matter.
    least = np.stack([np.abs(p) + np.abs(r), np.abs(q) + np.abs(s)]) * EPS
    least = np.where(least > 0, least, 1)
    units = np.stack([np.maximum(np.abs(x), least[i % 2]) for i, x in enumerate((p, q, r, s))])
    rows = np.array([[one, zero, one, zero], [r, one, p, one], [s, r, q, p], [zero, s, zero, q]])
    rows = rows * units[None] / size[:, None]
    left = (np.sum(terms, axis=0) - k) / size
    matrix = np.moveaxis(rows, 2, 0)
    fine = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(left).all(axis=0)
    matrix[~fine] = np.eye(4)
    fine = fine & (np.abs(np.linalg.det(matrix)) > 1e-100)
    matrix[~fine] = np.eye(4)
    step = np.linalg.solve(matrix, np.where(fine, left, 0).T[:, :, None])[:, :, 0].T * units
    return p - step[0], q - step[1], r - step[2], s - step[3]


def _quadratic(p: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Roots of x^2 + p x + q, the larger first."""
    unit = np.maximum(np.abs(p), np.sqrt(np.abs(q)))
    unit = np.where(unit > 0, unit, 1)
    p, q = p / unit, q / unit / unit
    root = np.sqrt(p * p - 4 * q)
    # Without cancellation; real roots where p and q are real.
    sign = np.where(np.real(np.conj(p) * root) >= 0, 1, -1)
    large = -0.5 * (p + sign * root)
    small = np.where(large != 0, q / np.where(large != 0, large, 1), 0)
    return large * unit, small * unit
