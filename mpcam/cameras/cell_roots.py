"""Where rays meet points in cells with a ray at each corner, bilinear between: every place, by subdivision. NumPy.

A ray with origin o and direction d passes through q where p x d = 0 with p = o - q. Over a part of a cell p and d are
bilinear, so the two components of p x d across the middle direction are biquadratic, and their Bernstein coefficients
bound them. A part without a root is left out; where the derivative hardly changes there is at most one root, and
Newton's iteration, kept inside, finds it; any other part is cut in two, across the way along which that changes most.
What is left after LEVELS cuts is dropped: there two roots meet, or rays of a whole curve or area meet in the point.
"""

from typing import NamedTuple

import numpy as np

LEVELS = 52
MOST_PARTS = 1024
"""Parts of a cell that wait to be looked at; where it takes more, the point is seen all along a curve."""
STEPS = 8
_EPS = 2.0**-52


class Roots(NamedTuple):
    """Places in cells. number: of the pair; x, y: 0 to 1 over the cell; error: how far rounding may have moved them."""

    number: np.ndarray
    x: np.ndarray
    y: np.ndarray
    error: np.ndarray


class _Parts(NamedTuple):
    """Parts of cells. number: of the pair; low, size (2, M): in the cell; p, d (4, 3, M): at the four corners."""

    number: np.ndarray
    low: np.ndarray
    size: np.ndarray
    p: np.ndarray
    d: np.ndarray

    def __getitem__(self, chosen: np.ndarray) -> "_Parts":  # pyright: ignore[reportIncompatibleMethodOverride]
        return _Parts(*(values[..., chosen] for values in self))

    def halves(self, upright: np.ndarray) -> "_Parts":
        """The left and right halves of parts, or where not upright the upper and lower ones."""
        cut = np.where(upright, np.array([[0.5], [1.0]]), np.array([[1.0], [0.5]]))
        size = self.size * cut
        low = np.concatenate([self.low, self.low + self.size * (1 - cut)], 1)
        p, d = (_halves(corners, upright) for corners in (self.p, self.d))
        return _Parts(np.tile(self.number, 2), low, np.tile(size, 2), p, d)


def roots(points: np.ndarray, places: np.ndarray, along: np.ndarray) -> Roots:
    """All isolated places (x, y) in cells whose ray, or its extension backwards, passes through a point.

    points (3, M), one for each cell; places, along (4, 3, M): origins and directions at the corners, upper left, upper
    right, lower left, lower right. A place at a border may be found slightly outside of the cell, within its error.
    """
    count = points.shape[1]
    scale = np.abs(along).max((0, 1))
    d = along / np.where(scale > 0, scale, 1.0)
    parts = _Parts(np.arange(count), np.zeros((2, count)), np.ones((2, count)), places - points, d)
    far = np.abs(points).max(0)
    found = []
    for _ in range(LEVELS):
        if parts.number.size == 0:
            break
        system = _System(parts, far[parts.number])
        alive = system.alive
        one = alive & system.at_most_one
        if one.any():
            found.append(_newton(parts[one], system.chosen(one)))
        waiting = np.bincount(parts.number[alive & ~one], minlength=count)
        kept = alive & ~one & (waiting[parts.number] <= MOST_PARTS // 2)
        parts = parts[kept].halves(system.chosen(kept).upright(parts.size[:, kept]))
    if not found:
        return Roots(np.zeros(0, np.int64), *np.zeros((3, 0)))
    return Roots(*(np.concatenate(values) for values in zip(*found, strict=True)))


class _System:
    """The two equations over parts, seen along the middle direction.

    p, d (3, 4, M): at the corners, in axes whose third is that direction. doubt (M,): what rounding makes of the
    equations. inverse (2, 2, M): of the derivative in the middle; zero where there is none.
    """

    def __init__(self, parts: _Parts, far: np.ndarray):
        middle = parts.d.mean(0)
        length = np.sqrt((middle * middle).sum(0))
        axes = _frame(middle / np.where(length > 0, length, 1.0))
        self.p, self.d = (np.einsum("iam,cam->icm", axes, corners) for corners in (parts.p, parts.d))
        size = np.sqrt((parts.p * parts.p).sum(1)).max(0) + far
        self.doubt = 32 * _EPS * size * np.sqrt((parts.d * parts.d).sum(1)).max(0)
        self.f = _coefficients(self.p, self.d)
        bell = np.array([0.25, 0.5, 0.25])
        x = np.einsum("ajm,j->am", self.f[:, 2] - self.f[:, 0], bell)
        y = np.einsum("aim,i->am", self.f[:, :, 2] - self.f[:, :, 0], bell)
        determinant = x[0] * y[1] - x[1] * y[0]
        largest = np.abs(x).max(0) * np.abs(y).max(0)
        self.regular = (length > 0) & (np.abs(determinant) > 1e-12 * largest)
        over = 1.0 / np.where(self.regular, determinant, 1.0)
        self.inverse = np.where(self.regular, np.array([[y[1], -y[0]], [-x[1], x[0]]]) * over, 0.0)
        self.steepest = np.where((x * x).sum(0) >= (y * y).sum(0), x, y)

    def chosen(self, which: np.ndarray) -> "_System":
        """The same for some of the parts."""
        system = object.__new__(_System)
        for name, values in vars(self).items():
            setattr(system, name, values[..., which])
        return system

    @property
    def alive(self) -> np.ndarray:
        """Where there may be a root: no equation, nor one of two pairs of their sums, has one sign throughout."""
        f, doubt = self.f.reshape(2, 9, -1), self.doubt
        level = np.abs(f).max((0, 1)) <= doubt  # zero throughout
        # Along the steepest derivative, and across it: a curve of values that passes by zero is seen from the side.
        length = np.sqrt((self.steepest * self.steepest).sum(0))
        ahead = self.steepest / np.where(length > 0, length, 1.0)
        turned = np.stack([ahead[0] * f[0] + ahead[1] * f[1], ahead[0] * f[1] - ahead[1] * f[0]])
        alive = ~level & ~_one_sign(turned, np.stack([2 * doubt, 2 * doubt])).any(0)
        solved = np.einsum("abm,bkm->akm", self.inverse, f)
        apart = _one_sign(solved, self.rounding).any(0)
        return alive & ~(self.regular & apart)

    @property
    def rounding(self) -> np.ndarray:
        """What rounding makes of a root, (2, M), as part of the size."""
        return np.abs(self.inverse).sum(1) * self.doubt

    def upright(self, size: np.ndarray) -> np.ndarray:
        """Whether a part is better cut into a left and a right half. size: (2, M) of the parts.

        Cutting x halves the second derivative in x, and what the mixed one adds to the derivative in y. Where the rays
        go many ways, that across which they turn most is cut, and where nothing else tells, the longer side.
        """
        g = np.einsum("abm,bijm->aijm", self.inverse, self.f)
        mixed = np.abs(g[:, 1:, 1:] - g[:, :-1, 1:] - g[:, 1:, :-1] + g[:, :-1, :-1]).max((1, 2))
        by_x = np.abs(g[:, 2] - 2 * g[:, 1] + g[:, 0]).max((0, 1)) + mixed[1]
        by_y = np.abs(g[:, :, 2] - 2 * g[:, :, 1] + g[:, :, 0]).max((0, 1)) + mixed[0]
        unit = np.moveaxis(self.d / np.sqrt((self.d * self.d).sum(0)), 1, 0)
        turn_x, turn_y = (
            np.max([((unit[i] - unit[j]) ** 2).sum(0) for i, j in sides], axis=0)
            for sides in (((0, 1), (2, 3)), ((0, 2), (1, 3)))
        )
        scattered = ~(self.d[2] > 0).all(0)
        by_x, by_y = np.where(scattered, turn_x, by_x), np.where(scattered, turn_y, by_y)
        told = (self.regular | scattered) & (by_x != by_y)
        return np.where(told, by_x > by_y, size[0] >= size[1])

    @property
    def at_most_one(self) -> np.ndarray:
        """Where the derivative, times its inverse in the middle, is near to one throughout, and rays go one way.

        Then Newton's iteration from anywhere inside comes nearer to the root by a third and more at each step.
        """
        g = np.einsum("abm,bijm->aijm", self.inverse, self.f)
        x = 2 * (g[:, 1:] - g[:, :-1]).reshape(2, 6, -1)
        y = 2 * (g[:, :, 1:] - g[:, :, :-1]).reshape(2, 6, -1)
        unit = np.eye(2)[:, :, None, None]
        change = np.abs(x - unit[0]).max(1) + np.abs(y - unit[1]).max(1)
        return self.regular & (change.max(0) <= 0.25) & (self.d[2] > 0).all(0) & (self.rounding.max(0) < 0.05)

    def step(self, place: np.ndarray) -> np.ndarray:
        """Newton's step (2, M) at a place (2, M) of the parts."""
        (p, px, py), (d, dx, dy) = _bilinear(self.p, place), _bilinear(self.d, place)
        f, x, y = _across(p, d), _across(px, d) + _across(p, dx), _across(py, d) + _across(p, dy)
        determinant = x[0] * y[1] - x[1] * y[0]
        return np.stack([f[0] * y[1] - f[1] * y[0], x[0] * f[1] - x[1] * f[0]]) / -determinant


def _newton(parts: _Parts, system: _System) -> Roots:
    """The roots of parts with at most one."""
    place = np.full((2, len(parts.number)), 0.5)
    for _ in range(STEPS):
        before, place = place, np.clip(place + system.step(place), 0.0, 1.0)
        if not (np.abs(place - before) > 2 * _EPS).any():
            break
    step = system.step(place)
    error = (2 * system.rounding + 8 * _EPS).max(0)
    kept = np.abs(step).max(0) <= error  # else the root lies outside
    place = (parts.low + parts.size * (place + step))[:, kept]
    return Roots(parts.number[kept], place[0], place[1], (error * parts.size.max(0))[kept] + 4 * _EPS)


def _one_sign(values: np.ndarray, doubt: np.ndarray) -> np.ndarray:
    """Whether coefficients (2, 9, M) lie to one side of zero."""
    return (values.min(1) > doubt) | (values.max(1) < -doubt)


def _across(p: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The first two components of p x d, for p and d (3, ...)."""
    return np.stack([p[1] * d[2] - p[2] * d[1], p[2] * d[0] - p[0] * d[2]])


def _bilinear(corners: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values (3, M) at places and derivatives, from those at the corners (3, 4, M)."""
    x, y = place
    upper, lower = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 2]
    left, right = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    above, below = ((1 - x) * corners[:, k] + x * corners[:, k + 1] for k in (0, 2))
    return (1 - y) * above + y * below, (1 - y) * upper + y * lower, (1 - x) * left + x * right


def _coefficients(p: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Bernstein coefficients (2, 3, 3, M), by degree in x and in y, of the first two components of p x d."""
    result = np.zeros((2, 3, 3, p.shape[-1]))
    for number in range(16):
        a, b = divmod(number, 4)
        i, j = a % 2 + b % 2, a // 2 + b // 2
        result[:, i, j] += _across(p[:, a], d[:, b]) / ((2 if i == 1 else 1) * (2 if j == 1 else 1))
    return result


def _frame(axis: np.ndarray) -> np.ndarray:
    """Two unit vectors across a unit vector (3, M), and itself, right-handed: (3, 3, M)."""
    x, y, z = axis
    sign = np.where(z >= 0, 1.0, -1.0)  # Duff et al. 2017
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.stack([[1 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], [x, y, z]])


def _halves(corners: np.ndarray, upright: np.ndarray) -> np.ndarray:
    """Corners of the first halves and then of the second ones, from those of the whole (4, 3, M); see `halves`."""
    a, b, c, d = corners
    middle = 0.5 * (a + np.where(upright, b, c)), 0.5 * (np.where(upright, c, b) + d)
    first = np.stack([a, np.where(upright, middle[0], b), np.where(upright, c, middle[0]), middle[1]])
    second = np.stack([middle[0], np.where(upright, b, middle[1]), np.where(upright, middle[1], c), d])
    return np.concatenate([first, second], -1)
