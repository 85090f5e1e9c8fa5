"""A second bend: two-bounce reflections and lenses of two faces, by camera triangles behind camera triangles.

Hou et al. 2006 leave these open (section 3.2 and the concluding remarks): rays that bend twice are no longer those of
one camera triangle. But where they meet the second surface they start anew: direct camera triangles whose vertices are
those points and whose directions are the rays bent there. Split where the second bend is curved, they are as good as
the first ones, and a third surface may follow.
"""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import is_number, shown, whole_number
from mpcam.decomposition.chained import Chained
from mpcam.decomposition.ray_error import bent, in_world
from mpcam.decomposition.reflector import Reflector, reflector_of
from mpcam.decomposition.shooting import shoot
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface

DEEPEST = 7
"""Levels at most."""
MOST = 400_000
"""Camera triangles at most."""
_STEPS = 4
"""Parts of an edge between the points where a triangle's rays are tried."""
_START = 1e-3
"""Part of the second surface's radius that rays run before they can meet it: a lens's first face may be one with it."""


def chained(
    cams: CameraTriangles,
    surface: Mesh | Surface,
    index: float | None = None,
    *,
    reflector: Mesh | Surface | None = None,
    least: int = 0,
    most: int = 4,
    tolerance: float = 2e-3,
    resolution: Any = None,
) -> Chained:
    """Camera triangles whose rays are those of `cams` after they meet, and are bent by, a second surface.

    cams: any camera triangles, also those of another `Chained`. surface: the second mirror, or the lens's other face: a
    Mesh (its shading normals count) or a Surface; it may be the one that `cams` were made from. index: None for a
    mirror, else the refractive index behind it over that before it, as the light goes: 1 / 1.5 to leave glass.
    reflector: the surface that `cams` were made from. Then rays start on it, at the points that normal shooting finds,
    instead of on the camera triangles, and splitting mends the error of the first bend too.

    least, most: how often each triangle is split in four at least, and at most (to 7). tolerance: radians that an
    interpolated ray may be turned off, and parts of the surface's radius that it may be shifted, before a triangle is
    split. Triangles that the surface's outline, or the border of total reflection, passes through are split too; what
    is left of them at last does not go on. Where neighbors are split differently, rays may differ by the tolerance
    along their common edge. resolution: pixels along the short sides; default: those of `cams`, halved at each level.
    Raises InputError where no ray meets the surface and goes on.
    """
    _check(cams, index, least, most, tolerance)
    if reflector is not None and cams.normals is None:
        raise InputError("chained: reflector= goes with camera triangles that have normals: leave it out for these")
    first = in_world(cams)
    bends = _Bends(first, None if reflector is None else reflector_of(reflector), reflector_of(surface), index)
    parent, corner, scale = np.arange(first.count), np.zeros((first.count, 2)), np.ones(first.count)
    kept: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    total = 0
    for level in range(most + 1):
        fits, meets, some = _tried(bends, parent, corner, scale, tolerance)
        if level == 0 and not some.all():  # a small surface, between the points
            rest = np.flatnonzero(~some)
            some[rest] = _rays_in(bends, parent[rest], corner[rest], scale[rest], _lattice(3 * _STEPS))[2].any(axis=1)
        # At last whatever has its corners' rays.
        done = meets if level == most else fits & (level >= least)
        kept.append((parent[done], corner[done], scale[done]))
        total += int(done.sum())
        going = some & ~done
        if level == most or not going.any():
            break
        parent, corner, scale = _split(parent[going], corner[going], scale[going])
        if total + len(parent) > MOST:
            raise InputError(
                f"chained: more than {MOST:,} camera triangles at level {level + 1}: give a larger tolerance, or "
                f"most={level}"
            )
    parent, corner, scale = (np.concatenate(values) for values in zip(*kept, strict=True))
    if len(parent) == 0:
        raise InputError(
            f"chained: none of {first.count} camera triangles has rays that meet the surface and go on: move it, or "
            "give another index"
        )
    order = np.lexsort((np.abs(scale), parent))
    return _made(bends, parent[order], corner[order], scale[order], resolution)


def _made(bends: "_Bends", parent: np.ndarray, corner: np.ndarray, scale: np.ndarray, resolution: Any) -> Chained:
    """The camera of triangles that are settled, each vertex once."""
    places, first = _corners(corner, scale), bends.first
    keys = np.concatenate([np.repeat(parent, 3)[:, None], np.rint(places.reshape(-1, 2) * 2**DEEPEST)], axis=1)
    unique, faces = np.unique(keys.astype(np.int64), axis=0, return_inverse=True)
    weights = unique[:, 1:] / 2**DEEPEST
    points, ways, _ = bends.after(unique[:, 0], weights[:, 0], weights[:, 1])
    if resolution is None:
        sides = np.broadcast_to(np.asarray(first.resolution), (first.count,))[parent]
        resolution = np.maximum(np.ceil((sides - 1) * np.abs(scale) - 1e-9).astype(int) + 1, 2)
    camera = CameraTriangles(points, faces.reshape(-1, 3), directions=ways, resolution=resolution)
    return Chained(camera, first, parent.astype(np.int32), corner, scale)


def _split(parent: np.ndarray, corner: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each triangle in four: three at its corners, one turned around in the middle."""
    half = 0.5 * scale
    shift = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
    corners = corner[:, None] + half[:, None, None] * shift
    return np.repeat(parent, 4), corners.reshape(-1, 2), (half[:, None] * [1.0, 1.0, 1.0, -1.0]).ravel()


def _corners(corner: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(N, 3, 2) weights in the parent of the corners of triangles."""
    return corner[:, None] + scale[:, None, None] * np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])


@functools.cache
def _lattice(steps: int) -> np.ndarray:
    """(K, 2) weights of corners 2 and 3 of points spread over a triangle; the corners come first."""
    i, j = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1), indexing="ij")
    inside = i + j <= steps
    points = np.stack([i[inside], j[inside]], axis=1) / steps
    ends = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    rest = points[~(points[:, None] == ends).all(axis=2).any(axis=1)]
    return np.concatenate([ends, rest])


def _rays_in(
    bends: "_Bends", parent: np.ndarray, corner: np.ndarray, scale: np.ndarray, local: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (N, K, 3), directions (N, K, 3) and validity (N, K) after both bends, at weights (K, 2) in triangles."""
    places = corner[:, None] + scale[:, None, None] * local
    found = bends.after(np.repeat(parent, len(local)), places[..., 0].ravel(), places[..., 1].ravel())
    points, ways, valid = (values.reshape(len(parent), len(local), *values.shape[1:]) for values in found)
    return points, ways, valid


def _tried(
    bends: "_Bends", parent: np.ndarray, corner: np.ndarray, scale: np.ndarray, tolerance: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which triangles (N,) give the true rays all over, which have the rays of their corners, and which any ray."""
    local = _lattice(_STEPS)
    points, ways, valid = _rays_in(bends, parent, corner, scale, local)
    mix = np.stack([1.0 - local.sum(axis=1), local[:, 0], local[:, 1]], axis=1)
    lines, along = (np.einsum("kc,ncx->nkx", mix, values[:, :3]) for values in (points, ways))
    with np.errstate(all="ignore"):
        along = along / np.linalg.norm(along, axis=-1, keepdims=True)
        angle = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(along - ways, axis=-1), 1.0))
        # Shifts along the ray change nothing.
        gap = points - lines
        gap = np.linalg.norm(gap - (gap * ways).sum(-1, keepdims=True) * ways, axis=-1) / bends.second.radius
        good = ((angle <= tolerance) & (gap <= tolerance)).all(axis=1)
    return np.asarray(good & valid.all(axis=1)), np.asarray(valid[:, :3].all(axis=1)), np.asarray(valid.any(axis=1))


@dataclass(frozen=True, eq=False)
class _Bends:
    """Rays bent by camera triangles, or where it is given by the surface behind them, and by a second surface."""

    first: CameraTriangles
    reflector: Reflector | None
    second: Reflector
    index: float | None

    def before(self, face: np.ndarray, weight2: np.ndarray, weight3: np.ndarray) -> tuple[np.ndarray, ...]:
        """Origins (N, 3), directions (N, 3) and validity (N,) between the bends, at places in camera triangles."""
        if self.reflector is None:
            origin, along, valid = self.first.ray_at(face, weight2, weight3)
            origin, along = (np.stack([np.broadcast_to(p, len(face)) for p in v], axis=1) for v in (origin, along))
            return origin, along, np.broadcast_to(valid, len(face))
        place, toward = (values.T for values in self.first.interpolated(face, weight2, weight3))
        shot = shoot(self.reflector, place, toward)
        along, valid = bent(shot.points - self.first.eye, shot.normals, self.first.index)
        return shot.points, along, valid

    def after(self, face: np.ndarray, weight2: np.ndarray, weight3: np.ndarray) -> tuple[np.ndarray, ...]:
        """Where they meet the second surface (N, 3), unit directions after it (N, 3), and whether there is one (N,)."""
        second, (origin, along, valid) = self.second, self.before(face, weight2, weight3)
        valid = valid & np.isfinite(along).all(axis=1)
        along = np.where(valid[:, None], along, (0.0, 0.0, 1.0))
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        start = origin + _START * second.radius * along
        found = second.first_hits(start, along)
        points, normals, valid = found.points, found.normals, valid & found.hit
        ways, passes = bent(along, normals, self.index)
        valid = valid & passes & np.isfinite(ways).all(axis=1) & np.isfinite(points).all(axis=1)
        return np.where(valid[:, None], points, 0.0), np.where(valid[:, None], ways, (0.0, 0.0, 1.0)), valid


def _check(cams: Any, index: Any, least: Any, most: Any, tolerance: Any) -> None:
    if not isinstance(cams, CameraTriangles):
        raise InputError(f"chained: cams is a {type(cams).__name__}: give CameraTriangles, e.g. from mpcam.decompose")
    for name, value in (("least", least), ("most", most)):
        whole_number(name, value, 0, DEEPEST, of="chained")
    if least > most:
        raise InputError(f"chained(least={least}, most={most}): least must not be above most")
    for name, value in (("tolerance", tolerance), ("index", 1.0 if index is None else index)):
        if not is_number(value) or value <= 0:
            raise InputError(f"chained({name}={shown(value)}): give a finite number above 0")
