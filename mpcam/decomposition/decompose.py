"""From a curved mirror or lens to camera triangles (Hou et al. 2006, section 2.3)."""

import dataclasses
import warnings
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import whole_number
from mpcam.decomposition.coarse import Coarse, Coarsening
from mpcam.decomposition.continuous import continuous
from mpcam.decomposition.fewest import fewest_within, limit_of
from mpcam.decomposition.middles import in_four, quadratic
from mpcam.decomposition.reflector import Reflector, reflector_of
from mpcam.decomposition.shared_lengths import slants
from mpcam.decomposition.shooting import Locator, shoot
from mpcam.decomposition.views import SLACK, SeenPoints, on_mesh, view_of
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface

MODES = ("normals", "directions", "general_linear", "continuous")
CURVED = ("normals", "directions")
"""Those that camera triangles of degree 2 have."""
MOST = 100_000
"""Camera triangles at most."""
_GRAZING = 1e-6
"""Least part of a unit ray along the normal of its triangle's plane."""
_TRIES = 6
_INNER = np.array(
    [
        (0.9, 0.05, 0.05),
        (0.05, 0.9, 0.05),
        (0.05, 0.05, 0.9),
        (0.46, 0.46, 0.08),
        (0.46, 0.08, 0.46),
        (0.08, 0.46, 0.46),
    ]
)
"""Weights of points of a triangle where it is looked whether it is seen."""


def decompose(
    reflector: Mesh | Surface,
    eye: Any,
    triangles: int | None = None,
    *,
    resolution: Any = 64,
    index: float | None = None,
    mode: str = "normals",
    max_angle: float | None = None,
    max_error: float | None = None,
    degree: int = 1,
) -> CameraTriangles:
    """Camera triangles that stand for a reflector, or with `index` for a refractor, as an eye sees it.

    reflector: a Mesh (one without normals is taken for smooth; `Mesh.flat` makes facets) or a Surface. eye: a point
    (3,) in the world, or a camera with a common center. triangles: how many camera triangles at most, 104; those that
    the eye does not see (hidden by the reflector itself, or outside of its image) are left out and do not count. A mesh
    of fewer triangles is taken as it is, which is exact; where the shape needs more to stay whole (a closed surface has
    4, some of them seen), there are more. resolution: pixels along the short sides of each triangle in the
    atlas. index: refractive index behind the surface over that on the eye's side, None for a mirror. mode: "normals"
    bends the rays pixel by pixel; the others only at the vertices. "directions": unit directions in between (Hou et al.
    2006); "general_linear": each triangle a general linear camera in its own plane (Yu et al. 2009, section 5.2), with
    one image of a point but seams between neighbors; "continuous": rays and lengths at the vertices fitted so that each
    triangle is nearly general linear and rays are no worse than those of "directions", without a seam (see
    `decomposition.continuous`). degree: 2 for camera triangles that are curved, with a vertex more on each edge (see
    `CameraTriangles`), in modes "normals" and "directions": much nearer to the truth at as many triangles, above all
    after `mpcam.fit`.

    max_angle, max_error: in place of triangles, the fewest whose rays are off by at most so many radians, or scene
    units in a plane two radii away; root mean squares by `ray_error`, over what this eye sees.

    Vertices lie on the true surface and have its normals. Both sides of the surface count. Returns CameraTriangles in
    the world frame. Raises InputError for an eye that sees nothing of the reflector or lies on it, an error that
    100,000 triangles exceed, and for other values.
    """
    if mode not in MODES:
        raise InputError(f"mode={mode!r}: allowed are {', '.join(MODES)}")
    degree = whole_number("degree", degree, 1, 2)
    if degree > 1 and mode not in CURVED:
        raise InputError(
            f"mode={mode!r} is for flat camera triangles: with degree=2 use {' or '.join(map(repr, CURVED))}"
        )
    limit = limit_of(triangles, max_angle, max_error)
    whole = reflector_of(reflector)
    view = view_of(whole, eye)

    def cut(count: int) -> CameraTriangles:
        coarse = _seen_part(whole, view, count)
        known = {"normals": coarse.normals, "eye": view.eye, "resolution": resolution, "index": index}
        cams = CameraTriangles(coarse.vertices, coarse.faces, **known)
        if degree > 1:
            cams = quadratic(cams, None if coarse.exact else whole)
        return in_mode(cams, mode, whole, eye)

    if limit is None:
        return cut(whole_number("triangles", 104 if triangles is None else triangles, 1, MOST))
    return fewest_within(cut, limit, whole, eye, MOST)


def in_mode(cams: CameraTriangles, mode: str, whole: Reflector, eye: Any) -> CameraTriangles:
    """Camera triangles with normals, their rays as a mode says."""
    if mode == "normals":
        return cams
    direct = directions_at_vertices(cams)
    if mode == "general_linear":
        return in_own_planes(direct)
    return direct if mode == "directions" else continuous(cams, direct, whole, eye)


def directions_at_vertices(cams: CameraTriangles) -> CameraTriangles:
    """The direct camera of camera triangles with normals: rays bent at the vertices only, and interpolated between.

    Raises InputError where there are directions already, or a vertex reflects totally.
    """
    if cams.normals is None:
        raise InputError("directions_at_vertices: these camera triangles have directions already")
    ways, valid = cams.bend(cams.vertices.T, cams.normals.T)
    if not valid.all():
        raise InputError(
            f"mode='directions': light is totally reflected at {int((~valid).sum())} of {len(valid)} vertices, which "
            "then have no ray: use mode='normals', or another index"
        )
    return dataclasses.replace(cams, directions=ways.T, normals=None, eye=None, index=None)


def in_own_planes(cams: CameraTriangles) -> CameraTriangles:
    """The same rays at the vertices, each camera triangle general linear in its own plane (ray_scale "plane").

    Camera triangles whose rays do not all leave on one side of their plane, at grazing incidence, are none, and are
    left out with a warning. Raises InputError where there are no directions, or no triangle is left.
    """
    slant = slants(cams)
    kept = (slant > _GRAZING).all(axis=0) | (slant < -_GRAZING).all(axis=0)
    if not kept.any():
        raise InputError("in_own_planes: no camera triangle has rays that all leave on one side of its plane")
    if not kept.all():
        warnings.warn(
            f"{cams.count - int(kept.sum())} of {cams.count} camera triangles are left out: their rays do not "
            "all leave on one side of their plane, so that they are no general linear cameras there",
            stacklevel=3,
        )
    sides = np.asarray(cams.resolution)
    sides = sides[kept] if sides.ndim else cams.resolution
    return dataclasses.replace(cams, faces=cams.faces[kept], resolution=sides, ray_scale="plane")


def subdivided(
    cams: CameraTriangles, reflector: Mesh | Surface, levels: int = 1, resolution: Any = None
) -> CameraTriangles:
    """Each camera triangle in four, `levels` times (26, 26 x 4 and 26 x 4^2 triangles: Hou et al. 2006, Table 1).

    The new vertices, in the middle of the edges, are put on the true surface by normal shooting and have its normals,
    as long as those between their neighbors. Vertices that a fit has moved stay where they are: fit again.
    resolution: pixels along the short sides of all; default: half of what it was at each level, at least 2. Raises
    InputError for camera triangles with directions, and levels that are not whole numbers from 0 to 6.
    """
    if cams.normals is None:
        raise InputError(
            "subdivided: give camera triangles with normals, and see directions_at_vertices for the result"
        )
    levels = whole_number("levels", levels, 0, 6)
    whole = reflector_of(reflector)
    pose = np.asarray(cams.camera_from_world)
    vertices, normals = (cams.vertices - pose[:3, 3]) @ pose[:3, :3], cams.normals @ pose[:3, :3]
    faces, sides = cams.faces, np.asarray(cams.resolution)
    for _ in range(levels):
        vertices, normals, faces = in_four(whole, vertices, normals, faces)
        sides = np.maximum((np.repeat(sides, 4) if sides.ndim else sides) // 2, 2)
    return dataclasses.replace(
        cams,
        vertices=vertices @ pose[:3, :3].T + pose[:3, 3],
        normals=normals @ pose[:3, :3].T,
        faces=faces,
        resolution=sides if resolution is None else resolution,
    )


def _seen_part(reflector: Reflector, view: SeenPoints, triangles: int) -> Coarse:
    """The coarse mesh of which the eye sees at most so many triangles, as near to that as a few tries come."""
    coarsening = Coarsening(reflector, view, triangles)
    wanted, best, fewest, most = triangles, None, 0, None
    for _ in range(_TRIES):
        coarse = coarsening.mesh(wanted)
        seen = seen_triangles(reflector, coarse, view)
        part = coarse.part(seen)
        count = len(part.faces)
        if best is None or (count <= triangles) > (len(best.faces) <= triangles):
            best = part
        elif (count <= triangles) == (len(best.faces) <= triangles):
            nearer = abs(count - triangles) < abs(len(best.faces) - triangles)
            best = part if nearer else best
        # Enough: within 2 %, or nothing left to take away or to add.
        if triangles - max(triangles // 50, 1) <= count <= triangles or len(coarse.faces) > wanted or coarse.exact:
            break
        if count > triangles:
            most = wanted if most is None else min(most, wanted)
        else:
            fewest = max(fewest, wanted)
        wanted = int(np.clip(round(wanted * triangles / max(count, 1)), wanted // 4, wanted * 4))
        if most is not None and not fewest < wanted < most:
            wanted = (fewest + most) // 2
        if wanted in (fewest, most) or wanted < 1:
            break
    assert best is not None
    return best


def seen_triangles(reflector: Reflector, coarse: Coarse, view: SeenPoints) -> np.ndarray:
    """(F,) which triangles hold a point of the reflector that the eye sees."""
    place = Locator(coarse.vertices, coarse.normals, coarse.faces).locate(view.points, view.normals)
    seen = np.zeros(len(coarse.faces), bool)
    seen[place.face] = True
    if not view.whole:
        # Small ones that no sample fell on: are points of their own seen?
        left = np.flatnonzero(~seen)
        points, ways = (
            np.einsum("kc,fcx->fkx", _INNER, v[coarse.faces[left]]) for v in (coarse.vertices, coarse.normals)
        )
        shot = shoot(reflector, points.reshape(-1, 3), ways.reshape(-1, 3))
        own = on_mesh(reflector, shot.face, shot.second, shot.third)
        seen[left] = reflector.sees(view.eye, own, SLACK).reshape(len(left), len(_INNER)).any(axis=1)
    return seen
