"""How far the rays of camera triangles are from those that the true surface reflects or refracts."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.triangle_nodes import corners_only
from mpcam.checks import is_number, shown, whole_number
from mpcam.decomposition.crossing import crossing
from mpcam.decomposition.reflector import Reflector, reflector_of
from mpcam.decomposition.shooting import Locator
from mpcam.decomposition.views import SeenPoints, seen_samples
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface
from mpcam.math.optics import reflect, refract


@dataclass(frozen=True)
class RayError:
    """How far rays miss the true ones.

    rms, median, p95, max: distances between the points where the two rays cross a plane at right angles to the true
    one, `distance` scene units away from the surface. angle_rms: milliradians between them. count: rays compared.
    missed: rays that the camera triangles do not have, or that leave to the other side; they are not in the figures.
    """

    rms: float
    median: float
    p95: float
    max: float
    angle_rms: float
    count: int
    missed: int
    distance: float


def ray_error(
    cams: CameraTriangles,
    reflector: Mesh | Surface,
    eye: Any,
    *,
    samples: int = 20_000,
    distance: float | None = None,
) -> RayError:
    """Errors of the rays of camera triangles against those of the true surface.

    reflector: the Mesh (with its shading normals) or Surface that was decomposed. eye: a point (3,), then the points
    compared lie evenly over the surface that it sees; or a camera, then evenly over its pixels. Always the same ones.
    Each belongs to the point of the camera triangles that the resolve step takes for it (inverse normal shooting).
    samples: about how many. distance: of the plane where rays are compared, scene units; default: twice the radius of
    a ball around the reflector, where nearby objects are. The true ray is a reflection, or a refraction where `cams`
    has an index; total reflections are left out. Raises InputError for an eye that is not that of `cams`, one that sees
    nothing, and other values.
    """
    if not isinstance(cams, CameraTriangles):
        raise InputError(f"cams is a {type(cams).__name__}: give CameraTriangles, e.g. from mpcam.decompose")
    samples = whole_number("samples", samples, 1, 10_000_000)
    whole = reflector_of(reflector)
    far = 2.0 * whole.radius if distance is None else distance
    if not is_number(far) or far <= 0:
        raise InputError(f"distance={shown(distance)}: give a finite number above 0, in scene units")
    cams = in_world(cams)
    view = seen_samples(whole, eye, samples)
    check_eye(cams, view.eye, whole.radius)
    return error_beside(cams, whole, view, float(far))


def error_beside(cams: CameraTriangles, whole: Reflector, view: SeenPoints, far: float) -> RayError:
    """`ray_error` of camera triangles in the world beside given points, in a plane `far` scene units away."""
    index = cams.index
    true, passes = bent(view.points - view.eye, view.normals, index)
    place = Locator(cams.vertices, vertex_normals(cams, whole), cams.faces).locate(view.points, view.normals)
    origin, along, valid = cams.ray_at(place.face, place.second, place.third)
    with np.errstate(all="ignore"):
        met = crossing(origin, along, view.points.T, true.T, far)
        miss, forward, reach = np.linalg.norm(met.miss, axis=0), met.forward, met.reach
        angle = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(met.along.T - true, axis=1), 1.0))
    good = valid & (forward > 0) & (reach > 0)
    compared, missed = good & passes, int((passes & ~good).sum())
    if not compared.any():
        raise InputError(
            f"none of {int(passes.sum())} true rays has one of the camera triangles beside it: give the reflector, the "
            "eye and the index that they were made for"
        )
    miss, angle = miss[compared], angle[compared]
    return RayError(
        rms=float(np.sqrt((miss**2).mean())),
        median=float(np.median(miss)),
        p95=float(np.percentile(miss, 95)),
        max=float(miss.max()),
        angle_rms=float(1e3 * np.sqrt((angle**2).mean())),
        count=int(compared.sum()),
        missed=missed,
        distance=far,
    )


def bent(incident: np.ndarray, normals: np.ndarray, index: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (N, 3) after a mirror, or an interface, and where there is one (N,)."""
    if index is None:
        ways = reflect(incident.T, normals.T).T
        return ways / np.linalg.norm(ways, axis=1, keepdims=True), np.ones(len(ways), bool)
    ways, passes = refract(incident.T, normals.T, index)
    return ways.T, passes


def in_world(cams: CameraTriangles) -> CameraTriangles:
    """The same camera triangles at the identity pose."""
    pose = np.asarray(cams.camera_from_world)
    if np.array_equal(pose, np.eye(4)):
        return cams
    changed: dict[str, Any] = {"vertices": (cams.vertices - pose[:3, 3]) @ pose[:3, :3], "camera_from_world": None}
    for name in ("normals", "directions"):
        if getattr(cams, name) is not None:
            changed[name] = getattr(cams, name) @ pose[:3, :3]
    if cams.normals is not None:
        changed["eye"] = pose[:3, :3].T @ (cams.eye - pose[:3, 3])
    return dataclasses.replace(cams, **changed)


def check_eye(cams: CameraTriangles, eye: np.ndarray, size: float) -> None:
    """See that camera triangles in the world with normals were made for an eye (3,)."""
    if cams.normals is None:
        return
    if np.linalg.norm(cams.eye - eye) > 1e-6 * (size + np.linalg.norm(eye)):
        raise InputError(
            f"the camera triangles bend rays of an eye at {np.round(cams.eye, 6).tolist()}, and the one given is at "
            f"{np.round(eye, 6).tolist()}: give theirs, or decompose anew"
        )


def vertex_normals(cams: CameraTriangles, reflector: Reflector) -> np.ndarray:
    """(V, 3) normals that tie camera triangles in the world to the surface: their own, or the surface's beside them."""
    if cams.normals is not None:
        return cams.normals
    around = Mesh(cams.vertices, corners_only(cams.faces)).smooth_normals()
    return reflector.at(*reflector.closest(cams.vertices, around))[1]
