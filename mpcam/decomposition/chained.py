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
from mpcam.decomposition.ray_error import bent, in_world
from mpcam.decomposition.reflector import Reflector, reflector_of
from mpcam.decomposition.shooting import shoot
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh, shown
from mpcam.geometry.surfaces import Surface
from mpcam.rendering.device import types
from mpcam.rendering.exclusive import exclusive

DEEPEST = 7
"""Levels at most."""
MOST = 400_000
"""Camera triangles at most."""
_STEPS = 4
"""Parts of an edge between the points where a triangle's rays are tried."""
_START = 1e-3
"""Part of the second surface's radius that rays run before they can meet it: a lens's first face may be one with it."""


@dataclass(frozen=True, eq=False)
class Chained:
    """Camera triangles behind camera triangles.

    camera: the rays after the second surface, direct, in the world frame. first: the camera triangles before it. parent
    (N,): of the first ones, that to which each of the camera's belongs. hit (F,): first ones of which all rays go on;
    share (F,): the part of their area that does. Rays outside of it are those of `first`, unchained.
    """

    camera: CameraTriangles
    first: CameraTriangles
    parent: np.ndarray
    corner: np.ndarray
    """(N, 2) weights, of corners 2 and 3 of the parent, of corner 1 of each triangle."""
    scale: np.ndarray
    """(N,) size of each triangle along its parent's sides; below 0 where it is turned around."""

    @functools.cached_property
    def share(self) -> np.ndarray:
        """(F,) part of the area of each of the first camera triangles whose rays go on."""
        return np.bincount(self.parent, self.scale**2, minlength=self.first.count)

    @property
    def hit(self) -> np.ndarray:
        """(F,) bool, the first camera triangles of which all rays go on."""
        return self.share > 1.0 - 1e-9

    @functools.cached_property
    def _cells(self) -> tuple[np.ndarray, int]:
        """Number of the triangle in each of the smallest cells of a parent, -1 for none, and cells along a side."""
        side = round(1.0 / float(np.abs(self.scale).min()))
        table = np.full((self.first.count, side, side, 2), -1, np.int32)
        for size in np.unique(np.abs(self.scale)):
            mine = np.flatnonzero(np.abs(self.scale) == size)
            many = round(size * side)
            grown = (a.ravel() for a in np.meshgrid(np.arange(many), np.arange(many), [0, 1], indexing="ij"))
            i, j, upper = (a[None] for a in grown)
            inside = (i + j + upper < many)[0]
            i, j, upper = i[:, inside], j[:, inside], upper[:, inside]
            at = np.rint(self.corner[mine] * side).astype(int)
            turned = (self.scale[mine] < 0)[:, None]
            column = np.where(turned, at[:, :1] - 1 - i, at[:, :1] + i)
            row = np.where(turned, at[:, 1:] - 1 - j, at[:, 1:] + j)
            table[self.parent[mine, None], column, row, np.where(turned, 1 - upper, upper)] = mine[:, None]
        return table, side

    def place(self, face: Any, second: Any, third: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Triangle of `camera` (...), -1 for none, and weights of its corners 2 and 3, of places in `first`.

        face, second, third (...): camera triangles of `first`, and weights of their corners 2 and 3.
        """
        table, side = self._cells
        face, second, third = np.broadcast_arrays(face, second, third)
        x, y = (np.clip(np.asarray(w, np.float64) * side, 0.0, side) for w in (second, third))
        i, j = (np.minimum(v.astype(int), side - 1) for v in (x, y))
        upper = (x - i) + (y - j) > 1.0
        # On the border opposite to corner 1 the cell beyond is another triangle's.
        over = i + j + upper >= side
        upper = upper & ~over
        back = over & (i + j >= side)
        i, j = np.where(back & (i >= j), i - 1, i), np.where(back & (i < j), j - 1, j)
        number = table[face, np.maximum(i, 0), np.maximum(j, 0), upper.astype(int)]
        corner, scale = self.corner[number], self.scale[number]
        weights = [(w - corner[..., k]) / scale for k, w in enumerate((second, third))]
        inside = number >= 0
        return number, np.where(inside, weights[0], 0.0), np.where(inside, weights[1], 0.0)

    @functools.cached_property
    def _taps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For each pixel of the first atlas: three pixels of the camera's (M, 3), weights (M, 3), and whether (M,)."""
        atlas, own = self.first.atlas, self.camera.atlas
        face, x, y = atlas.places
        used = face >= 0
        last = np.maximum(atlas.sides[face] - 1, 1)
        number, second, third = self.place(np.where(used, face, 0), x / last, y / last)
        used = used & (number >= 0)
        number = np.where(used, number, 0)
        last = own.sides[number] - 1
        x, y = (np.clip(w * last, 0, last) for w in (second, third))
        i, j = (np.clip(np.floor(v + 1e-6), 0, last - 1).astype(int) for v in (x, y))
        i = np.minimum(i, np.maximum(last - 1 - j, 0))
        x, y = x - i, y - j
        upper = (x + y > 1 + 1e-6) & (i + j + 2 <= last)
        weights = np.where(upper[:, None], np.stack([x + y - 1, 1 - x, 1 - y], 1), np.stack([1 - x - y, x, y], 1))
        columns = i[:, None] + np.where(upper[:, None], [1, 0, 1], [0, 1, 0])
        rows = j[:, None] + np.where(upper[:, None], [1, 1, 0], [0, 0, 1])
        weights = np.where(np.abs(weights) < 1e-6, 0.0, weights)
        # A tap without weight may lie outside.
        columns, rows = np.where(weights == 0, i[:, None], columns), np.where(weights == 0, j[:, None], rows)
        sign = own.signs[number][:, None]
        u, v = (own.corners[number, k][:, None] + sign * at for k, at in enumerate((columns, rows)))
        return np.where(used[:, None], v * own.width + u, 0), weights, used

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool, pixels of the first atlas whose rays go on."""
        return self._taps[2].reshape(self.first.height, self.first.width)

    def resampled(self, image: Any) -> np.ndarray:
        """An image (h, w, ...) of the camera's atlas in the layout of the first (H, W, ...); 0 where rays do not go on.

        Linear between three pixels of the same triangle. Raises InputError for images of another size.
        """
        values = np.asarray(image)
        if values.shape[:2] != (self.camera.height, self.camera.width):
            raise InputError(
                f"the image has shape {values.shape}: give {(self.camera.height, self.camera.width)} pixels, as the "
                "chained camera has"
            )
        pixel, weights, used = self._taps
        flat = values.reshape(len(values) * values.shape[1], -1)
        mixed = sum(flat[pixel[:, k]] * weights[:, k, None] for k in range(3)) * used[:, None]
        return mixed.reshape(self.first.height, self.first.width, *values.shape[2:])

    def combined(self, first: Any, second: Any, depth: Any = None) -> np.ndarray:
        """One image in the first layout: what rays that go on see, and elsewhere what the first ones do.

        first (H, W, ...), second (h, w, ...): images of the two cameras. depth (H, W): of the scene without the second
        surface, through the first camera; what is nearer than the second surface stays in front of it.
        """
        mask = self.mask if depth is None else self.mask & ~(np.asarray(depth) < self.distance)
        before = np.asarray(first)
        return np.where(mask.reshape(mask.shape + (1,) * (before.ndim - 2)), self.resampled(second), before)

    @functools.cached_property
    def distance(self) -> np.ndarray:
        """(H, W) scene units from the first surface to the second along the first camera's rays; infinite for none."""
        rays = []
        for cams in (self.first, self.camera):
            v, u = np.indices((cams.height, cams.width)) + 0.5
            rays.append(np.asarray(cams.ray(np.stack([u, v], axis=-1)).origin))
        return np.where(self.mask, np.linalg.norm(self.resampled(rays[1]) - rays[0], axis=-1), np.inf)

    @exclusive
    def on_device(self, values: Any) -> Any:
        """As `resampled`, for a flat device array (Float or Array3f) with an entry per pixel; frozen."""
        return _mixed()(values, *self._device_taps)

    @functools.cached_property
    def _device_taps(self) -> tuple[Any, Any]:
        import drjit as dr

        t, (pixel, weights, used) = types(), self._taps
        number = [t.UInt(np.ascontiguousarray(pixel[:, k], np.uint32)) for k in range(3)]
        parts = [t.Float(np.ascontiguousarray(weights[:, k] * used, np.float32)) for k in range(3)]
        dr.make_opaque(number, parts)
        return number, parts


@functools.cache
def _mixed() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def mixed(values: Any, number: list[Any], weights: list[Any]) -> Any:
        def one(part: Any) -> Any:
            return sum(dr.gather(type(part), part, n) * w for n, w in zip(number, weights, strict=True))

        return one(values) if dr.depth_v(values) == 1 else type(values)(*(one(part) for part in values))

    return mixed


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
    is left of them at last does not go on. Where neighbours are split differently, rays may differ by the tolerance
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
        weights = np.stack([1.0 - weight2 - weight3, weight2, weight3], axis=1)[..., None]
        corners = self.first.faces[face]
        place, toward = ((weights * table[corners]).sum(1) for table in (self.first.vertices, self.first.normals))
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
        number, distance, w2, w3 = second.trace(start, along)
        valid = valid & (number >= 0)
        number, distance = np.where(valid, number, 0), np.where(valid, distance, 0.0)
        if second.surface is not None:
            points = second.surface.snap(start + distance[:, None] * along, along)
            normals = second.surface.normal_at(points)
        else:
            points, normals = _on_face(second, number, start, along, w2, w3)
        ways, passes = bent(along, normals, self.index)
        valid = valid & passes & np.isfinite(ways).all(axis=1) & np.isfinite(points).all(axis=1)
        return np.where(valid[:, None], points, 0.0), np.where(valid[:, None], ways, (0.0, 0.0, 1.0)), valid


def _on_face(
    mesh: Reflector, face: np.ndarray, origin: np.ndarray, along: np.ndarray, second: np.ndarray, third: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where rays cross the planes of faces that they hit, to double precision, and the unit shading normals there."""
    a, b, c = (mesh.vertices[mesh.faces[face, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    squared = (normal * normal).sum(axis=1)
    towards = (along * normal).sum(axis=1)
    sure = np.abs(towards) > 1e-6 * np.sqrt(squared)  # edge-on, float32's weights are as good
    reach = ((a - origin) * normal).sum(axis=1) / np.where(sure, towards, 1.0)
    points = origin + reach[:, None] * along
    w2 = (np.cross(points - a, c - a) * normal).sum(axis=1) / np.maximum(squared, 1e-300)
    w3 = (np.cross(b - a, points - a) * normal).sum(axis=1) / np.maximum(squared, 1e-300)
    flat, normals = mesh.at(face, np.where(sure, w2, second), np.where(sure, w3, third))
    return np.where(sure[:, None], points, flat), normals


def _check(cams: Any, index: Any, least: Any, most: Any, tolerance: Any) -> None:
    if not isinstance(cams, CameraTriangles):
        raise InputError(f"chained: cams is a {type(cams).__name__}: give CameraTriangles, e.g. from mpcam.decompose")
    for name, value in (("least", least), ("most", most)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 <= value <= DEEPEST:
            raise InputError(f"chained({name}={shown(value)}): give a whole number from 0 to {DEEPEST}")
    if least > most:
        raise InputError(f"chained(least={least}, most={most}): least must not be above most")
    for name, value in (("tolerance", tolerance), ("index", 1.0 if index is None else index)):
        number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
        if not number or not (np.isfinite(value) and value > 0):
            raise InputError(f"chained({name}={shown(value)}): give a finite number above 0")
