"""Small procedural textures, (H, W, 3) float32 linear RGB, that repeat without a seam unless said otherwise."""

from functools import lru_cache

import numpy as np

from mpcam.geometry.mesh import Material
from mpcam.math.srgb import linear_from_srgb


def rgb(code: str) -> tuple[float, float, float]:
    """Linear RGB of a web color such as "#d9a066"."""
    red, green, blue = linear_from_srgb(np.array([int(code[k : k + 2], 16) / 255 for k in (1, 3, 5)]))
    return float(red), float(green), float(blue)


def textured(name: str, image: np.ndarray) -> Material:
    return Material((1.0, 1.0, 1.0), image, name)


@lru_cache
def painted(name: str, code: str) -> Material:
    return Material(rgb(code), None, name)


def noise(size: int, seed: int, roughness: float = 1.0) -> np.ndarray:
    """(size, size) smooth periodic noise, mean 0, standard deviation 1; a larger roughness has finer grain."""
    field = np.random.default_rng(seed).standard_normal((size, size))
    frequency = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.fftfreq(size)[None]) * size
    weight = np.where(frequency > 0, np.maximum(frequency, 1.0) ** (roughness - 2.0), 0.0)
    field = np.fft.ifft2(np.fft.fft2(field) * weight).real
    return field / field.std()


def _image(base, shade: np.ndarray) -> np.ndarray:
    """A color, or an image of colors, times a brightness per pixel."""
    base = np.asarray(base, dtype=np.float64)
    return np.clip(base * shade[:, :, None], 0.0, 1.0).astype(np.float32)


def plaster(code: str, seed: int, size: int = 128, contrast: float = 0.06) -> np.ndarray:
    """A rough wall, a lawn or a stone floor: one color with soft stains and fine grain."""
    return _image(rgb(code), 1 + contrast * (noise(size, seed, 0.3) + 0.7 * noise(size, seed + 1, 1.6)))


def bricks(code: str, mortar: str, seed: int, rows: int = 16, columns: int = 8, size: int = 256) -> np.ndarray:
    """Bricks in running bond, each a little different. rows must be even."""
    y, x = np.mgrid[0:size, 0:size] / size
    row = np.floor(y * rows).astype(int)
    shifted = x * columns + 0.5 * (row % 2)
    column = np.floor(shifted).astype(int) % columns
    tone = np.random.default_rng(seed).normal(1.0, 0.13, (rows, columns))[row, column]
    height, width = y * rows % 1, shifted % 1
    joint = (np.minimum(height, 1 - height) < 0.08) | (np.minimum(width, 1 - width) < 0.04)
    grain = 1 + 0.06 * noise(size, seed + 1, 1.5)
    return _image(np.where(joint[:, :, None], rgb(mortar), rgb(code)), np.where(joint, 1.0, tone) * grain)


def tiles(codes: list[str], grout: str, seed: int, count: int = 4, size: int = 256) -> np.ndarray:
    """Square tiles, count by count, in turn of the given colors along diagonals, with joints."""
    y, x = np.mgrid[0:size, 0:size] / size * count
    row, column = y.astype(int), x.astype(int)
    base = np.array([rgb(code) for code in codes])[(row + column) % len(codes)]
    tone = np.random.default_rng(seed).normal(1.0, 0.06, (count, count))[row, column]
    edge = np.minimum(np.minimum(x % 1, 1 - x % 1), np.minimum(y % 1, 1 - y % 1))
    joint = edge < 0.025
    shade = np.where(joint, 1.0, tone * (0.92 + 0.08 * np.clip(edge / 0.08, 0, 1))) * (
        1 + 0.03 * noise(size, seed, 1.2)
    )
    return _image(np.where(joint[:, :, None], rgb(grout), base), shade)


def cobbles(code: str, gap: str, seed: int, count: int = 9, size: int = 256) -> np.ndarray:
    """Rounded paving stones: a periodic Voronoi pattern."""
    rng = np.random.default_rng(seed)
    cell = np.mgrid[0:count, 0:count].transpose(1, 2, 0) + 0.5 + rng.uniform(-0.28, 0.28, (count, count, 2))
    tone = rng.normal(1.0, 0.12, (count, count))
    pixel = np.mgrid[0:size, 0:size].transpose(1, 2, 0) / size * count
    home = pixel.astype(int)
    distance, tones = [], []
    for step in np.ndindex(3, 3):
        neighbor = home + np.array(step) - 1
        wrapped = neighbor % count
        position = cell[wrapped[..., 0], wrapped[..., 1]] + neighbor - wrapped
        distance.append(np.linalg.norm(pixel - position, axis=2))
        tones.append(tone[wrapped[..., 0], wrapped[..., 1]])
    order = np.argsort(distance, axis=0)
    nearest, second = np.take_along_axis(np.array(distance), order[:2], axis=0)
    stone = np.clip((second - nearest) / 0.25, 0, 1)
    color = np.take_along_axis(np.array(tones), order[:1], axis=0)[0] * (0.55 + 0.45 * stone)
    return _image(np.where(stone[:, :, None] > 0.25, rgb(code), rgb(gap)), color)


def roof_tiles(code: str, seed: int, rows: int = 8, columns: int = 8, size: int = 128) -> np.ndarray:
    """Overlapping roof tiles: each row throws a shadow on the next. rows must be even."""
    y, x = np.mgrid[0:size, 0:size] / size
    row = np.floor(y * rows).astype(int)
    shifted = x * columns + 0.5 * (row % 2)
    tone = np.random.default_rng(seed).normal(1.0, 0.1, (rows, columns))[row, np.floor(shifted).astype(int) % columns]
    bulge = 0.75 + 0.25 * np.sin(np.pi * (shifted % 1))
    return _image(rgb(code), tone * bulge * (0.6 + 0.4 * np.clip(3 * (y * rows % 1), 0, 1)))


def planks(code: str, seed: int, count: int = 6, size: int = 128) -> np.ndarray:
    """Wooden boards side by side along u, with grain along v."""
    y, x = np.mgrid[0:size, 0:size] / size
    board = np.floor(x * count).astype(int)
    tone = np.random.default_rng(seed).normal(1.0, 0.1, count)[board]
    grain = 1 + 0.08 * np.sin(2 * np.pi * (x * 40 + 0.25 * noise(size, seed, 0.2)))
    joint = np.where(np.minimum(x * count % 1, 1 - x * count % 1) < 0.04, 0.45, 1.0)
    return _image(rgb(code), tone * grain * joint)


def window(frame: str, curtain: str | None = None, columns: int = 2, rows: int = 3) -> np.ndarray:
    """A window (not repeating): frame, glass that mirrors the sky, and perhaps curtains."""
    height, width = 96, 64
    y, x = np.mgrid[0:height, 0:width]
    u, v = (x + 0.5) / width, (y + 0.5) / height
    sky = np.array(rgb("#24384a")) + (1 - v)[:, :, None] * (np.array(rgb("#9db8c8")) - rgb("#24384a")) * 0.8
    sky = np.where(((u + 0.7 * v) % 0.9 < 0.12)[:, :, None], sky * 1.5, sky)
    if curtain is not None:
        folds = 0.75 + 0.25 * np.sin(u * 70)
        sky = np.where((np.abs(u - 0.5) > 0.22 + 0.12 * v)[:, :, None], np.array(rgb(curtain)) * folds[:, :, None], sky)
    bar_u, bar_v = u * columns % 1, v * rows % 1
    bars = (np.minimum(bar_u, 1 - bar_u) < 0.07) | (np.minimum(bar_v, 1 - bar_v) < 0.05)
    return np.clip(np.where(bars[:, :, None], rgb(frame), sky), 0, 1).astype(np.float32)


def door(code: str) -> np.ndarray:
    """A door (not repeating): six panels with bevelled edges and a handle."""
    height, width = 96, 48
    y, x = np.mgrid[0:height, 0:width]
    u, v = (x + 0.5) / width, (y + 0.5) / height
    pu, pv = u * 2 % 1, v * 3 % 1
    inside = np.minimum(np.minimum(pu, 1 - pu) / 2, np.minimum(pv, 1 - pv) / 3 * 2)
    shade = np.where(inside < 0.07, 1.0, np.where(inside < 0.11, np.where(pv > 0.5, 1.4, 0.55), 0.85))
    image = _image(rgb(code), shade)
    image[np.hypot((u - 0.9) * width, (v - 0.52) * height) < 2.5] = rgb("#d8b040")
    return image
