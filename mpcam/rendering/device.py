"""Meshes and cameras on the device, prepared once and kept while they are alive."""

import copy
import dataclasses
import functools
import weakref
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import HasRays, need
from mpcam.cameras.profiles import Profile
from mpcam.cameras.types import Ray
from mpcam.errors import InputError, SetupError
from mpcam.geometry.mesh import Mesh
from mpcam.math import library
from mpcam.rendering.hits import View


def types() -> Any:
    """Dr.Jit array types of the backend in force; raises SetupError with the remedy where it cannot run."""
    from mpcam_kernels import backend

    try:
        return backend.types()
    except backend.BackendError as error:
        raise SetupError(str(error)) from None


class DeviceMesh:
    """Vertices and faces in device memory.

    Vertices are kept as (v - anchor) / scale, which fills about [-1, 1], so that float32 holds a small mesh far from
    the world's origin, or a mesh of 1e-8 or 1e8 units, as well as any other.
    """

    def __init__(self, mesh: Mesh):
        t = types()
        used = mesh.corners.reshape(-1, 3)  # vertices that no face uses must not widen the range
        used = used[np.isfinite(used).all(axis=1)]
        low, high = (used.min(0), used.max(0)) if len(used) else (np.zeros(3), np.zeros(3))
        self.shape = mesh.vertices.shape
        extent = float(np.max(high - low)) / 2
        self.anchor = 0.5 * low + 0.5 * high
        self.scale = extent if extent > 0 else 1.0
        self.faces = t.UInt(np.ascontiguousarray(mesh.faces.ravel(), np.uint32))
        self.vertices = self.place(mesh.vertices)
        self.ordered: Any = None  # by who wants neighbors together

    def place(self, vertices: np.ndarray) -> Any:
        """Other positions of the same vertices, uploaded; raises InputError unless there are as many of them."""
        try:
            vertices = np.asarray(vertices, np.float64)
        except (TypeError, ValueError):
            raise InputError(f"vertices are a {type(vertices).__name__}: give numbers of shape {self.shape}") from None
        if vertices.shape != self.shape:
            raise InputError(f"vertices have shape {vertices.shape}: give {self.shape}, as the mesh has")
        with np.errstate(invalid="ignore", over="ignore"):
            flat = ((vertices - self.anchor) / self.scale).astype(np.float32).ravel()
        if flat.size == 0:
            return types().Float()
        return (
            types().Float(flat) + opaque_zero()
        )  # in Dr.Jit's own memory: frozen kernels are particular about alignment

    def rays(self, rays: Ray) -> tuple[Any, Any, Any]:
        """World rays (N, 3) in the mesh's frame: world axes, from the anchor, in units of the scale."""
        t = types()
        origin = (np.asarray(rays.origin, np.float64) - self.anchor) / self.scale
        origin, along = (np.ascontiguousarray(x.T, np.float32) for x in (origin, np.asarray(rays.direction)))
        return t.Array3f(origin), t.Array3f(along), t.Bool(np.ascontiguousarray(rays.valid))

    def view(self, origin: Any, direction: Any, valid: Any) -> View:
        """Rays of the mesh's frame, one per pixel, as what hits were found with: in scene units, from the anchor."""
        import drjit as dr

        pose = np.eye(4)
        pose[:3, 3] = -self.anchor
        ray = Ray(origin * opaque_numbers([self.scale])[0], direction, valid)
        dr.eval(*ray)  # of a named tuple it would do nothing
        return View(pose, ray)

    def pose(self, frame_from_world: Any) -> list[Any]:
        """Rotation (9) and shift (3) from device vertices to a frame in units of `scale`, opaque.

        frame_from_world: 4x4, rigid, scene units.
        """
        matrix = np.asarray(frame_from_world, np.float64)
        shift = (matrix[:3, :3] @ self.anchor + matrix[:3, 3]) / self.scale
        return opaque_numbers([*matrix[:3, :3].ravel(), *shift])


def opaque_numbers(numbers: list[Any]) -> list[Any]:
    """Numbers as one-element device arrays, so that kernels do not change when they do."""
    import drjit as dr

    t = types()
    table = t.Float(np.array(numbers, np.float32))
    values = [dr.gather(t.Float, table, t.UInt(i)) for i in range(len(numbers))]
    dr.eval(values)
    return values


@functools.cache
def opaque_zero() -> Any:
    """Zero on the device, which no compiler can leave out."""
    return opaque_numbers([0.0])[0]


_meshes: weakref.WeakKeyDictionary[Mesh, DeviceMesh] = weakref.WeakKeyDictionary()


def device_mesh(mesh: Mesh) -> DeviceMesh:
    """The mesh on the device; uploaded at the first call."""
    if not isinstance(mesh, Mesh):
        raise InputError(
            f"a mpcam.Mesh is needed, got {type(mesh).__name__}: see mpcam.load_mesh and mpcam.builtin_mesh"
        )
    found = _meshes.get(mesh)
    if found is None:
        found = DeviceMesh(mesh)
        _meshes[mesh] = found
    return found


def lens_key(camera: Camera) -> tuple[Any, ...]:
    """What decides a camera's rays in its own frame: everything but the pose."""
    names = [field.name for field in dataclasses.fields(camera)]  # pyright: ignore[reportArgumentType]
    values = ((name, getattr(camera, name)) for name in names if name != "camera_from_world")
    return (type(camera), *(_plain(v) for _, v in values))


def _plain(value: Any) -> Any:
    """Numbers of any library, tables and tuples of them in a hashable form, the same for the same ones."""
    if isinstance(value, tuple):
        return tuple(_plain(v) for v in value)
    if value is None or isinstance(value, (str, int, Profile)):
        return value
    return _Table(value) if np.ndim(value) > 0 else float(value)


class _Table:
    """A large array, told apart by which object it is, small ones by what they hold: cameras are not changed."""

    def __init__(self, value: Any):
        self.value = value
        table = np.asarray(value)
        self._key = id(value) if table.nbytes > 4096 else (table.shape, table.dtype.str, table.tobytes())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Table) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


def device_lens(camera: Camera) -> Camera:
    """The camera at the identity pose with its numbers on the device, for use inside of kernels."""
    lens = copy.copy(camera)
    object.__setattr__(lens, "camera_from_world", None)
    names = [field.name for field in dataclasses.fields(camera)]  # pyright: ignore[reportArgumentType]
    values = {n: getattr(camera, n) for n in names if n not in (*camera.static_fields, "camera_from_world")}
    numbers = [float(v) for value in values.values() for v in (value if isinstance(value, tuple) else (value,))]
    on_device = iter(opaque_numbers(numbers))
    for name, value in values.items():
        several = isinstance(value, tuple)
        object.__setattr__(lens, name, tuple(next(on_device) for _ in value) if several else next(on_device))
    return lens


def _check_profile(profile: Any) -> None:
    """See that a user's profile runs on Dr.Jit arrays: inside a kernel's recording it is too late to say so."""
    if not isinstance(profile, Profile):
        return
    theta, problem = types().Float([0.1, 0.2]), ""
    for name in ("radius", "slope", "angle"):
        try:
            result = getattr(profile, name)(theta)
        except (TypeError, ValueError, AttributeError, RuntimeError) as error:
            problem = f"{name} fails: {error}"
        else:
            problem = problem or ("" if library(result) == "drjit" else f"{name} gives a {type(result).__name__}")
        if problem:
            text = " ".join(problem.split())
            raise InputError(
                f"profile {profile.name!r} does not run on Dr.Jit arrays ({text}): use mpcam.math functions"
            )


class Lens:
    """Rays and kernels' view of a camera, which hold for every pose of it.

    ray: of each pixel, row by row, on the device, in the camera's frame, from `anchor` (3,), a point of that frame.
    kept: what others make of the rays.
    """

    def __init__(self, camera: Camera):
        _check_profile(getattr(camera, "profile", None))
        self.size: tuple[int, int] = (camera.width, camera.height)
        self.kept: dict[Any, Any] = {}
        plain = camera.ray_geometry != "general"  # others may hold tables
        self.on_device = device_lens(camera) if plain else camera
        self.central = camera.ray_geometry == "central"
        self.ray, self.anchor = pixel_rays(self.on_device)

    @functools.cached_property
    def has_center(self) -> bool:
        """Whether all rays leave from the anchor."""
        import drjit as dr

        away: Any = dr.any(self.ray.valid & (dr.squared_norm(self.ray.origin) > 0))
        return self.central or not away[0]

    @functools.cached_property
    def directions(self) -> Any:
        """Samples of a central camera."""
        from mpcam_kernels import samples

        return samples.central_samples(types(), self.ray.direction, self.ray.valid, *self.size)

    @functools.cached_property
    def centres(self) -> Any:
        """Samples of the image plane, for straight-edged triangles."""
        from mpcam_kernels import samples

        return samples.planar_samples(types(), self.ray.valid, *self.size)


def pixel_rays(camera: Camera) -> tuple[Ray, np.ndarray]:
    """Rays of all pixels, row by row, on the device, and the point of the camera's frame (3,) from which origins count.

    Raises InputError where the camera's `local_ray` gives them neither for Dr.Jit nor for NumPy arrays.
    """
    import drjit as dr

    from mpcam_kernels import samples

    local_ray, t = need(camera, HasRays, "a frame").local_ray, types()
    centres = samples.pixel_centres(t, camera.width, camera.height)
    try:
        ray = local_ray(centres)
    except (TypeError, ValueError, AttributeError, RuntimeError, InputError):
        ray = None
    numbers = () if ray is None else (*ray.origin, *ray.direction, ray.valid)
    if ray is not None and all(library(number) == "drjit" or np.ndim(number) == 0 for number in numbers):
        ray, anchor = Ray(t.Array3f(*numbers[:3]), t.Array3f(*numbers[3:6]), t.Bool(ray.valid)), np.zeros(3)
        if camera.ray_geometry == "general":
            ray, anchor = _anchored(ray)
    else:  # written for NumPy alone
        ray, anchor = _uploaded(local_ray(np.asarray(centres.numpy(), np.float64)), camera)
    dr.eval(*ray)  # of a named tuple it would do nothing
    return ray, anchor


def _anchored(ray: Ray) -> tuple[Ray, np.ndarray]:
    """Rays around the middle of their origins, on the device."""
    import drjit as dr

    usable = ray.valid & dr.isfinite(ray.origin.x + ray.origin.y + ray.origin.z)
    ends = [dr.min(dr.select(usable, part, dr.inf)) for part in ray.origin]
    ends += [dr.max(dr.select(usable, part, -dr.inf)) for part in ray.origin]
    low, high = np.array([end[0] for end in ends], np.float64).reshape(2, 3)
    if not (low <= high).all():
        return ray, np.zeros(3)
    anchor = (0.5 * low + 0.5 * high).astype(np.float32).astype(np.float64)
    return ray._replace(origin=dr.select(usable, ray.origin - types().Array3f(*anchor.tolist()), 0)), anchor


def _uploaded(ray: Ray, camera: Camera) -> tuple[Ray, np.ndarray]:
    """Rays of NumPy arrays, components first, on the device, around the middle of their origins."""
    count, t = camera.width * camera.height, types()
    try:
        origin, direction = (
            np.stack([np.broadcast_to(np.asarray(part, np.float64), count) for part in parts])
            for parts in (ray.origin, ray.direction)
        )
        valid = np.broadcast_to(np.asarray(ray.valid, bool), count)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{type(camera).__name__}.local_ray gives no rays of {count} pixels ({error}): return mpcam.Ray(origin, "
            "direction, valid), vectors with their components first"
        ) from None
    valid = valid & np.isfinite(origin).all(0) & np.isfinite(direction).all(0)
    some = origin[:, valid]
    anchor = 0.5 * some.min(axis=1) + 0.5 * some.max(axis=1) if valid.any() else np.zeros(3)
    parts = (np.where(valid, origin - anchor[:, None], 0.0), np.where(valid, direction, 0.0))
    origin, direction = (t.Array3f(np.ascontiguousarray(part, np.float32)) + opaque_zero() for part in parts)
    return Ray(origin, direction, t.Bool(np.ascontiguousarray(valid)) & (opaque_zero() == 0)), anchor


@functools.lru_cache(maxsize=16)
def _lens(key: tuple[Any, ...], backend: str, holder: "_Held") -> Lens:
    return Lens(holder.camera)


class _Held:
    """Carries a camera past the cache's key: all holders are equal."""

    def __init__(self, camera: Camera):
        self.camera = camera

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Held)

    def __hash__(self) -> int:
        return 0


def lens(camera: Camera) -> Lens:
    """Rays of a camera's pixels on the device; the sixteen used last are kept."""
    from mpcam_kernels.backend import backend_name

    return _lens(lens_key(camera), backend_name(), _Held(camera))


def to_camera(pose: list[Any], vertices: Any, count: Any) -> Any:
    """Device vertices numbered by `count` in the camera frame, in units of the mesh's scale."""
    import drjit as dr

    from mpcam_kernels.poses import placed

    return placed(types(), pose, dr.gather(types().Array3f, vertices, count))
