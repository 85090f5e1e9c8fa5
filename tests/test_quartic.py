"""The quartic solver on the hard quartics of the literature, by backward error against 50 digits."""

import mpmath
import numpy as np
import pytest

from mpcam.math.quartic import quartic_roots

HARD = {
    1: (1e9, 1e6, 1e3, 1),
    2: (2.003, 2.002, 2.001, 2),
    3: (1e53, 1e50, 1e49, 1e47),
    4: (1e14, 2, 1, -1),
    5: (-2e7, 1e7, 1, -1),
    6: (1e7, -1e6, 1 + 1j, 1 - 1j),
    7: (-7, -4, -1e6 + 1e5j, -1e6 - 1e5j),
    8: (1e8, 11, 1e3 + 1j, 1e3 - 1j),
    9: (1e7 + 1e6j, 1e7 - 1e6j, 1 + 2j, 1 - 2j),
    10: (1e4 + 3j, 1e4 - 3j, -7 + 1e3j, -7 - 1e3j),
    11: (1.001 + 4.998j, 1.001 - 4.998j, 1.000 + 5.001j, 1.000 - 5.001j),
    12: (1e3 + 3j, 1e3 - 3j, 1e3 + 1j, 1e3 - 1j),
    13: (2 + 1e4j, 2 - 1e4j, 1 + 1e3j, 1 - 1e3j),
    14: (1000, 1000, 1000, 1000),
    15: (1000, 1000, 1000, 2.0**-48),
    16: (1e16 + 1e7j, 1e16 - 1e7j, 1 + 0.1j, 1 - 0.1j),
    17: (10000, 10001, 10010, 10100),
    18: (4e5 + 3e2j, 4e5 - 3e2j, 3e4 + 7e3j, 3e4 - 7e3j),
    19: (1e44, 1e30, 1e30, 1),
    20: (1e14, 1e7, 1e7, 1),
    21: (1e15, 1e7, 1e7, 1),
    22: (1e154, 1e152, 10, 1),
    "Flocke, close": (1.003, 1.002, 1.001, 1),
    "Flocke, large": (-1e77, -1e76, -1e74, 1e80),
    "Flocke, pairs": (1.002 + 4.998j, 1.002 - 4.998j, 1.001 + 5.001j, 1.001 - 5.001j),
    "Flocke, zero and three": (0, 2**0.5, 2**0.5, 2**0.5),
    "four": (1, 1, 1, 1),
    "three and one": (1, 1, 1, -2),
    "two and two": (1, 1, 3, 3),
}
COEFFICIENTS = {
    23: (1, 1, 1, 3 / 8, 1e-3),
    24: (1, -(1 + 1e-30), 1e-30 - 1e60, 1e60 + 1e30, -1e30),
    "Flocke, nearly double": (2.25, 36, 113.698199211166496, -242.414406310668085, 102.022125671794569),
}


def coefficients(roots):
    """Of the monic quartic with these roots, exact but for the last rounding; the highest first."""
    with mpmath.workdps(400):
        product = [mpmath.mpf(1)]
        for root in roots:
            root = mpmath.mpc(root)
            product = [a - root * b for a, b in zip([*product, 0], [0, *product], strict=True)]
        return np.array([float(mpmath.re(x)) for x in product])


def backward_errors(k, roots):
    """Of each root, |p(x)| over its terms; and of the coefficients of all, over what they would be without signs."""
    with mpmath.workdps(400):
        each = []
        for root in roots:
            terms = [mpmath.mpf(x) * mpmath.mpc(root) ** (4 - i) for i, x in enumerate(k)]
            size = sum(abs(t) for t in terms)
            each.append(float(abs(sum(terms)) / size) if size else 0.0)
    again = coefficients(roots) * k[0]
    size = np.abs(coefficients([-abs(complex(root)) for root in roots]) * k[0])
    return max(each), np.max(np.abs(again - k)[size > 0] / size[size > 0])


CASES = {**{name: coefficients(roots) for name, roots in HARD.items()}, **COEFFICIENTS}


@pytest.mark.parametrize("name", CASES, ids=str)
def test_hard_quartics(name):
    k = np.array(CASES[name])
    roots = quartic_roots(*k)
    assert np.isfinite(roots).all()
    each, together = backward_errors(k, roots)
    assert each < 16 * 2.0**-52
    assert together < 64 * 2.0**-52


@pytest.mark.parametrize("pairs", [0, 1, 2])
@pytest.mark.parametrize("spread", [1.0, 1e6])
def test_random_quartics(pairs, spread):
    """Four real roots, two, none; a pair far larger than the other roots."""
    rng = np.random.default_rng(pairs)
    for _ in range(20):
        roots = list(rng.uniform(-0.5, 0.5, 4 - 2 * pairs)) if pairs < 2 else []
        for i in range(pairs):
            z = complex(*rng.uniform(-0.5, 0.5, 2)) * (spread if i == 0 else 1.0)
            roots += [z, z.conjugate()]
        k = coefficients(roots) * rng.uniform(0.5, 2)
        each, together = backward_errors(k, quartic_roots(*k))
        assert each < 16 * 2.0**-52
        assert together < 64 * 2.0**-52


def test_many_at_once_and_lower_degrees():
    k = np.random.default_rng(1).normal(size=(5, 3, 7))
    k[0, 0, 0] = 0
    k[:2, 1, 1] = 0
    roots = quartic_roots(*k)
    assert roots.shape == (3, 7, 4)
    assert np.isinf(roots).sum() == 3
    finite = np.where(np.isinf(roots), 0, roots)
    left = sum(k[i][..., None] * finite ** (4 - i) for i in range(5))
    size = sum(np.abs(k[i][..., None] * finite ** (4 - i)) for i in range(5))
    assert (np.abs(left) < 1e-14 * size)[np.isfinite(roots)].all()
    assert np.array_equal(quartic_roots(1, 0, 0, 0, 0), np.zeros(4))
