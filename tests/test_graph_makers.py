"""Graph cameras as they are made: through mazes and around things, from files, and what is refused."""

import json
from typing import Any

import numpy as np
import pytest
from catalog import POSE
from graph_cameras import MAZE, on_pieces

import mpcam as mp
from mpcam.cameras.serialize import camera_from_json, camera_to_json
from mpcam.io.scenes import load_scene

CAMERAS: dict[str, Any] = mp.GraphCamera.examples(64, 48, POSE)  # pyright: ignore[reportAssignmentType]
DOOR = [(-1.0, -0.8, 2.0), (1.0, -0.8, 2.0), (1.0, 0.8, 2.0), (-1.0, 0.8, 2.0)]
CUTTING = [(0.9, -0.5, 2.01), (0.9, 0.5, 2.01), (0.8, 0.5, 3.0), (0.8, -0.5, 3.0)]
ROOT = mp.Pinhole(64, 48)


def one_way(x, y, z, w=1.0):
    """Corners of a rectangle at z, around (x, y)."""
    return [(x - w, y - w, z), (x + w, y - w, z), (x + w, y + w, z), (x - w, y + w, z)]


def test_a_maze_is_seen_to_its_last_corner():
    """Every open cell is in the image, and most of it: more than ten times what a pinhole in the entrance sees."""
    plan = mp.MazePlan.drawn(MAZE, 2.0, 1.7)
    camera = mp.GraphCamera.through(plan, 320, 240)
    rows, columns = np.nonzero(plan.open)
    rng = np.random.default_rng(2)
    inside = rng.uniform(0.02, 0.98, (200, len(rows), 3))
    cells = np.stack([columns, rows, 0 * rows], -1)
    points = (cells + inside) * (2.0, 2.0, 1.7) + (*plan.corner, 0.0)
    image = camera.project(points)
    seen = image.valid[..., 0] & camera.contains(image.pixel)[..., 0]
    assert (seen.mean(0) > 0.25).all() and seen.mean() > 0.75
    here = camera.location(points[seen])
    assert set(here) == set(range(len(camera.frustum_parents)))
    # Every frustum has pixels at the resolution of the paper's image.
    large = mp.GraphCamera.through(plan, 1920, 1175)
    corners = large.numbers.corners[1:]
    for number, face in enumerate(corners, 1):
        size = np.ptp(
            large.frusta.local_project(face.mean(0)[:, None] + 0.999 * (face - face.mean(0)).T)[0].pixel, axis=1
        )
        assert size.min() > 1.0, number


@pytest.mark.parametrize(
    "drawing",
    [
        ["###", "#E#"],
        ["####", "#  #", "E  #", "####"],
        ["#####", "#   #", "# # #", "E   #", "#####"],
        ["######", "#   ##", "# # ##", "#    #", "#E####"],
    ],
)
def test_rooms_and_rings_have_one_image(drawing):
    plan = mp.MazePlan.drawn(drawing)
    camera = mp.GraphCamera.through(plan, 64, 48)
    rows, columns = np.nonzero(plan.open)
    points = np.stack([columns + 0.5, rows + 0.5, 0 * rows + 0.5], -1) + (*plan.corner, 0.0)
    image = camera.project(points)
    assert image.valid.all() and camera.contains(image.pixel).all()
    for pixel, points, depth, _ in on_pieces(camera, 300):
        image = camera.project(points)
        assert image.valid.all() and np.abs(image.pixel[:, 0] - pixel).max(initial=0.0) < 1e-10
        assert np.abs(image.depth[:, 0] - depth).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("seed", range(8))
def test_whatever_is_open_is_one_camera(seed):
    """Halls, rings, and corners at which two cells meet: the checks are passed, and rays and images are inverse."""
    rng = np.random.default_rng(seed)
    cells = rng.random(rng.integers(4, 9, 2)) < rng.uniform(0.4, 0.9)
    cells[0, 2] = True
    plan = mp.MazePlan(cells, rng.uniform(0.5, 3), rng.uniform(0.5, 3), (0, 2), tuple(rng.normal(size=2)))
    camera = mp.GraphCamera.through(plan, 64, 48, rng.uniform(0.3, 2))
    for pixel, points, depth, _ in on_pieces(camera, 200):
        image = camera.project(points)
        assert image.valid.all() and camera.contains(image.pixel).all() and len(pixel) == len(points)
        assert np.abs(image.depth[:, 0] - depth).max(initial=0.0) < 1e-11


def test_three_sides_show_what_a_pinhole_does_not():
    """Of a ball around the splitting point, the part behind its outline."""
    root = mp.Pinhole(96, 72, 90.0, camera_from_world=mp.look_at((0, -4.0, 0.5), (0, 0, 0)))
    camera = mp.GraphCamera.around((0.0, 0.0, 0.0), root, 2.5)
    ball = mp.builtin_mesh("sphere", triangles=5120)
    hits = {name: mp.rasterize(given, ball) for name, given in (("graph", camera), ("pinhole", root))}
    behind = {name: found.points[found.mask][:, 1].max() for name, found in hits.items()}
    assert behind["pinhole"] < 0.0 and behind["graph"] > 0.3
    # What is in front of the plane has the pinhole's pixels.
    points = hits["pinhole"].points[hits["pinhole"].mask]
    front = points[points[:, 1] < -0.1][::50]
    assert np.abs(camera.project(front).pixel - root.project(front).pixel).max() < 1e-9


# Files


def scene(tmp_path, **camera):
    text = "\n".join(f"{key} = {json.dumps(value)}" for key, value in camera.items() if key != "portals")
    for portal in camera.get("portals", []):
        text += "\n[[camera.portals]]\n" + "\n".join(f"{key} = {json.dumps(value)}" for key, value in portal.items())
    path = tmp_path / "scene.toml"
    path.write_text(f'[[mesh]]\nbuiltin = "cube"\n[camera]\nmodel = "graph_camera"\n{text}\n')
    return load_scene(path).scene.camera


def test_scene_files_describe_portals_objects_and_mazes(tmp_path):
    view = {"size": [64, 48], "eye": [0, -3, 1], "target": [0, 0, 1], "fov": 70}
    root = mp.Pinhole.from_fov(64, 48, np.radians(70), mp.look_at((0, -3, 1), (0, 0, 1)))
    door = [[-1.5, 0, 0], [1.5, 0, 0], [1.5, 0, 2], [-1.5, 0, 2]]
    left = [[-1.5, 2, 0.2], [-1.5, 4, 0.2], [-1.5, 4, 1.8], [-1.5, 2, 1.8]]
    box = [[-1.5, 0, -1], [3, 5, 3]]
    portals = [
        {"polygon": door, "center": [0.5, -2, 1], "box": box},
        {"polygon": left, "center": [1, 3, 1], "parent": 0},
    ]
    found = scene(tmp_path, **view, box=[[-9, -3, -9], [9, 0, 9]], portals=portals)
    made = [mp.Portal(door, (0.5, -2, 1), ends=box), mp.Portal(left, (1, 3, 1), 0)]
    assert found == mp.GraphCamera(root, made, [[-9, -3, -9], [9, 0, 9]])
    assert scene(tmp_path, **view, splitting_point=[0, 0, 1], shift=1.0) == mp.GraphCamera.around((0, 0, 1), root, 1.0)
    drawing = MAZE.strip().split("\n")
    maze = scene(tmp_path, size=[64, 48], maze=drawing, cell=2, wall_height=1.5, opening=0.8)
    assert maze == mp.GraphCamera.through(mp.MazePlan.drawn(MAZE, 2, 1.5), 64, 48, 0.8)
    anywhere = scene(tmp_path, size=[64, 48], splitting_point=[0, 0, 0])
    assert anywhere.root.camera_from_world is not None and anywhere.pieces_per_ray == 2


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({}, "camera.portals: give one of portals, splitting_point, maze"),
        ({"maze": ["# #"], "fov": 60}, "camera.fov = 60: does not go with maze: allowed are maze, cell"),
        ({"maze": ["###"]}, r"camera.maze = .*0 open cells"),
        ({"maze": ["# #", "###"], "eye": [0, 0, 0]}, "camera.eye.*the other keys place this camera: leave it out"),
        ({"portals": [{"polygon": [[0, 0, 0]]}]}, r"camera.portals: portal 0: Portal: polygon"),
        ({"portals": [{"center": [0, 0, 0]}]}, r"camera.portals\[0\].polygon: this key is missing"),
        ({"portals": [{"polygon": [[0, 0, 0]], "centre": [0, 0, 0]}]}, "there is no such key: did you mean center"),
    ],
)
def test_mistakes_in_scene_files_have_a_line(tmp_path, keys, message):
    with pytest.raises(mp.InputError, match=message):
        scene(tmp_path, size=[64, 48], **keys)


def test_json_and_poses():
    camera = CAMERAS["merge"]
    again: Any = camera_from_json(camera_to_json(camera))
    assert again == camera and again != CAMERAS["bend"] and again.portals[1].into == 0
    moved = camera.with_pose(np.eye(4))
    assert moved != camera and moved.root == camera.root and moved.frusta is camera.frusta
    with pytest.raises(mp.InputError, match="GraphCamera: root: .*unexpected"):
        mp.GraphCamera({"width": 3, "height": 3, "depth": 4})


# What is refused


@pytest.mark.parametrize(
    ("portals", "message"),
    [
        ([mp.Portal(DOOR, (0, 0, 2.0))], "portal 0: its center lies in the plane of the face: move it"),
        ([mp.Portal(DOOR, (0, 0, 3.0))], "portal 0: its center and that of the root lie on different sides"),
        ([mp.Portal([(0, 0, 2), (1, 0, 2), (2, 0, 2)], (0, 0, 0))], "portal 0: its corners lie on one line"),
        ([mp.Portal([*DOOR, DOOR[3]], (0, 0, 0))], "portal 0: its corners lie on one line, or two are the same"),
        ([mp.Portal([*DOOR[:3], (-1, 0.8, 2.1)], (0, 0, 0))], "portal 0: corner . lies 0.0.* off the plane"),
        ([mp.Portal([DOOR[0], DOOR[2], DOOR[1], DOOR[3]], (0, 0, 0))], "portal 0: its (polygon is not convex|corners)"),
        ([mp.Portal([*DOOR, (0.5, 0, 2)], (0, 0, 0))], "portal 0: its polygon is not convex: give corners in order"),
        ([mp.Portal(one_way(0, 0, -2.0), (0, 0, -1.0))], "portal 0: a corner lies behind the root"),
        ([mp.Portal(DOOR, (0, 0, 0), parent=3)], "portal 0: parent=3: there are portals 0 to 0; -1 is the root"),
        ([mp.Portal(DOOR, (0, 0, 0), parent=0)], "portal 0 can be reached through itself"),
        (
            [mp.Portal(DOOR, into=1), mp.Portal(DOOR, (0, 0, 0))],
            "portals 0 and 1 leave the frustum of the root and overlap",
        ),
        ([mp.Portal(DOOR, into=2)], "portal 0: into=2: there are portals 0 to 0"),
        ([mp.Portal(DOOR, into=0)], "portal 0: into=0, which has no center of its own"),
        (
            [mp.Portal(DOOR, (0, 0, 0)), mp.Portal(one_way(0, 0, 1.5, 0.5), (0, 0, 0), 0)],
            "portal 1: a corner lies before the face of portal 0: move it behind",
        ),
        (
            [mp.Portal(DOOR, (0, 0, 0)), mp.Portal(CUTTING, (0, 0, 0), 0)],
            "portal 1: its plane cuts the face of portal 0: turn it",
        ),
        (
            [mp.Portal(DOOR, (0, 0, 0)), mp.Portal(one_way(0, 0, 3.0, 2.0), (0, 0, 0), 0)],
            "portal 1: a corner lies outside of the rays of portal 0: make the face smaller",
        ),
        (
            [mp.Portal(one_way(-2, 0, 2.0), (0, 0, 0)), mp.Portal(one_way(2, 0, 3.0), (0, 0, 0))],
            "portal 1: a corner lies behind the plane of portal 0, where the frustum of the root ends: give parent=0",
        ),
        (
            [mp.Portal(one_way(-0.5, 0, 2.0), (0, 0, 0)), mp.Portal(one_way(0.5, 0, 2.0), (0, 0, 0))],
            "portals 0 and 1 leave the frustum of the root and overlap as seen from its center",
        ),
        (
            [mp.Portal(one_way(-1.1, 0, 2.0), (-2, 0, 0)), mp.Portal(one_way(1.1, 0, 2.0), (2, 0, 0))],
            r"behind portal 0 and the frustum behind portal 1 overlap, at \(.*\) for instance",
        ),
        (
            [mp.Portal(DOOR, (0, 0, 0), ends=[(-2, -2, 2.5), (2, 2, 9)])],
            "portal 0: its face lies outside of its own ends",
        ),
        (
            [
                mp.Portal(DOOR, (0, 0, 0), ends=[(-2, -2, 2), (2, 2, 4)]),
                mp.Portal(one_way(0, 0, 5.0, 0.1), (0, 0, 0), 0),
            ],
            "portal 1: a corner lies outside of the ends of portal 0: move the corner, or the ends",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(portals, message):
    with pytest.raises(mp.InputError, match=message):
        mp.GraphCamera(ROOT, portals)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: mp.Portal(DOOR), "give center, or into with the number of another portal; not both, nor neither"),
        (lambda: mp.Portal(DOOR, (0, 0, 0), into=1), "not both, nor neither"),
        (lambda: mp.Portal(DOOR[:2], (0, 0, 0)), "three corners or more"),
        (lambda: mp.Portal("door", (0, 0, 0)), "three corners or more"),
        (lambda: mp.Portal([[0, 0, np.nan], *DOOR[1:]], (0, 0, 0)), "finite numbers"),
        (lambda: mp.Portal(DOOR, (0, 0)), "Portal: center=.*three finite numbers"),
        (lambda: mp.Portal(DOOR, (0, 0, 0), 1.5), r"Portal: parent=1.5: give the number of a portal"),
        (lambda: mp.Portal(DOOR, (0, 0, 0), ends=[(0, 0, 0)]), "give two opposite corners of a box"),
        (lambda: mp.Portal(DOOR, (0, 0, 0), ends=[(0, 0, 0), (1, 0, 1)]), "the box is flat"),
        (lambda: mp.Portal(DOOR, (0, 0, 0), ends=[(0, 0, 0, 1)]), "a plane has no normal"),
        (lambda: mp.Portal(DOOR, into=1, ends=[(0, 0, 1, -1)]), "ends belong to the frustum of the portal"),
        (lambda: mp.GraphCamera(mp.Orthographic(8, 8)), "root=.*give an mpcam.Pinhole"),
        (lambda: mp.GraphCamera(ROOT, mp.Portal(DOOR, (0, 0, 0))), "give a list of mpcam.Portal"),
        (lambda: mp.GraphCamera(ROOT, [3]), "portal 0 is a int: give an mpcam.Portal"),
        (lambda: mp.GraphCamera(ROOT, [{"polygon": DOOR}]), "portal 0: give center, or into"),
        (lambda: mp.GraphCamera(ROOT, [{"polygon": DOOR, "middle": 1}]), "portal 0: .*middle"),
        (lambda: mp.GraphCamera.around((0, 0, -1.0), ROOT), "is not in the root's image"),
        (lambda: mp.GraphCamera.around((9, 0, 1.0), ROOT), "is not in the root's image"),
        (lambda: mp.GraphCamera.around((0, 0, 1.0), ROOT, -1.0), r"around\(shift=-1.0\): a number above 0"),
        (lambda: mp.GraphCamera.through(mp.MazePlan.drawn(MAZE), 64, 0), r"through\(height=0\)"),
        (lambda: mp.GraphCamera.through(mp.MazePlan.drawn(MAZE), 64, 48, 0.0), r"through\(opening=0.0\)"),
        (lambda: mp.MazePlan.drawn("###\n###"), "0 open cells in its border"),
        (lambda: mp.MazePlan.drawn("# #\n# #"), "4 open cells|2 open cells"),
        (lambda: mp.MazePlan.drawn("##\n#"), "lines of equal length"),
        (lambda: mp.MazePlan(np.ones((2, 2)), cell=0.0), r"MazePlan\(cell=0.0\)"),
        (lambda: mp.MazePlan(np.zeros((2, 2))), "give row and column of an open cell in the border; there are none"),
    ],
)
def test_mistakes_are_explained(make, message):
    with pytest.raises(mp.InputError, match=message):
        make()
