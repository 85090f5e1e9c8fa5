"""The scenes of Rosen et al. 2011: closed, wound outwards, exact counts, free cells, boxes that hold their things."""

from functools import cache

import numpy as np
import pytest

import mpcam as mp
from mpcam.effects.mirror_rays import mirror_rays
from mpcam.experiments import rosen2011_relief_scene as relief
from mpcam.experiments import rosen2011_scenes as scenes
from mpcam.geometry.car import BODY_COLOR
from mpcam.geometry.levels import Level, fitted
from mpcam.geometry.maze import PLAN, Maze
from mpcam.geometry.shapes import Builder, ellipsoid
from mpcam.geometry.solids import capped, tapered, turned
from mpcam.geometry.textures import painted

SINGLE = ("knot", "teapot", "barrel", "car", "statue")
COUNTS = {  # asked for and made; a change of the shapes shows here
    "knot": {2_000: 2_000, 20_000: 20_000, 330_000: 330_000},
    "teapot": {2_000: 2_024, 20_000: 20_010, 330_000: 330_964},
    "barrel": {5_000: 4_914},
    "car": {12_000: 11_942},
    "statue": {60_000: 60_228},
    "maze": {20_000: 20_124},
}
BOUNDS = {  # length, width and height, scene units
    "knot": (2.8, 2.91, 1.71),
    "teapot": (2.61, 1.64, 1.19),
    "barrel": (0.72, 0.72, 0.9),
    "car": (4.42, 1.9, 1.43),
    "statue": (4.74, 3.51, 2.59),
    "maze": (22.0, 20.0, 1.7),
}


@cache
def built(name: str) -> mp.Mesh:
    return mp.builtin_mesh(name, {"statue": 8_000, "car": 12_000}.get(name, 5_000))


def assert_closed(vertices, faces):
    """Every edge has one face on either side, which runs along it the other way; and the volume is that of a solid."""
    _, weld = np.unique(np.round(vertices * 1e7).astype(np.int64), axis=0, return_inverse=True)
    welded = weld.reshape(-1)[faces]
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    forth = {(int(a), int(b)) for a, b in edges}
    assert len(forth) == len(edges)
    assert forth == {(b, a) for a, b in forth}
    a, b, c = vertices[faces].transpose(1, 0, 2)
    assert (np.cross(a, b) * c).sum() > 0


def assert_sound(vertices, faces, normals, limit=0.0):
    """Finite, of some area, with unit normals on the outer side of the faces."""
    assert np.isfinite(vertices).all()
    a, b, c = vertices[faces].transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1)
    assert length.min() > 0
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
    assert ((normals[faces] * (across / length[:, None])[:, None]).sum(axis=2) > limit).all()


@pytest.mark.parametrize("name", SINGLE)
def test_things_are_closed(name):
    mesh = built(name)
    assert_closed(mesh.vertices, mesh.faces)
    assert mesh.normals is not None
    assert_sound(mesh.vertices, mesh.faces, mesh.normals)


@pytest.mark.parametrize("name", COUNTS)
def test_counts_and_sizes(name):
    for asked, made in COUNTS[name].items():
        mesh = mp.builtin_mesh(name, asked)
        assert mesh.triangle_count == made
    low, high = mesh.bounds
    np.testing.assert_allclose(high - low, BOUNDS[name], atol=0.02)
    assert name == "knot" or abs(low[2]) < 0.01  # things stand on the ground
    assert mesh.normals is not None
    assert_sound(mesh.vertices, mesh.faces, mesh.normals)


def test_a_hole_a_flipped_face_and_a_loose_corner_are_noticed():
    mesh = built("barrel")
    flipped = mesh.faces.copy()
    flipped[7] = flipped[7, ::-1]
    moved = mesh.vertices + 1e-3 * (np.arange(len(mesh.vertices)) == 40)[:, None]
    for vertices, faces in ((mesh.vertices, mesh.faces[1:]), (mesh.vertices, flipped), (moved, mesh.faces)):
        with pytest.raises(AssertionError):
            assert_closed(vertices, faces)


@pytest.mark.parametrize(
    "part",
    [
        turned([(0.0, 0.0), (0.5, 0.0), None, (0.3, 1.0), None, (0.0, 1.2)], Level(1.0), 20, 16),
        capped([(0, 0, 0), (0, 0.2, 1), (0, 1, 2)], [(0.3, 0.1), (0.2, 0.2), (0.1, 0.3)], 9),
        tapered([(0, 0, 0), (0, 0.2, 1), (0, 0.4, 2)], (0.4, 0.2, 0.1), 12, 10),
    ],
)
def test_solids_are_closed(part):
    assert_closed(part.vertices, part.faces)
    assert_sound(part.vertices, part.faces, part.normals)
    # No vertex is farther out than the radii allow.
    assert np.abs(part.vertices[:, 0]).max() <= 0.51


def test_fitted_levels_come_near():
    def build(level: Level) -> Builder:
        builder = Builder()
        builder.add(ellipsoid((0, 0, 0), (1, 1, 1), level(10, 3), level(20, 5)), painted("ball", "#ffffff"))
        return builder

    assert build(Level(1.0)).count == 360
    for asked in (100, 361, 2_000, 50_000):
        assert fitted(build, asked, 360).count == pytest.approx(asked, rel=0.1)


def test_only_the_body_of_the_car_is_keyed():
    mesh = built("car")
    keyed = [material.name for material in mesh.materials if material.color == BODY_COLOR]
    assert keyed == ["car body"]


# The maze.


def test_walls_are_closed_and_open_cells_are_free():
    maze = Maze.drawn()
    part = maze.walls(2)
    assert_closed(part.vertices, part.faces)
    assert_sound(part.vertices, part.faces, part.normals, 0.999)
    mesh = mp.Mesh(part.vertices, part.faces)
    random = np.random.default_rng(2)
    for row, column in np.argwhere(maze.open):
        # from the middle, at half of the height: as far as the cell's border whichever way, nothing is met
        eye = maze.center(row, column, 0.5 * maze.height)
        low, high = (
            eye - 0.499 * np.array([maze.cell] * 2 + [maze.height]),
            eye + 0.499 * np.array([maze.cell] * 2 + [maze.height]),
        )
        inside = ((mesh.vertices > low) & (mesh.vertices < high)).all(axis=1)
        assert not inside.any()
        assert winding(mesh, random.uniform(low, high)) == pytest.approx(0, abs=1e-6)
    for row, column in np.argwhere(~maze.open):
        assert winding(mesh, maze.center(row, column, 0.5 * maze.height)) == pytest.approx(1, abs=1e-6)


def winding(mesh: mp.Mesh, point) -> float:
    """How often a closed surface goes around a point: its solid angle over 4 pi (Van Oosterom and Strackee)."""
    a, b, c = (mesh.corners - point).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(2 * np.arctan2((a * np.cross(b, c)).sum(1), below).sum() / (4 * np.pi))


def test_all_open_cells_hang_together_without_rings():
    maze = Maze.drawn()
    cells = {(int(r), int(c)) for r, c in np.argwhere(maze.open)}
    links = sum((r + 1, c) in cells for r, c in cells) + sum((r, c + 1) in cells for r, c in cells)
    assert links == len(cells) - 1
    reached, front = {maze.entrance}, [maze.entrance]
    while front:
        r, c = front.pop()
        for near in ((r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)):
            if near in cells and near not in reached:
                reached.add(near)
                front.append(near)
    assert reached == cells
    assert maze.outward == (-1, 0) and maze.entrance == (0, 5)
    assert {letter for letter, _ in maze.things} == set("acde")


def test_the_floor_lies_under_open_cells():
    maze = Maze.drawn()
    part = maze.floor(3)
    assert part.count == 2 * 9 * (maze.open.sum() + 1)
    middle = part.vertices[part.faces].mean(axis=1)
    column, row = np.floor((middle[:, :2] - maze.corner) / maze.cell).astype(int).T
    before = row == -1
    assert maze.open[row[~before], column[~before]].all() and (column[before] == maze.entrance[1]).all()
    assert (part.vertices[:, 2] == 0).all()


def test_things_keep_to_their_cells():
    maze, bare = Maze.drawn(), Maze.drawn(PLAN.translate({ord(letter): " " for letter in "acde"}))
    walls, whole = bare.mesh(5_000), maze.mesh(5_000)
    assert bare.things == () and whole.triangle_count > 4_800
    flat = {material.name for material in walls.materials}
    used = np.array([material.name not in flat for material in whole.materials])
    assert used.any() and whole.face_material is not None
    corners = whole.corners[used[whole.face_material]].reshape(-1, 3)
    place = (corners[:, :2] - maze.corner) / maze.cell
    column, row = np.floor(place).astype(int).T
    assert {(int(r), int(c)) for r, c in zip(row, column, strict=True)} == {cell for _, cell in maze.things}
    assert np.abs(place - np.floor(place) - 0.5).max() < 0.4


@pytest.mark.parametrize(
    ("plan", "words"),
    [("###\n#  \n## \n", "2 open"), ("###\n# #\n###\n", "0 open"), ("###\n# \n###\n", "different lengths")],
)
def test_plans_that_are_no_maze(plan, words):
    with pytest.raises(mp.InputError, match=words):
        Maze.drawn(plan)
    with pytest.raises(mp.InputError, match="entrance"):
        Maze(np.eye(3, dtype=bool), 1.0, 1.0, (0, 0), (0.0, 0.0))


# Scenes.


@pytest.mark.parametrize("mirror", scenes.MIRRORS)
def test_the_mirror_shows_the_thing(mirror):
    scene = scenes.reflection_scene(2_000, "knot" if mirror == "bowl" else "teapot", mirror, 64, 48)
    assert len(scene.meshes) == 2 and scene.mirror is not None
    np.testing.assert_allclose(scene.meshes[0].bounds.mean(axis=0), scenes.CENTER, atol=0.25)
    found = mirror_hits(scene)
    assert (found >= 0).mean() > 0.1
    assert ((found >= 0) & (found < scene.meshes[0].triangle_count)).mean() > 0.005


def mirror_hits(scene: mp.Scene) -> np.ndarray:
    """Numbers of the triangles that pixels see in the mirror, -1 for none."""
    camera = scene.camera
    assert camera is not None and scene.mirror is not None
    ray = mirror_rays(camera, scene.mirror).ray
    shape = (camera.height, camera.width)
    rays = mp.RayMap(ray.origin.reshape(*shape, 3), ray.direction.reshape(*shape, 3))
    return np.where(np.reshape(ray.valid, shape), mp.rasterize(rays, scene.mesh, method="raytrace").triangle, -1)


def test_maze_scene():
    scene, maze = scenes.maze_scene(mirror="sphere", width=60, height=40)
    assert scene.mesh.triangle_count == COUNTS["maze"][20_000]
    assert scene.mirror is not None and maze.open[1, 5]
    for cell in np.argwhere(maze.open):
        camera = scenes.maze_camera(maze, (int(cell[0]), int(cell[1])))
        eye = np.linalg.inv(np.asarray(camera.camera_from_world))[:2, 3]
        column, row = np.floor((eye - maze.corner) / maze.cell).astype(int)
        outside = not (0 <= row < maze.open.shape[0] and 0 <= column < maze.open.shape[1])
        assert outside or maze.open[row, column]
    for wrong in ({"cell": (0, 0)}, {"cell": (-1, 5)}, {"mirror": "bunny"}):
        with pytest.raises(mp.InputError, match="maze"):
            scenes.maze_scene(**wrong)
    with pytest.raises(mp.InputError, match="bumpy"):
        scenes.reflection_scene(mirror="flat")


def test_the_path_around_the_statue():
    assert np.allclose(
        scenes.statue_camera(0.0).camera_from_world, scenes.statue_camera(1.0).camera_from_world, atol=1e-12
    )
    scene = scenes.statue_scene(8_000, 0.4, 64, 48)
    for time in (0.0, 0.3, 0.7):
        hits = mp.rasterize(scenes.statue_camera(time, 64, 48), scene.mesh)
        on = (hits.triangle >= 0) & (hits.triangle < scene.meshes[0].triangle_count)
        assert 0.1 < on.mean() < 0.5
        assert not (on[0].any() or on[-1].any() or on[:, 0].any() or on[:, -1].any())


@pytest.mark.parametrize(("kind", "count"), [("cars", 40), ("barrels", 60), ("small cars", 160)])
def test_relief_tiles_stand_apart_on_the_ground(kind, count):
    made = relief.relief_scene(kind, width=64, height=48)
    assert made.matrices.shape == (count, 4, 4)
    assert (made.tile.vertices >= made.box[0]).all() and (made.tile.vertices <= made.box[1]).all()
    linear = made.matrices[:, :3, :3]
    scale = 0.5 if kind == "small cars" else 1.0
    np.testing.assert_allclose(
        linear.transpose(0, 2, 1) @ linear, np.tile(scale**2 * np.eye(3), (count, 1, 1)), atol=1e-12
    )
    assert (np.linalg.det(linear) > 0).all()
    assert np.degrees(np.arccos(linear[:, 2, 2].min() / scale)) < 12
    # Feet are on the ground, to what its coarse triangles are off.
    ground = made.scene.meshes[0].vertices
    for place in made.matrices[:, :3, 3]:
        near = ground[np.argmin(np.linalg.norm(ground[:, :2] - place[:2], axis=1))]
        assert abs(near[2] - place[2]) < 0.25
    corners = np.array([(made.box[i, 0], made.box[j, 1]) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
    outlines = corners @ linear[:, :2, :2].transpose(0, 2, 1) + made.matrices[:, None, :2, 3]
    assert not overlapping(outlines)
    assert overlapping(np.stack([outlines[0], outlines[0] + 0.9 * (outlines[0, 2] - outlines[0, 0])]))
    if made.colors is not None:
        assert len(np.unique(made.colors, axis=0)) == 8
    few = relief.relief_scene(kind, count=3)
    np.testing.assert_array_equal(few.matrices, made.matrices[:3])
    whole = few.whole()
    assert whole.mesh.triangle_count == few.scene.mesh.triangle_count + 3 * few.tile.triangle_count


def overlapping(outlines: np.ndarray) -> bool:
    """Whether two of the quadrilaterals (N, 4, 2), counter-clockwise, overlap: no side of theirs parts them."""
    for one in range(len(outlines)):
        for other in range(one):
            parted = False
            for a, b in ((one, other), (other, one)):
                side = np.roll(outlines[a], -1, axis=0) - outlines[a]
                out = np.stack([side[:, 1], -side[:, 0]], axis=1)
                gap = ((outlines[b][None] - outlines[a][:, None]) * out[:, None]).sum(2).min(1)
                parted = parted or bool((gap > 0).any())
            if not parted:
                return True
    return False


def test_painted_cars_differ_in_the_body_alone():
    made = relief.relief_scene("cars", count=8)
    assert made.colors is not None
    plain = [material.color for material in made.tile.materials]
    for mesh, color in zip(made.whole().meshes[1:], made.colors, strict=True):
        for before, material in zip(plain, mesh.materials, strict=True):
            assert material.color == (tuple(color) if before == BODY_COLOR else before)
    with pytest.raises(mp.InputError, match="1 to 40"):
        relief.relief_scene("cars", count=41)
    with pytest.raises(mp.InputError, match="small cars"):
        relief.relief_scene("trains")
