"""What a graph camera refuses: faces and centers that would let images overlap, or rays run backwards."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from mpcam.cameras.graph_numbers import Numbers
from mpcam.cameras.graph_portals import Portal
from mpcam.cameras.graph_search import Bodies, overlap
from mpcam.cameras.graph_tree import Tree, owner
from mpcam.errors import InputError
from mpcam.math.pose import frame_origin

_FLAT = 1e-6  # of a face's size, by which its corners may lie off their plane
_NEAR = 1e-9  # of the distances in play: places that count as the same


def check_faces(root: Any, portals: Sequence[Portal]) -> None:
    """Raises InputError unless every polygon is planar, convex, and has an area, with both centers on one side."""
    eye = frame_origin(root.camera_from_world)
    for number, portal in enumerate(portals):
        corners = np.asarray(portal.polygon)
        place = corners.mean(axis=0)
        normal = _check_polygon(number, corners - place)
        before = "the root" if portal.parent < 0 else f"portal {owner(portals, portal.parent)}"
        from_ = eye if portal.parent < 0 else np.asarray(portals[owner(portals, portal.parent)].center)
        center = np.asarray(portals[owner(portals, number)].center)
        sizes = [float(np.abs([*(corners - place), end - place]).max()) for end in (center, from_)]
        off = [float((end - place) @ normal) for end in (center, from_)]
        for distance, size, what in zip(off, sizes, ("its center", f"the center of {before}"), strict=True):
            if abs(distance) <= _NEAR * size:
                raise _refused(number, f"{what} lies in the plane of the face", "move it away from the plane")
        if off[0] * off[1] < 0:
            reason = f"its center and that of {before} lie on different sides of the face, so rays would run backwards"
            raise _refused(number, reason, "put both on the side that rays come from")


def _check_polygon(number: int, corners: np.ndarray) -> np.ndarray:
    """The unit normal of a face whose corners are given from their mean."""
    size = np.abs(corners).max()
    steps = np.roll(corners, -1, axis=0) - corners
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    area = np.linalg.norm(normal)
    if not area > _NEAR * size * size or not np.linalg.norm(steps, axis=1).min() > _NEAR * size:
        raise _refused(number, "its corners lie on one line, or two are the same", "give a face with an area")
    normal /= area
    off = np.abs(corners @ normal)
    if off.max() > _FLAT * size:
        reason = f"corner {int(off.argmax())} lies {off.max():.3g} off the plane of the face"
        raise _refused(number, reason, "give corners in one plane")
    turns = np.cross(steps[:, None], corners[None] - corners[:, None]) @ normal
    if (turns < -_NEAR * size * size).any():
        raise _refused(number, "its polygon is not convex", "give corners in order around it, or two portals for it")
    return normal


def check_frusta(root: Any, tree: Tree, numbers: Numbers, bodies: Bodies) -> None:
    """Raises InputError for faces and frusta that do not go together."""
    for number in range(1, len(tree.parents)):
        _check_face(tree, numbers, number)
    for number in range(len(tree.parents)):
        _check_siblings(tree, numbers, tree.children(number))
    found = overlap(bodies)
    if found is not None:
        first, second, point = found
        pose = np.asarray(root.camera_from_world)
        x, y, z = (point - pose[:3, 3]) @ pose[:3, :3]
        raise InputError(
            f"GraphCamera: {_frustum(tree, first)} and {_frustum(tree, second)} overlap, at ({x:.4g}, {y:.4g}, "
            f"{z:.4g}) for instance, which would have two images: end one of them before with ends=, or move a center"
        )


def _check_face(tree: Tree, numbers: Numbers, number: int) -> None:
    """The face lies in the frustum that it leaves, and in the one that it enters."""
    portal, parent = tree.portals[number], tree.parents[number]
    face, name = numbers.corners[number], _name(tree, parent)
    slack = _NEAR * max(np.abs(face).max(), np.abs(numbers.centers[[number, parent]]).max())
    children = tree.children(parent)
    exits, inner = numbers.exits(parent), numbers.planes(parent)[numbers.ends[parent] :]
    if parent == 0 and not (face[:, 2] > 0).all():
        raise _refused(portal, "a corner lies behind the root, or in its plane z = 0", "give corners in front of it")
    if parent > 0 and _outside(inner[0], face) > slack:
        raise _refused(portal, f"a corner lies before the face of {name}", "move it behind that face")
    if parent > 0 and _outside(numbers.faces[number], numbers.corners[parent]) > slack:
        raise _refused(portal, f"its plane cuts the face of {name}", "turn it, or move it farther behind that face")
    for sibling in children:
        if sibling != number and _outside(numbers.faces[sibling], face) > slack:
            other = tree.portals[sibling]
            reason = f"a corner lies behind the plane of portal {other}, where {_frustum(tree, parent)} ends"
            raise _refused(portal, reason, f"give parent={other}, or move one of them")
    if any(_outside(plane, face) > slack for plane in exits[len(children) :]):
        raise _refused(portal, f"a corner lies outside of the ends of {name}", "move the corner, or the ends")
    merged = parent > 0 and tree.owners.count(tree.owners[parent]) > 1  # then what no ray reaches is left out
    if not merged and any(_outside(side, face) > slack for side in inner[1:]):
        mend = f"make the face smaller, or move the center of {name} so that its rays reach all of it"
        raise _refused(portal, f"a corner lies outside of the rays of {name}", mend)
    if any(_outside(plane, face) > slack for plane in numbers.exits(number)[len(tree.children(number)) :]):
        raise _refused(portal, "its face lies outside of its own ends", "move the face, or the ends")


def _check_siblings(tree: Tree, numbers: Numbers, children: list[int]) -> None:
    """Faces that leave one frustum do not overlap in its image."""
    images = {child: _straight(tree, numbers, child) for child in children}
    for first, second in itertools.combinations(children, 2):
        apart = any(
            (images[other] @ edge).max() <= _NEAR * np.abs(images[other]).max()
            for mine, other in ((first, second), (second, first))
            for edge in numbers.images[mine]
        )
        if not apart:
            raise InputError(
                f"GraphCamera: portals {tree.portals[first]} and {tree.portals[second]} leave "
                f"{_frustum(tree, tree.parents[first])} and overlap as seen from its center, so a ray would meet both: "
                "make one smaller, or let one be the other's parent"
            )


def _straight(tree: Tree, numbers: Numbers, number: int) -> np.ndarray:
    """Corners of a face unbent into the root's frustum."""
    unbend = numbers.unbend[tree.parents[number]]
    return numbers.corners[number] @ unbend[:, :3].T + unbend[:, 3]


def _outside(plane: Any, points: np.ndarray) -> float:
    """How far the farthest point lies on the positive side of a plane."""
    return float((points @ plane[:3] + plane[3]).max())


def _name(tree: Tree, node: int) -> str:
    return "the root" if node == 0 else f"portal {tree.owners[node]}"


def _frustum(tree: Tree, node: int) -> str:
    return "the frustum of the root" if node == 0 else f"the frustum behind portal {tree.portals[node]}"


def _refused(portal: int, reason: str, mend: str) -> InputError:
    return InputError(f"GraphCamera: portal {portal}: {reason}: {mend}")
