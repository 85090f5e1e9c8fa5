"""Where lines cross surfaces given by polynomials of degree two and four; distances along unit directions, float64."""

import numpy as np

from mpcam.math.quartic import quartic_roots


def quadratic(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Both roots (..., 2) of a t^2 + 2 b t + c without cancellation; infinite where there are fewer."""
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - a * c)
        far = -(b + np.copysign(root, b))
        pair = np.stack([c / far, far / a], axis=-1)
    return np.where(np.isfinite(pair), pair, np.inf)


def torus(ring: float, tube: float, origin: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Roots (..., 4) of (|x|^2 + ring^2 - tube^2)^2 = 4 ring^2 (x^2 + y^2) on lines; infinite where there are fewer.

    A pair that nearly meets, where a line grazes the torus, is taken for real: whoever asks sees whether it is.
    """
    k = (origin * origin).sum(-1) + ring**2 - tube**2
    m, four = (origin * along).sum(-1), 4 * ring**2
    flat = (origin[..., :2] ** 2).sum(-1), (origin[..., :2] * along[..., :2]).sum(-1), (along[..., :2] ** 2).sum(-1)
    coefficients = 4 * m, 4 * m * m + 2 * k - four * flat[2], 4 * m * k - 2 * four * flat[1], k * k - four * flat[0]
    roots = quartic_roots(np.ones_like(k), *coefficients)
    real = np.abs(np.imag(roots)) <= 1e-5 * (ring + tube)
    return np.where(real, np.real(roots), np.inf)
