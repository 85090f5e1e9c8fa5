"""Photons of a point light on a curved mirror or lens: where each pixel of the light's view goes, with what flux."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.radial import Radial
from mpcam.decomposition.chained import Chained
from mpcam.decomposition.ray_error import bent, vertex_normals
from mpcam.decomposition.reflector import Reflector, pixel_hits
from mpcam.decomposition.resolve import texel_weights
from mpcam.decomposition.shooting import Locator
from mpcam.math.pose import look_at
from mpcam.rendering.device import DeviceMesh

MARGIN = 1.0
"""Pixels that the light's view leaves free around the reflector."""
WIDE = np.radians(65.0)
"""Half angle from which the light's view is no longer a pinhole."""
_FAR = 0.05
"""Part of the radius that the camera triangles may be away from the reflector."""
_OFF = 1e-3
"""Part of the radius that a reflected ray runs before it may meet the reflector again."""


@dataclass(frozen=True, eq=False)
class Photons:
    """One photon per pixel of the light's view; arrays (P, P), those of vectors (P, P, 3), world frame.

    camera: the light's view. mask: pixels of the reflector whose light goes on. solid_angle: steradians of each pixel.
    share: what the bends leave of the light, 0 to 1 (0 outside of the mask). reach: distance from the light to the
    reflector, 0 beside it. origin, direction: of the ray that goes on, by the camera triangles. texels (P, P, 4): the
    pixels of their atlas around it, by number, the nearest first; -1 for none. lost: part of the light that goes on for
    which the camera triangles have no ray.
    """

    camera: Camera
    mask: np.ndarray
    solid_angle: np.ndarray
    share: np.ndarray
    reach: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    texels: np.ndarray
    lost: float

    @property
    def flux(self) -> np.ndarray:
        """(P, P) of each photon, for a light of intensity 1."""
        return self.solid_angle * self.share

    def on_device(self, device: DeviceMesh, count: int) -> dict[str, Any]:
        """The photons in the frame of the receivers' device mesh, and how many faces that has."""
        import drjit as dr

        t, zero = types(), opaque_zero()
        start = (self.origin - device.anchor) / device.scale

        def columns(vectors: np.ndarray) -> Any:
            return t.Array3f(np.ascontiguousarray(vectors.reshape(-1, 3).T, np.float32)) + zero

        rays = {
            "texels": [t.Int(aligned(self.texels[..., k], np.int32)) + t.Int(zero) for k in range(4)],
            "flux": t.Float(aligned(self.flux)) + zero,
            "reach": t.Float(aligned(self.reach)) + zero,
            "origin": columns(start),
            "along": columns(self.direction),
            "unit": opaque_numbers([device.scale])[0],
            "count": t.Int(opaque_numbers([count])[0]),
        }
        dr.eval(rays)
        return rays


def photons(
    light: np.ndarray,
    reflector: Reflector,
    cams: CameraTriangles,
    size: int,
    behind: tuple[Chained, Reflector] | None = None,
    fresnel: bool = True,
) -> Photons:
    """The photons of a light at a point (3,), through camera triangles with normals, which have it as their eye.

    size: pixels along a side of the light's view. behind: camera triangles chained behind them, and the surface there.
    fresnel: whether refraction loses what an interface reflects.
    """
    view = light_camera(light, reflector, size)
    found = pixel_hits(view, reflector)
    mask = found.hit.reshape(view.height, view.width)
    points, normals = found.points[found.hit], found.normals[found.hit]
    incident = points - light
    reach = np.linalg.norm(incident, axis=1)
    true, passes = bent(incident, normals, cams.index)
    share = np.where(passes, 1.0, 0.0)
    index = None if cams.index is None else float(cams.index)
    if index is None:
        # Light that meets the mirror again is not followed further.
        again = reflector.first_hits(points + _OFF * reflector.radius * true, true).hit
        share[again] = 0.0
    elif fresnel:
        share *= transmitted(np.abs((incident * normals).sum(1)) / reach, index)
    place = Locator(cams.vertices, vertex_normals(cams, reflector), cams.faces).locate(points, normals)
    # A camera triangle far away is that of another part, which the light did not reach when they were made.
    gap = np.stack(cams.ray_at(place.face, place.second, place.third)[0], axis=1) - points
    covered = place.inside | (np.linalg.norm(gap, axis=1) < _FAR * reflector.radius)
    last, face, second, third = cams, place.face, place.second, place.third
    if behind is not None:
        chain, back = behind
        last = chain.camera
        face, second, third = chain.place(face, second, third)
        covered &= face >= 0
        face = np.maximum(face, 0)
        if fresnel and index is not None:
            share *= _leaving(back, points, true, 1.0 / index)
    origin, along, valid = (np.asarray(values) for values in last.ray_at(face, second, third))
    good = valid & np.isfinite(along).all(axis=0) & (share > 0) & covered
    along = np.where(good, along, np.array([0.0, 0.0, 1.0])[:, None])
    along = along / np.linalg.norm(along, axis=0)
    texels = _texels(last, face, second, third)

    def spread(values: np.ndarray, rest: float) -> np.ndarray:
        whole = np.full((*mask.shape, *values.shape[1:]), rest, values.dtype)
        whole[mask] = values
        return whole

    angles = pixel_solid_angles(view)
    going = angles[mask] * share
    return Photons(
        view,
        spread(good, 0),
        angles,
        spread(np.where(good, share, 0.0), 0.0),
        spread(reach, 0.0),
        spread(origin.T, 0.0),
        spread(along.T, 0.0),
        spread(np.where(good[:, None], texels, -1), -1),
        1.0 - float(going[good].sum()) / max(float(going.sum()), 1e-300),
    )


def _texels(cams: CameraTriangles, face: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """(N, 4) numbers of the atlas pixels around places in camera triangles, the nearest first."""
    atlas = cams.atlas
    side, sign = atlas.sides[face], atlas.signs[face].astype(np.int64)
    nearest = texel_weights(second, third, side, "nearest")[:2]
    column, row, _ = texel_weights(second, third, side, "linear")
    around = [nearest, *((column + i, row + j) for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)))]
    numbers = []
    for x, y in around:
        beyond = x + y > side - 1
        x, y = np.where(beyond, nearest[0], x), np.where(beyond, nearest[1], y)
        numbers.append((atlas.corners[face, 1] + sign * y) * atlas.width + atlas.corners[face, 0] + sign * x)
    first, *rest = numbers
    # One of the four is the nearest itself.
    rest = np.stack(rest, axis=1)
    order = np.argsort(rest != first[:, None], axis=1, kind="stable")
    return np.take_along_axis(rest, order, axis=1)


def light_camera(light: np.ndarray, reflector: Reflector, size: int) -> Camera:
    """A camera at a point (3,) whose square image the reflector fills: a pinhole, or if wide an equal-area view."""
    ways = reflector.vertices[np.unique(reflector.faces[reflector.usable])] - light
    ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-300)
    axis = ways.mean(axis=0)
    axis = axis / np.linalg.norm(axis) if np.linalg.norm(axis) > 1e-6 else np.array([0.0, 0.0, 1.0])
    half = float(np.arccos(np.clip((ways @ axis).min(), -1.0, 1.0)))
    pose = look_at((0.0, 0.0, 0.0), axis)
    pose[:3, 3] = -pose[:3, :3] @ light
    room = size - 2 * MARGIN
    if half < WIDE:
        x, y, z = (ways @ pose[:3, :3].T).T
        low, high = np.array([(x / z).min(), (y / z).min()]), np.array([(x / z).max(), (y / z).max()])
        # A reflector seen edge-on still has a view.
        spread = np.maximum(high - low, 1e-3 * max(float((high - low).max()), 1e-6))
        focal = room / spread
        center = 0.5 * size - focal * 0.5 * (low + high)
        return Pinhole(size, size, focal[0], focal[1], center[0], center[1], camera_from_world=pose)
    # Triangles between the vertices bulge out of their hull on the sphere by less than this.
    fov = min(2.0 * half * (1.0 + 4.0 * MARGIN / size), 2 * np.pi)
    return Radial.equisolid(size, size, pose, fov=fov, radius=0.5 * room)


def solid_angle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Steradians (...) of triangles with the unit directions a, b, c (..., 3) (Van Oosterom and Strackee 1983)."""
    volume = np.abs((a * np.cross(b, c)).sum(-1))
    return 2.0 * np.arctan2(volume, 1.0 + (a * b).sum(-1) + (b * c).sum(-1) + (c * a).sum(-1))


def pixel_solid_angles(camera: Camera) -> np.ndarray:
    """(H, W) steradians of the pixels of a camera with a common center; 0 where a corner has no ray.

    Each pixel is the two triangles of its corners' rays: exact for a pinhole, and without gaps for any camera.
    """
    v, u = np.indices((camera.height + 1, camera.width + 1)).astype(np.float64)
    ray = camera.ray(np.stack([u, v], axis=-1))
    way, valid = np.asarray(ray.direction), np.asarray(ray.valid)
    a, b, c, d = way[:-1, :-1], way[:-1, 1:], way[1:, 1:], way[1:, :-1]
    whole = valid[:-1, :-1] & valid[:-1, 1:] & valid[1:, 1:] & valid[1:, :-1]
    return np.where(whole, solid_angle(a, b, c) + solid_angle(a, c, d), 0.0)


def transmitted(cosine: np.ndarray, index: float) -> np.ndarray:
    """Part (...) of unpolarized light that goes through an interface (Fresnel); 0 at total reflection.

    cosine: of the angle of incidence, 0 to 1. index: refractive index behind the interface over that in front of it.
    """
    cosine = np.clip(cosine, 0.0, 1.0)
    under = 1.0 - (1.0 - cosine**2) / index**2
    behind = np.sqrt(np.maximum(under, 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        across = (cosine - index * behind) / (cosine + index * behind)
        along = (index * cosine - behind) / (index * cosine + behind)
        through = 1.0 - 0.5 * (across**2 + along**2)
    return np.where((under >= 0) & np.isfinite(through), through, 0.0)


def _leaving(back: Reflector, points: np.ndarray, ways: np.ndarray, index: float) -> np.ndarray:
    """Part (N,) of the light of rays that goes out through the back of a lens."""
    found = back.first_hits(points + _OFF * back.radius * ways, ways)
    cosine = np.abs((ways * found.normals).sum(1))
    return np.where(found.hit, transmitted(np.where(found.hit, cosine, 0.0), index), 0.0)
