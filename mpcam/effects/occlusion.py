"""How much of what a surface element sees is covered: form factors and ambient occlusion, by counting pixels.

Each element is the eye of a view of 180 degrees along its normal (Gascuel et al. 2008, Table 1). In the cosine-sphere
projection the area that a mesh covers is its solid angle times the cosine, so the share of the disc is the form factor
from the element to the mesh. In the equal-area projection it is the share of the hemisphere's solid angle.
"""

from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.radial import Radial
from mpcam.checks import is_number, whole_number
from mpcam.effects.lookup import LEAST
from mpcam.effects.vectors import as_vectors
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.methods import prepare
from mpcam.scene.scene import Scene

WEIGHTS = {"cosine": "cosine_sphere", "uniform": "equisolid"}
OFFSET = 1e-5  # of half the longest side of the mesh: some thirty times what float32 loses
MOST = 4096  # pixels along a side
# The grid of pixels must not line up with what is seen, or whole edges fall between two rows of centers: the disc's
# center lies off the grid, and the grid is turned to a slope of the golden ratio.
CENTRE = (0.17, -0.31)  # pixels from the middle of the image
ROLL = (0.8506508083520400, 0.5257311121191336)


def form_factor(
    mesh: Any, points: Any, normals: Any, size: int = 64, *, weight: str = "cosine", offset: float | None = None
) -> np.ndarray:
    """Share of what surface elements see that is covered by a mesh: (...) float64, from 0 to 1.

    mesh: a Mesh, a Scene or several meshes. points, normals (..., 3): of the elements, world; normals point to the side
    that looks, with any length above 0. size: pixels along a side of each element's view, 8 to 4096. weight: "cosine"
    (the form factor of radiosity: the share of the irradiance from all sides) or "uniform" (the share of the
    hemisphere's solid angle). offset: scene units by which each point is moved along its normal, so that an element of
    the mesh does not see its own face; by default 1e-5 of half the longest side of the mesh. Raises InputError.
    """
    size, kind = _check_view(size, weight)
    eyes, along = as_vectors(points, "points"), as_vectors(normals, "normals", unit=True)
    if along.shape != eyes.shape:
        raise InputError(f"normals have shape {along.shape} and points {eyes.shape}: give a normal for each point")
    whole = mesh if isinstance(mesh, Mesh) else Scene.of(mesh).mesh
    if whole.triangle_count == 0 or eyes.size == 0:
        return np.zeros(eyes.shape[:-1])
    if offset is None:
        offset = OFFSET * 0.5 * float((whole.bounds[1] - whole.bounds[0]).max())
    elif not is_number(offset):
        raise InputError(f"offset={offset!r}: a finite length in scene units is needed")
    center = [0.5 * size + shift for shift in CENTRE]
    camera = Radial(size, size, kind, radius=0.5 * size - 0.5, cx=center[0], cy=center[1])
    counts = _covered(camera, whole, (eyes + offset * along).reshape(-1, 3), along.reshape(-1, 3))
    return counts.reshape(eyes.shape[:-1])


def ambient_occlusion(
    mesh: Any, points: Any, normals: Any, size: int = 64, weight: str = "cosine", *, offset: float | None = None
) -> np.ndarray:
    """Share of what surface elements see that is open: (...) float64, 1 under a free sky, 0 in a closed box.

    weight: "cosine" (light from everywhere, by Lambert's law) or "uniform" (solid angle). mesh, points, normals, size
    and offset: see `form_factor`. Raises InputError.
    """
    return 1.0 - form_factor(mesh, points, normals, size, weight=weight, offset=offset)


def _check_view(size: Any, weight: Any) -> tuple[int, str]:
    if weight not in WEIGHTS:
        raise InputError(f"weight={weight!r}: allowed are {', '.join(WEIGHTS)}")
    return whole_number("size", size, LEAST, MOST, unit="pixels"), WEIGHTS[weight]


@exclusive
def _covered(camera: Radial, mesh: Mesh, eyes: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Share of the camera's valid pixels that see the mesh, for each eye (N, 3) and unit normal (N, 3).

    One prepared camera is moved: of what it keeps, only the pose changes. Counts stay on the device until the last.
    """
    import drjit as dr

    t = types()
    prepared: Any = prepare(camera, mesh, output="coverage")
    turns = facing(normals)
    shifts = np.einsum("nij,nj->ni", turns, (prepared.device.anchor - eyes) / prepared.device.scale)
    poses = np.concatenate([turns.reshape(-1, 9), shifts], axis=1)
    totals = dr.zeros(t.UInt, len(eyes))
    for number, pose in enumerate(poses):
        prepared.pose = opaque_numbers(list(pose))
        seen = dr.select(prepared.frame().device_mask, t.UInt(1), 0)
        dr.scatter_reduce(dr.ReduceOp.Add, totals, seen, dr.opaque(t.UInt, number))
        dr.eval(totals)
    valid: Any = dr.count(device_camera(camera).ray.valid)
    return np.asarray(totals.numpy(), np.float64) / max(int(valid[0]), 1)


def facing(normals: np.ndarray) -> np.ndarray:
    """(N, 3, 3) rotations from the world to cameras that look along unit normals (N, 3); rows right, down, forward.

    Continuous but for normals along -z (Duff et al. 2017, Building an orthonormal basis, revisited).
    """
    x, y, z = normals.T
    sign = np.where(z >= 0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    right = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], -1)
    down = np.stack([b, sign + y * y * a, -y], -1)
    return np.stack([ROLL[0] * right + ROLL[1] * down, ROLL[0] * down - ROLL[1] * right, normals], 1)
