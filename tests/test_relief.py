"""Reliefs against closed forms, brute force in float64, and the meshes that they stand for."""

from dataclasses import replace

import numpy as np
import pytest

import mpcam as mp
from mpcam.effects import relief_hits as home
from mpcam.effects.relief_cameras import relief_camera, top_in_middle

RANDOM = np.random.default_rng(5)


def turned(axis, angle, shift=(0, 0, 0), scale=1.0) -> np.ndarray:
    """4x4: scaled, turned about an axis, moved."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    matrix[:3, :3] *= scale
    matrix[:3, 3] = shift
    return matrix


def half_plane(side=48) -> mp.Relief:
    """The part x < 0.1 of the plane z = 0.25 in the box [-1, 1]^2 x [0, 1], seen from above; red left of x = -0.5."""
    camera = mp.Orthographic(side, side, camera_from_world=mp.look_at((0, 0, 1.25), (0, 0, 0), (0, 1, 0)))
    x = np.broadcast_to((np.arange(side) + 0.5) * 2 / side - 1, (side, side))
    depth = np.where(x < 0.1, 1.0, np.inf)
    color = np.where(x[..., None] < -0.5, (0.8, 0.1, 0.0), (0.2, 0.4, 0.6))
    image = mp.DepthImage(camera, depth, color=color, normals=np.broadcast_to((0.0, 0, 1), (side, side, 3)))
    return mp.Relief(image, [(-1, -1, 0), (1, 1, 1)], key=(0.8, 0.1, 0.0))


def grid(camera) -> np.ndarray:
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    return np.stack([u, v], -1)


def expected(camera, placements, slack=0.0):
    """Depth of the nearest hit on copies of `half_plane`, and which copy: every ray with every copy, in float64.

    slack: how much wider the part of the plane is, tile units.
    """
    ray = camera.ray(grid(camera))
    best, which = np.full(ray.valid.shape, np.inf), np.full(ray.valid.shape, -1)
    for number, matrix in enumerate(placements):
        inverse = np.linalg.inv(matrix)
        o, d = ray.origin @ inverse[:3, :3].T + inverse[:3, 3], ray.direction @ inverse[:3, :3].T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (0.25 - o[..., 2]) / d[..., 2]
            p = o + t[..., None] * d
            hit = ray.valid & (t > 0) & (np.abs(p[..., :2]).max(-1) < 1 + slack) & (p[..., 0] < 2 / 24 + slack)
        nearer = hit & (t < best)
        best, which = np.where(nearer, t, best), np.where(nearer, number, which)
    return best, which


UNEVEN = np.diag([1.5, 0.7, 2.0, 1.0])
PLACES = {
    "as it is": np.eye(4),
    "turned": turned((1, 2, 0.5), 0.7, (0.3, -0.2, 0.4)),
    "smaller": turned((0, 1, 1), -0.4, (0.5, 0.2, 0), 0.5),
    "mirrored": turned((1, 0, 1), 0.5) @ np.diag([-1.0, 1, 1, 1]),
    "uneven": turned((0, 0, 1), 0.6) @ UNEVEN @ turned((1, 1, 0), 0.3),
    "far away": turned((1, 2, 0.5), 0.7, (4000, 3000, 2000)),
}
EYES = {
    "pinhole": lambda pose: mp.Pinhole.from_fov(70, 50, np.radians(50), camera_from_world=pose),
    "fisheye": lambda pose: mp.Radial.paraboloid(61, 61, camera_from_world=pose),
    "orthographic": lambda pose: mp.Orthographic(60, 50, 18.0, camera_from_world=pose),
    "general": lambda pose: mp.RayMap(*_rays(mp.Pinhole.from_fov(56, 44, np.radians(50), camera_from_world=pose))),
}


def _rays(camera):
    ray = camera.ray(grid(camera))
    return ray.origin + 0.01 * grid(camera).sum(-1)[..., None] * ray.direction, ray.direction


def agrees(camera, placements, hits):
    """See that hits are those of `expected`, but at borders of the plane, where a texel's patch may be taken or not."""
    low, high = expected(camera, placements, -0.05), expected(camera, placements, 0.05)
    sure = low[1] == high[1]
    assert sure.mean() > 0.8
    assert (hits.instance[sure] == low[1][sure]).all()
    met = sure & (low[1] >= 0)
    assert met.mean() > 0.002
    assert hits.depth[met] == pytest.approx(low[0][met], rel=2e-5, abs=2e-5)
    assert np.isinf(hits.depth[sure & ~met]).all()


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("eye", ["pinhole", "fisheye", "orthographic", "general"])
def test_a_plane_is_where_it_is(place, eye):
    matrix = PLACES[place]
    look = mp.look_at(matrix[:3, 3] + (1.0, -1.2, 1.5), matrix[:3, 3], (0, 0, 1))
    camera = EYES[eye](look)
    agrees(camera, [matrix], mp.relief_hits(camera, half_plane().instances(matrix)))


def crowd(count=14) -> np.ndarray:
    """Copies through and behind each other."""
    made = [
        turned(RANDOM.normal(size=3), RANDOM.uniform(0, 3), RANDOM.uniform(-1.5, 1.5, 3), RANDOM.uniform(0.5, 1.2))
        for _ in range(count)
    ]
    return np.array(made)


@pytest.mark.parametrize("chunk", [1024, 3])
def test_the_nearest_of_many_copies_is_met_where_nearer_boxes_are_missed(chunk, monkeypatch):
    monkeypatch.setattr(home, "CHUNK", chunk)
    camera = mp.Pinhole.from_fov(90, 64, np.radians(55), camera_from_world=mp.look_at((1, -4, 3), (0, 0, 0)))
    placements = crowd()
    hits = mp.relief_hits(camera, half_plane().instances(placements))
    assert len(np.unique(hits.instance)) > 8
    agrees(camera, placements, hits)


def test_of_several_reliefs_the_nearest_counts():
    camera = mp.Pinhole.from_fov(90, 64, np.radians(55), camera_from_world=mp.look_at((1, -4, 3), (0, 0, 0)))
    placements, relief = crowd(), half_plane()
    together = mp.relief_hits(camera, relief.instances(placements))
    apart = mp.relief_hits(
        camera, [relief.instances(part) for part in (placements[:5], placements[5:5], placements[5:])]
    )
    assert (together.mask == apart.mask).mean() > 0.999
    met = together.mask & apart.mask
    assert apart.depth[met] == pytest.approx(together.depth[met], rel=1e-5)
    assert set(np.unique(apart.relief)) == {-1, 0, 2}
    assert ((apart.instance + 5 * (apart.relief == 2)) == together.instance)[met].mean() > 0.999


def test_moved_copies_are_as_new_ones():
    camera = mp.Pinhole.from_fov(70, 50, np.radians(55), camera_from_world=mp.look_at((1, -4, 3), (0, 0, 0)))
    first, second = crowd(), crowd(9)
    instances = half_plane().instances(first)
    before = mp.relief_hits(camera, instances).depth
    instances.update(second)
    after = mp.relief_hits(camera, instances).depth
    assert (after == mp.relief_hits(camera, half_plane().instances(second)).depth).all()
    instances.update(first)
    assert (mp.relief_hits(camera, instances).depth == before).all() and (before != after).any()


def test_what_lies_behind_other_things_is_not_met():
    camera = mp.Pinhole.from_fov(60, 40, np.radians(50), camera_from_world=mp.look_at((1.5, -2, 2.5), (0, 0, 0)))
    instances = half_plane().instances(np.eye(4))
    free = mp.relief_hits(camera, instances).depth
    wall = np.where(np.arange(60) < 30, 1.5, 10.0) * np.ones((40, 1))
    hits = mp.relief_hits(camera, instances, wall)
    assert (hits.depth[:, 30:] == free[:, 30:]).all() and np.isinf(hits.depth[:, :30]).all()
    assert np.isfinite(free[:, :30]).any()


def scene_of(mesh, **more) -> mp.Scene:
    """Ground, and light from above, beside a thing."""
    ground = mp.builtin_mesh("plane").transformed(np.diag([8.0, 8, 1, 1]))
    lights = (mp.DirectionalLight((0.5, 0.4, -0.8)), mp.PointLight((-3.0, -2, 5), (9, 8, 7)))
    eye = mp.look_at((2.5, -4, 3), (0, 0, 0.4), (0, 0, 1))
    camera = mp.Pinhole.from_fov(120, 90, np.radians(48), camera_from_world=eye)
    return mp.Scene((ground, *mesh), camera, lights, background=(0.1, 0.2, 0.4), **more)


CUBE = mp.builtin_mesh("cube").transformed(turned((0, 0, 1), 0.0, (0, 0, 0.5), 0.5))
TWO = np.array([turned((0, 0, 1), 0.4, (0.9, 0.5, 0)), turned((0, 0, 1), -0.6, (-0.8, -0.3, 0), 1.2)])
"""Upright on the ground."""


def near_edges(numbers, pixels=1) -> np.ndarray:
    """Pixels with another number among their neighbors."""
    padded = np.pad(numbers, pixels, mode="edge")
    height, width = numbers.shape
    near = np.zeros(numbers.shape, bool)
    for i in range(2 * pixels + 1):
        for j in range(2 * pixels + 1):
            near |= padded[i : i + height, j : j + width] != numbers
    return near


def test_a_box_has_its_silhouette_and_its_looks():
    tile = mp.Mesh.concatenate([CUBE])
    relief = mp.Relief.render(tile, size=256)
    scene = scene_of(())
    whole = scene_of([tile.transformed(matrix) for matrix in TWO])
    camera = scene.camera
    truth = mp.rasterize(camera, whole, "raytrace")
    ground = scene.mesh.triangle_count
    thing = np.where(truth.triangle >= ground, (truth.triangle - ground) // tile.triangle_count, -1)
    hits = mp.relief_hits(camera, relief.instances(TWO), mp.rasterize(camera, scene).depth)
    wrong = hits.instance != thing
    assert not (wrong & ~near_edges(thing)).any()
    assert wrong.mean() < 0.005
    right = ~wrong & (thing >= 0)
    assert np.percentile(np.abs(hits.depth[right] - truth.depth[right]), (50, 99)) == pytest.approx(0, abs=5e-3)
    inner = ~near_edges(truth.triangle, 2)
    with_relief = replace(scene, reliefs=relief.instances(TWO))
    for shading, shadows in (("color", False), ("normal", False), ("light", False), ("light", True)):
        image = mp.render(camera, with_relief, shading=shading, shadows=shadows)
        other = mp.render(camera, whole, "raytrace", shading=shading, shadows=shadows)
        off = np.abs(image - other).max(-1)
        assert np.median(off[thing >= 0]) < 2e-3
        assert (off[inner] > 0.02).mean() < (0.01 if shadows else 1e-3)


@pytest.mark.parametrize("casts", ["on the ground", "on the relief"])
def test_shadows_fall_both_ways(casts):
    """The shadow of the relief is that of the mesh; and a roof over it leaves all of it dark."""
    relief = mp.Relief.render(CUBE, size=192)
    scene = scene_of(())
    if casts == "on the relief":
        roof = mp.builtin_mesh("plane").transformed(turned((0, 0, 1), 0, (-1, -1, 2.2), 3.0))
        scene = replace(scene, meshes=(*scene.meshes, roof), lights=scene.lights[:1])
    pictures = []
    meshes = (*scene.meshes, *(CUBE.transformed(matrix) for matrix in TWO))
    for one in (replace(scene, reliefs=relief.instances(TWO)), replace(scene, meshes=meshes)):
        lit, dark = (mp.render(scene.camera, one, shadows=shadows) for shadows in (False, True))
        pictures.append(np.abs(lit - dark).max(-1) > 0.02)
    ours, true = pictures
    assert true.mean() > 0.03
    assert (ours != true).mean() < 0.12 * true.mean()
    if casts == "on the relief":
        copies = replace(scene, reliefs=relief.instances(TWO))
        up = mp.render(scene.camera, copies, shading="normal")[..., 2] > 0.99
        top = mp.ReliefPicture(copies).seen()[1].mask & up
        assert top.sum() > 20 and ours[top].mean() > 0.95


def test_only_texels_of_the_key_take_the_colors_of_instances():
    camera = mp.Pinhole.from_fov(
        80, 60, np.radians(60), camera_from_world=mp.look_at((0, -0.1, 6), (0, 0, 0), (0, 1, 0))
    )
    places = [turned((0, 0, 1), 0, (x, 0, 0)) for x in (-1.4, 1.4)]
    colors = np.array([(0.0, 0.9, 0.3), (0.5, 0.0, 1.0)])
    relief = half_plane()
    for given in (None, colors):
        scene = mp.Scene((), camera, background=(0.0, 0.0, 0.0), reliefs=relief.instances(places, given))
        image = mp.render(camera, scene, shading="texture")
        hits = mp.relief_hits(camera, scene.reliefs)
        ray = camera.ray(grid(camera))
        x = (ray.origin + np.where(hits.mask, hits.depth, 0)[..., None] * ray.direction)[..., 0]
        for number, place in enumerate(places):
            own, local = hits.instance == number, x - place[0, 3]
            keyed = own & (local < -0.55)
            rest = own & (local > -0.45)
            assert keyed.sum() > 20 and rest.sum() > 20
            paint = (0.8, 0.1, 0.0) if given is None else given[number]
            assert image[keyed] == pytest.approx(np.broadcast_to(paint, image[keyed].shape), abs=1e-5)
            assert image[rest] == pytest.approx(np.broadcast_to((0.2, 0.4, 0.6), image[rest].shape), abs=1e-5)
        assert (image[~hits.mask] == 0).all()


def test_shades_of_the_key_are_kept():
    """Texels by a mask, half as bright as their mean or half as bright again, are so in another color."""
    side = 16
    camera = mp.Orthographic(side, side, camera_from_world=mp.look_at((0, 0, 1), (0, 0, 0), (0, 1, 0)))
    shade = np.where(np.arange(side) < 8, 0.5, 1.5)[None, :, None] * np.array((0.4, 0.2, 0.0))
    color = np.broadcast_to(shade, (side, side, 3))
    relief = mp.Relief(
        mp.DepthImage(camera, np.full((side, side), 0.8), color=color),
        [(-1, -1, 0), (1, 1, 0.5)],
        mask=np.ones((side, side), bool),
    )
    assert relief.key == pytest.approx((0.4, 0.2, 0.0))
    image = mp.render(camera, mp.Scene((), reliefs=relief.instances(np.eye(4), [(0.1, 0.6, 0.8)])), shading="color")
    assert image[8, 3] == pytest.approx((0.05, 0.3, 0.4), abs=1e-5)
    assert image[8, 12] == pytest.approx((0.15, 0.9, 1.2), abs=1e-5)


def test_a_bent_eye_sees_what_its_pieces_meet():
    """A single-pole camera as the eye: first hits on the mesh by tracing its pieces one by one."""
    eye = mp.SinglePoleOcclusion.around(72, 60, (0, 0, 0.5), 1.6, (2.5, -4.5, 3.5), 1.0)
    truth = mp.rasterize(eye, mp.Scene(tuple(CUBE.transformed(m) for m in TWO)), "raytrace")
    hits = mp.relief_hits(eye, mp.Relief.render(CUBE, size=256).instances(TWO))
    inside = ~near_edges(truth.triangle)
    assert truth.mask.mean() > 0.1
    assert (hits.mask == truth.mask)[inside].mean() > 0.998
    both = hits.mask & truth.mask & inside
    assert np.abs(hits.depth[both] - truth.depth[both]).max() < 0.03


def test_around_a_thing_less_is_missing_than_from_above():
    """A ball, whose lower half parallel rays from above do not see; layers do."""
    ball = mp.builtin_mesh("sphere", 1280).transformed(turned((0, 0, 1), 0, (0, 0, 1)))
    camera = mp.Pinhole.from_fov(90, 70, np.radians(40), camera_from_world=mp.look_at((1, -4, 2), (0, 0, 1)))
    truth = mp.rasterize(camera, ball, "raytrace").mask
    missing = {}
    for name, given in {
        "single_pole": {"camera": "single_pole"},
        "orthographic": {"camera": "orthographic"},
        "layered": {"camera": "orthographic", "layers": 2},
    }.items():
        relief = mp.Relief.render(ball, size=128, lit=False, **given)
        missing[name] = (truth & ~mp.relief_hits(camera, relief.instances(np.eye(4))).mask).mean()
    assert missing["orthographic"] > 0.05
    assert missing["single_pole"] < 0.25 * missing["orthographic"]
    assert missing["layered"] < 0.5 * missing["orthographic"]


def test_cameras_of_tiles_hold_them():
    box = np.array([(-2.0, -0.6, 0), (2.0, 1.0, 1.3)])
    corners = np.array([(x, y, z) for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])
    for kind, given in (("orthographic", {}), ("single_pole", {}), ("single_pole", {"top": 0.4, "height": 1.0})):
        camera = relief_camera(kind, box, 100, **given)
        found = camera.project(corners)
        assert found.valid.all() and (found.pixel > -0.51).all()
        assert (found.pixel[:, 0] < np.array([camera.width, camera.height]) + 0.51).all()
        assert found.pixel.max() > 90
    assert top_in_middle(CUBE, np.array([(-1.0, -1, 0), (1.2, 1.1, 2)])) == pytest.approx(1.0)
    assert top_in_middle(CUBE, np.array([(5.0, -1, 0), (8.0, 1, 2)])) is None
    # What is in the middle is seen there: bent rays begin below it.
    sunk = CUBE.transformed(turned((0, 0, 1), 0, (0, 0, -0.5)))
    wide = np.array([(-1.0, -1, -1), (1, 1, 1.5)])
    image = mp.depth_map(relief_camera("single_pole", wide, 65, top=top_in_middle(sunk, wide)), sunk)
    assert np.isfinite(image.depth[30:35, 30:35]).all()


def test_nothing_is_seen_where_nothing_is():
    relief = half_plane(8)
    camera = mp.Pinhole.from_fov(1, 1, 0.5)
    for placements in (np.zeros((0, 4, 4)), [turned((0, 0, 1), 0, (0, 0, -5))]):
        hits = mp.relief_hits(camera, relief.instances(placements))
        assert hits.depth.shape == (1, 1) and np.isinf(hits.depth).all() and (hits.instance == -1).all()
        assert (hits.relief == -1).all() and not hits.mask.any()
        scene = mp.Scene((), camera, background=(0.1, 0.2, 0.3), reliefs=relief.instances(placements))
        assert mp.render(camera, scene)[0, 0] == pytest.approx((0.1, 0.2, 0.3))
    assert len(mp.relief_hits(camera, []).parts) == 0


def test_an_eye_within_a_box_looks_out_of_it():
    camera = mp.Pinhole.from_fov(9, 9, 0.3, camera_from_world=mp.look_at((-0.4, 0, 0.8), (-0.4, 0.1, 0)))
    agrees_at = mp.relief_hits(camera, half_plane().instances(np.eye(4))).depth
    assert agrees_at == pytest.approx(expected(camera, [np.eye(4)])[0], rel=1e-4)


REFUSED = {
    "no image": (lambda: mp.Relief(3, [(0, 0, 0), (1, 1, 1)]), "DepthImage"),
    "flat box": (lambda: mp.Relief(half_plane().images, [(0, 0, 0), (1, 1, 0)]), "box"),
    "no color": (
        lambda: mp.Relief(mp.DepthImage(mp.Orthographic(4, 4), np.ones((4, 4))), [(0, 0, 0), (1, 1, 1)]),
        "color",
    ),
    "mask": (
        lambda: mp.Relief(half_plane(8).images, [(0, 0, 0), (1, 1, 1)], mask=np.ones((4, 4), bool)),
        r"\(8, 8\) bool",
    ),
    "key": (lambda: mp.Relief.render(CUBE, key="paint"), "no material has this name"),
    "camera": (lambda: mp.Relief.render(CUBE, "above"), "orthographic"),
    "flattened": (lambda: half_plane().instances(np.diag([1.0, 1, 0, 1])), "flattens"),
    "projective": (lambda: half_plane().instances(np.diag([1.0, 1, 1, 2])), "affine"),
    "NaN": (lambda: half_plane().instances(np.full((2, 4, 4), np.nan)), "affine"),
    "shape": (lambda: half_plane().instances(np.ones((4, 3))), r"\(N, 4, 4\)"),
    "colors": (lambda: half_plane().instances(np.eye(4), np.ones((2, 3))), "one for each"),
    "scene": (lambda: mp.Scene((), reliefs=CUBE), "ReliefInstances"),
    "depth": (
        lambda: mp.relief_hits(mp.Orthographic(4, 4), half_plane().instances(np.eye(4)), np.ones(3)),
        "16 pixels",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_mistakes_are_told(case):
    make, words = REFUSED[case]
    with pytest.raises(mp.InputError, match=words):
        make()


def test_a_mirror_shows_no_reliefs():
    mirror = mp.Mirror(mp.Surface.sphere(1.0))
    scene = mp.Scene((CUBE,), EYES["pinhole"](np.eye(4)), mirror=mirror, reliefs=half_plane().instances(np.eye(4)))
    with pytest.raises(mp.InputError, match="mirror shows no reliefs"):
        mp.render(scene.camera, scene)
