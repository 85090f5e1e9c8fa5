"""The graph camera: a pinhole whose rays bend where they pass from one frustum into the next."""

import copy
import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from mpcam.cameras.base import Camera, components, register_pytrees
from mpcam.cameras.graph_bodies import bodies_of, tables
from mpcam.cameras.graph_checks import check_faces, check_frusta
from mpcam.cameras.graph_frusta import Frusta
from mpcam.cameras.graph_images import ROWS
from mpcam.cameras.graph_makers import GraphMakers
from mpcam.cameras.graph_numbers import Numbers, numbers_of
from mpcam.cameras.graph_portals import checked_ends, checked_portals
from mpcam.cameras.graph_search import Bodies
from mpcam.cameras.graph_tables import GraphTable
from mpcam.cameras.graph_tree import Tree, grown
from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.types import Projection, Ray, RayPieces
from mpcam.checks import shown
from mpcam.errors import InputError
from mpcam.math import Array, Vector, library
from mpcam.math.pose import as_pose


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class GraphCamera(GraphMakers, GraphTable, Camera):
    """A pinhole image of what lies behind corners: a graph of frusta with faces in common (Popescu et al. 2009).

    root: a `Pinhole`, whose rays begin all. portals: a list of `Portal`, each a face with a frustum behind it, where
    rays come from a center of its own. A ray runs straight through a frustum; where it meets a portal that leaves it,
    it goes on in the next one without a gap, so the image has no seam at the face. One portal after another bends,
    several from one frustum split it, several into one merge (then the point's image is by way of the face through
    which it is seen from the center). ends: where the root's frustum ends besides at its portals, as `Portal.ends`.

    A frustum is convex: it ends at the planes of all the portals that leave it, and at its `ends`. A ray that meets
    none of these portals ends at the first of these planes, and sees nothing behind it; in a frustum that no portal
    leaves, and without ends, it goes on for ever. No two frusta may hold the same point, so each point has one image.
    The root's frustum is as wide as the image; outside of it images of points count where no other frustum has them.

    Depth is the length along the bent ray from the root's center. `ray` gives the root's piece, `ray_pieces` all.

    camera_from_world: 4x4, where the whole stands: by default the root's pose. With another one all of it has moved
    rigidly, and root and portals are still described as before.

    Easier ways to make one: `around`, `through`. Raises InputError, with the number of the portal, for faces that are
    not planar, convex, before the next one and in the frustum that they leave; for centers that are not both before
    the face; for faces of one frustum that overlap, and frusta that do; for parents that are not there, and circles.
    """

    root: Any
    portals: Any = ()
    ends: Any = None
    camera_from_world: Any = None

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "root", _checked_root(self.root))
        set_(self, "portals", checked_portals(self.portals))
        if self.ends is not None:
            set_(self, "ends", checked_ends(self.ends, "GraphCamera: ends"))
        pose = self.root.camera_from_world if self.camera_from_world is None else self.camera_from_world
        set_(self, "camera_from_world", as_pose(pose))
        register_pytrees()
        if self._plain:
            tree = self.tree  # whose numbers the checks rely on
            check_faces(self.root, self.portals)
            check_frusta(self.root, tree, self.numbers, self.bodies)

    @property
    def width(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Columns of the root's image."""
        return self.root.width

    @property
    def height(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Rows of the root's image."""
        return self.root.height

    @property
    def pieces_per_ray(self) -> int:
        """Most straight pieces of a ray: portals on the longest way, and one more."""
        return self.tree.depth + 1

    @functools.cached_property
    def tree(self) -> Tree:
        """The frusta by the ways that lead to them."""
        return grown(self.portals)

    @functools.cached_property
    def numbers(self) -> Numbers:
        """Numbers of all frusta, in the root's frame."""
        return numbers_of(self.root, self.portals, self.ends, self.tree)

    @functools.cached_property
    def frusta(self) -> Frusta:
        """The camera's maps in the root's frame, which is the camera's."""
        return tables(self.root, self.numbers, self.tree, self.bodies if self._plain else None)

    @functools.cached_property
    def bodies(self) -> Bodies:
        """The frusta as convex bodies in the root's frame, that of the root with the sides of its image."""
        return bodies_of(self.root, self.numbers)

    @property
    def _plain(self) -> bool:
        """Whether all numbers are known, rather than traced by JAX."""
        parts = [self.root, *self.portals]
        values = [getattr(part, field.name) for part in parts for field in dataclasses.fields(part)]
        return library(*values, self.ends) == "numpy" and object not in map(type, values)

    def for_kernels(self, number: type) -> Frusta:
        """What kernels take in the camera's place; number: a Dr.Jit type."""
        return self.frusta.on_device(number)

    def with_pose(self, camera_from_world: Array) -> Self:
        """The same camera at another pose of its root; portals go with it."""
        if self._plain:
            _ = self.frusta  # for both
        moved = copy.copy(self)
        object.__setattr__(moved, "camera_from_world", as_pose(camera_from_world))
        return moved

    def _maps(self, like: Vector) -> Frusta:
        """The frusta in the library of a point or a pixel."""
        return self.frusta.on_device(type(like[0])) if library(like) == "drjit" else self.frusta

    def local_ray(self, pixel: Vector) -> Ray:
        """The root's piece of a pixel's ray, in the camera frame."""
        return self._maps(pixel).local_ray(pixel)

    def local_ray_pieces(self, pixel: Vector) -> tuple[RayPieces, ...]:
        """The pieces of a pixel's ray in the camera frame."""
        return self._maps(pixel).local_ray_pieces(pixel)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """The image of a point in the camera frame, at the length of its bent ray."""
        return self._maps(point).local_project(point)

    def local_measure(self, point: Vector) -> Projection:
        """The image of a point, with 1 / z where its ray is unbent for its depth; see `Frusta.local_measure`."""
        return self._maps(point).local_measure(point)

    def location(self, points: Array) -> Array:
        """Numbers (...) of the frusta that points (..., 3) in the world lie in, -1 where in none; 0 is the root's."""
        with np.errstate(invalid="ignore", over="ignore"):
            point = self.local(components(points, 3, "points"))
            return self._maps(point).local_frustum(point)

    @property
    def frustum_parents(self) -> np.ndarray:
        """(K,) the frustum before each, -1 before the root's; merged ones count once for each way into them."""
        return np.array(self.tree.parents)

    @property
    def frustum_portals(self) -> np.ndarray:
        """(K,) number of the portal that each frustum is entered by, -1 for the root's."""
        return np.array(self.tree.portals)

    @property
    def frustum_centers(self) -> np.ndarray:
        """(K, 3) centers in the world."""
        pose = np.asarray(self.camera_from_world)
        return (np.asarray(self.numbers.centers) - pose[:3, 3]) @ pose[:3, :3]

    @property
    def frustum_matrices(self) -> np.ndarray:
        """(K, 4, 4) from points of each frustum (x, y, z, 1) in the world to (u w, v w, 1, w): pixel, and 1 / w.

        Third over fourth is the measure of `local_measure`.
        """
        root, count = self.root, len(self.tree.parents)
        view = np.array([[root.fx, 0, root.cx, 0], [0, root.fy, root.cy, 0], [0, 0, 0, 1], [0, 0, 1, 0]])
        unbend = np.zeros((count, 4, 4))
        unbend[:, :3] = np.reshape(self.frusta.nodes, (count, ROWS, 4))[:, 2:]
        unbend[:, 3, 3] = 1.0
        return view @ unbend @ np.asarray(self.camera_from_world)

    @property
    def frustum_planes(self) -> np.ndarray:
        """(K, m, 4) planes (n, o) in the world, n . x + o <= 0 in the frustum, unit normals; the last one is repeated
        where a frustum has fewer than others. The root's are also those of its image's sides."""
        planes = [self.bodies.planes[k][self.bodies.facets(k)] for k in range(len(self.tree.parents))]
        most = max(map(len, planes))
        table = np.array([np.concatenate([some, some[-1:].repeat(most - len(some), 0)]) for some in planes])
        return table @ np.asarray(self.camera_from_world)

    def __repr__(self) -> str:
        return f"GraphCamera({self.width}x{self.height}, {len(self.portals)} portals)"


def _checked_root(root: Any) -> Pinhole:
    if isinstance(root, Mapping):
        try:
            root = Pinhole(**root)
        except TypeError as error:
            raise InputError(f"GraphCamera: root: {error}") from None
    if not isinstance(root, Pinhole):
        raise InputError(f"GraphCamera: root={shown(root)}: give an mpcam.Pinhole, from which the rays begin")
    return root
