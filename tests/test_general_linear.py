"""General linear cameras: kinds, slits, projection and boxes, against independent constructions."""

import json

import numpy as np
import pytest
from catalog import POSE

import mpcam as mp

GL = mp.GeneralLinear
KINDS = ("pinhole", "orthographic", "pushbroom", "cross_slit", "pencil", "twisted_orthographic", "bilinear")


def examples(width=64, height=48, pose=None):
    found = {camera.kind: camera for camera in GL.examples(width, height, pose).values()}
    return found | {"epi": GL.epi(width, height, 0.1, camera_from_world=pose)}


def random_pixels(camera, count, seed=0):
    return np.random.default_rng(seed).uniform(0, 1, (count, 2)) * [camera.width, camera.height]


def gap(ray, line):
    """Distances of rays from a line, relative to those of the points in question."""
    normal = np.cross(ray.direction, line.direction)
    offset = ray.origin - line.point
    size = np.linalg.norm(offset, axis=-1) + np.linalg.norm(line.point)
    return np.abs((offset * normal).sum(-1)) / np.linalg.norm(normal, axis=-1) / size


def jordan(kind, rng):
    """M of (sigma, tau) = M (u, v) + m0, in the normal form of a kind."""
    a, b = rng.uniform(0.2, 1.5, 2) * rng.choice([-1, 1], 2)
    return np.array(
        {
            "pinhole": [[a, 0], [0, a]],
            "orthographic": [[0, 0], [0, 0]],
            "pushbroom": [[a, 0], [0, 0]],
            "cross_slit": [[a, 0], [0, a + np.copysign(0.3 + abs(b), a)]],
            "pencil": [[a, 1], [0, a]],
            "twisted_orthographic": [[0, 1], [0, 0]],
            "bilinear": [[a, -b], [b, a]],
        }[kind],
        float,
    )


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("kind", KINDS)
def test_kinds_are_told_apart_whatever_the_generators(kind, dtype):
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(20):
        turn, places = rng.normal(size=(2, 2)), rng.normal(size=(3, 2))
        while abs(np.linalg.det(turn)) < 0.3 or abs(np.linalg.det(places[1:] - places[0])) < 0.3:
            turn, places = rng.normal(size=(2, 2)), rng.normal(size=(3, 2))
        matrix = turn @ jordan(kind, rng) @ np.linalg.inv(turn)
        slopes = places @ matrix.T + rng.normal(size=2)
        camera = GL(np.concatenate([slopes, places], axis=1).astype(dtype), 64, 48)
        assert camera.kind == kind, (camera.margin, camera.nearest_kind)
        assert camera.margin > 1e-3 and camera.nearest_kind != kind
        values = np.linalg.eigvals(matrix)
        if kind in ("cross_slit", "pencil", "pinhole"):
            depths = sorted(set(np.round(-1 / values.real, 4)))
            assert np.allclose(sorted(set(np.round(camera.domain.slit_depths, 4))), depths, rtol=2e-3 / camera.margin)


@pytest.mark.parametrize("kind", [*KINDS, "epi"])
def test_kinds_survive_motions_and_scales_of_the_world(kind):
    """Rays of a camera moved, turned and scaled in space: three of them make a camera of the same kind."""
    rng = np.random.default_rng(7)
    camera = examples(pose=POSE)[kind]
    axis = np.asarray(camera.camera_from_world)[2, :3]
    for scale in 10.0 ** rng.uniform(-8, 8, 20):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        ray = camera.ray(random_pixels(camera, 3, rng.integers(1 << 30)))
        origins = scale * (ray.origin @ turn.T + rng.normal(size=3))
        again = GL.from_rays(origins, rng.uniform(0.1, 9, (3, 1)) * (ray.direction @ turn.T), normal=turn @ axis)
        assert again.kind == kind, (scale, again.kind, again.margin)


@pytest.mark.parametrize("kind", [*KINDS, "epi"])
def test_rays_are_those_of_their_kind(kind):
    camera = examples(pose=POSE)[kind]
    assert camera.kind == kind
    ray = camera.ray(random_pixels(camera, 100_000))
    slits = {"cross_slit": 2, "pushbroom": 1, "pencil": 1}.get(kind, 0)
    assert len(camera.slits) == slits
    for slit in camera.slits:
        assert gap(ray, slit).max() < 1e-10
        assert abs(np.linalg.norm(slit.direction) - 1) < 1e-14
    # what else makes the kind, by its own definition
    pairs = np.random.default_rng(1).integers(0, len(ray.valid), (2, 2000))
    d, e = (ray.direction[p] for p in pairs)
    triple = np.abs((np.cross(d, e) * (ray.origin[pairs[0]] - ray.origin[pairs[1]])).sum(-1))
    if kind == "pinhole":
        away = ray.origin - camera.center
        assert np.linalg.norm(away - (away * ray.direction).sum(-1)[:, None] * ray.direction, axis=-1).max() < 1e-12
    elif kind == "orthographic":
        assert np.abs(d - e).max() < 1e-14
    elif kind == "epi":
        assert triple.max() < 1e-14 and camera.center is None
    elif kind == "bilinear":
        assert (triple > 0).all()  # no two rays meet
    elif kind in ("pushbroom", "twisted_orthographic"):
        # all rays are parallel to one plane
        assert np.linalg.svd(ray.direction, compute_uv=False)[2] < 1e-9 * np.sqrt(len(ray.direction))
    elif kind == "pencil":
        # rays through one point of the slit lie in one plane with it
        rows = camera.ray(np.stack([np.linspace(0, camera.width, 50), np.full(50, 11.25)], -1))
        assert np.linalg.norm(rows.origin - rows.origin[0], axis=1).max() < 1e-14
        planes = np.cross(rows.direction, camera.slits[0].direction)
        assert np.abs(np.cross(planes, planes[0])).max() < 1e-14


def test_pinhole_and_orthographic_are_the_plain_ones():
    """Rays, images, hits."""
    mesh = mp.builtin_mesh("facade")
    pose = mp.builtin_scene("facade").camera.camera_from_world
    for general, plain in (
        (GL.pinhole(160, 120, 90, 95, 70, 62, pose), mp.Pinhole(160, 120, 90, 95, 70, 62, pose)),
        (GL.orthographic(160, 120, 9, 75, 61, pose), mp.Orthographic(160, 120, 9, 75, 61, pose)),
    ):
        pixels = random_pixels(plain, 5000)
        mine, theirs = general.ray(pixels), plain.ray(pixels)
        assert np.abs(mine.origin - theirs.origin).max() < 1e-12
        assert np.abs(mine.direction - theirs.direction).max() < 1e-14
        points = theirs.origin + np.random.default_rng(2).uniform(0.1, 20, (5000, 1)) * theirs.direction
        mine, theirs = general.project(points), plain.project(points)
        assert mine.valid.all() and np.abs(mine.pixel - theirs.pixel).max() < 1e-10
        assert np.abs(mine.depth - theirs.depth).max() < 1e-12
        mine, theirs = mp.rasterize(general, mesh), mp.rasterize(plain, mesh)
        assert theirs.mask.mean() > 0.1 and (mine.triangle != theirs.triangle).mean() < 2e-4


def test_one_camera_triangle_in_a_plane_is_one_too():
    """Hou's camera with rays of equal normal components, and three rays: the same map (FORMULAS 4)."""
    rng = np.random.default_rng(3)
    corners, ways = rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    ways *= np.sign(ways @ normal)[:, None]
    triangle = mp.CameraTriangles(corners, [[0, 1, 2]], directions=ways, ray_scale="plane", resolution=64)
    one = GL.from_rays(corners, ways, normal=normal)
    shares = rng.dirichlet(np.ones(3), 500)
    ray = one.ray(shares[:, 1:] * [one.width, one.height])
    there = triangle.ray_at(np.zeros(500, int), shares[:, 1], shares[:, 2])
    assert np.abs(ray.origin - there[0].T).max() < 1e-13
    assert np.abs(np.cross(ray.direction, there[1].T)).max() < 1e-12 * np.abs(there[1]).max()


def test_the_image_spans_u_and_v_from_0_to_1():
    rays = np.array([[0.1, 0.2, 0, 0], [0.5, -0.1, 1, 0], [-0.2, 0.4, 0, 1.0]])
    camera = GL(rays, 100, 50)
    for (x, y), (sigma, tau, u, v) in zip(((0, 0), (100, 0), (0, 50)), rays, strict=True):
        ray = camera.ray([float(x), float(y)])
        assert np.allclose(ray.origin, [u, v, 0], atol=1e-15)
        assert np.allclose(ray.direction / ray.direction[2], [sigma, tau, 1], atol=1e-15)
    # other generators of the same family are the same camera
    weights = np.array([[0.2, 0.5, 0.3], [2.0, -0.4, -0.6], [-1.0, 1.5, 0.5]])
    other, pixels = GL(weights @ rays, 100, 50), random_pixels(camera, 100)
    assert np.allclose(other.ray(pixels).direction, camera.ray(pixels).direction, atol=1e-13)
    assert np.allclose(other.ray(pixels).origin, camera.ray(pixels).origin, atol=1e-13)


def near_ties(amount):
    """Cameras that a change of about `amount` makes another kind, with the two kinds."""
    places = [[0, 0], [1, 0], [0, 1]]
    for matrix, kinds in (
        ([[1, 0], [0, 1 + amount]], ("cross_slit", "pinhole")),
        ([[1, 1], [amount * amount / 4, 1]], ("cross_slit", "pencil")),
        ([[1, 1], [-amount * amount / 4, 1]], ("bilinear", "pencil")),
        ([[1, 0], [0, amount]], ("cross_slit", "pushbroom")),
        ([[amount, 1], [0, 0]], ("pushbroom", "pencil")),
        ([[amount, 1], [0, amount]], ("pencil", "pushbroom")),
        ([[1, amount], [0, 1]], ("pencil", "pinhole")),
        ([[amount, 0], [0, amount]], ("pinhole", "orthographic")),
        ([[0, amount], [0, 0]], ("twisted_orthographic", "orthographic")),
    ):
        slopes = np.array(places) @ np.array(matrix, float).T
        yield GL(np.concatenate([slopes, places], axis=1), 8, 8), kinds


def test_near_ties_have_a_small_margin():
    for amount in (1e-2, 1e-3, 1e-4):
        for camera, (kind, near) in near_ties(amount):
            # half way to a pinhole, crossed slits become a pencil
            nearest = ("pencil", "pinhole") if (kind, near) == ("cross_slit", "pinhole") else (near,)
            assert camera.kind == kind and camera.nearest_kind in nearest, (amount, kind)
            # between the two double roots lies the square of what the generators change by
            expected = amount * amount if "pencil" in (kind, near) and near != "pinhole" else amount
            assert 0.05 * expected < camera.margin < 2 * expected, (amount, kind, near, camera.margin)
    for camera, (kind, near) in near_ties(1e-12):
        if kind in ("cross_slit", "bilinear") or near == "pinhole":
            assert camera.kind == near != kind


def test_a_margin_is_as_much_as_it_takes():
    """Random changes smaller than the margin leave the kind as it is; some a few times as large do not."""
    rng = np.random.default_rng(5)
    found = 0
    for seed in range(60):
        rays = np.random.default_rng(seed).normal(size=(3, 4))
        camera = GL(rays, 8, 8)
        apart = np.array([np.linalg.norm(rays[1:, k : k + 2] - rays[0, k : k + 2]) for k in (0, 0, 2, 2)])
        if camera.margin < 0.02:
            continue
        changes = rng.normal(size=(300, 3, 4))
        changes /= np.linalg.norm(changes, axis=(1, 2), keepdims=True)
        kinds = {GL(rays + 0.3 * camera.margin * apart * change, 8, 8).kind for change in changes}
        assert kinds == {camera.kind}, (seed, camera.margin)
        found += len({GL(rays + 4.0 * camera.margin * apart * change, 8, 8).kind for change in changes}) > 1
    assert found > 10


def test_not_a_camera_is_said():
    flat = GL([[0, 0, 0, 0], [1, 0, 0, 0], [2, 0, 0, 0]], 8, 8)
    assert flat.kind == "not a camera" and flat.slits == () and flat.center is None
    ruling = np.array([[0.0, 0, 0, 0], [1, 2, 3, 4], [2, 4, 6, 8]])
    assert GL(ruling, 8, 8).kind == "not a camera"
    # three rays of one ruling are a camera of two dimensions, as long as they are no affine family of one
    assert GL(ruling + [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0]], 8, 8).kind != "not a camera"


def test_points_of_slits_and_before_the_plane_have_no_image():
    camera = GL.examples(64, 48)["cross slit in the scene"]
    for slit in camera.slits:
        points = slit.point + np.linspace(-2, 2, 41)[:, None] * slit.direction
        aside = points + np.random.default_rng(0).normal(size=(41, 3)) * np.array([1, 1, 0]) @ np.eye(3)
        aside = points + (aside - points) @ np.diag([1, 1, 0])
        for given in (points, aside):
            image = camera.project(given)
            assert not image.valid.any() and (image.pixel == 0).all() and (image.depth == 0).all()
    behind = camera.ray([30.0, 20.0])
    assert not camera.project(behind.origin - 0.3 * behind.direction).valid.any()
    assert not GL.epi(64, 48, 0.1).project(np.random.default_rng(1).normal(size=(50, 3))).valid.any()
    assert GL.orthographic(64, 48).project([[0.2, 0.1, 0.0]]).valid.all()


def test_boxes_across_slits_are_open_where_images_are():
    camera = GL.examples(64, 48)["cross slit in the scene"]
    (near, far) = (slit.point[2] for slit in camera.slits)
    assert near < 0.9 < far
    z = far + 0.7
    safe = np.array([[0.1, 0.1, z], [0.3, 0.1, z + 0.1], [0.1, 0.4, z]])
    box = camera.bound(safe)
    assert box.valid and (np.abs([box.low, box.high]) < 1e4).all()
    across = safe + [[0, 0, -1.5], [0, 0, 0], [0, 0, 0]]
    box = camera.bound(across)
    assert box.valid and np.abs([box.low, box.high]).max() == 1e9
    assert not camera.bound(safe - [0, 0, 9]).valid


def test_hits_of_triangles_across_slits_are_those_of_brute_force():
    from ray_fields import wrong_pixels

    mesh = mp.Mesh(
        np.array([[-2.0, -2, 0.2], [2.5, -2, 2.5], [0, 2.4, 4.0], [-2, 1, 3.0], [2, 2, 0.1], [0.1, -2.5, 2.4]]),
        [[0, 1, 2], [3, 4, 5]],
    )
    camera = GL.examples(96, 72)["cross slit in the scene"]
    hits = mp.rasterize(camera, mesh)
    assert hits.mask.mean() > 0.3 and wrong_pixels(camera, mesh, hits) == 0


def test_cross_slits_from_lines_show_their_target():
    rng = np.random.default_rng(8)
    for _ in range(10):
        first, second = (rng.normal(size=3), rng.normal(size=3)), (rng.normal(size=3), rng.normal(size=3))
        target, up = 5 * rng.normal(size=3), rng.normal(size=3)
        camera = GL.cross_slit(60, 40, first, second, target, 1.5, up)
        assert camera.kind == "cross_slit"
        ray = camera.ray(random_pixels(camera, 1000))
        for point, direction in (first, second):
            assert gap(ray, mp_line(point, direction)).max() < 1e-9
        middle = camera.ray([30.0, 20.0])
        way = target - middle.origin
        assert np.linalg.norm(np.cross(way, middle.direction)) < 1e-12 * np.linalg.norm(way) + 1e-12
        # the plane through the target parallel to both slits is shown 1.5 wide and 1 high
        normal = np.cross(first[1], second[1])
        ends = [camera.ray([float(x), float(y)]) for x, y in ((0, 20), (60, 20), (30, 0), (30, 40))]
        at = [e.origin + ((target - e.origin) @ normal) / (e.direction @ normal) * e.direction for e in ends]
        assert np.isclose(np.linalg.norm(at[0] - at[1]), 1.5) and np.isclose(np.linalg.norm(at[2] - at[3]), 1.0)
        assert (at[2] - at[3]) @ up >= -1e-12


def mp_line(point, direction):
    from mpcam.cameras.general_linear_kinds import Line

    return Line(np.asarray(point), np.asarray(direction) / np.linalg.norm(direction))


def test_files_and_tables(tmp_path):
    from mpcam.cameras.serialize import camera_from_json, camera_to_json

    for camera in examples(pose=POSE).values():
        assert camera_from_json(camera_to_json(camera)) == camera
        assert json.loads(camera_to_json(camera))["model"] == "GeneralLinear"
    single = GL(np.asarray(examples()["bilinear"].rays, np.float32), 64, 48)
    assert camera_from_json(camera_to_json(single)) == single


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: GL(np.zeros((2, 4)), 8, 8), "shape (2, 4): give (3, 4)"),
        (lambda: GL(np.full((3, 4), np.nan), 8, 8), "NaN"),
        (lambda: GL("rays", 8, 8), "not an array"),
        (lambda: GL(np.eye(3, 4), 8, 8, image=[[0, 0], [1, 1], [2, 2]]), "one line"),
        (lambda: GL(np.eye(3, 4), 8, 0), "height=0"),
        (lambda: GL.from_rays(np.eye(3), np.zeros((3, 3))), "direction 0 is zero"),
        (lambda: GL.from_rays(np.eye(2), np.eye(3)), "origins has shape (2, 2)"),
        (lambda: GL.from_rays(np.eye(3), [[0, 0, 1], [0, 0, 1], [0, 0, -1]]), "direction 2 does not leave"),
        (lambda: GL.from_rays(np.eye(3), np.eye(3), normal=[0, 0, 1]), "another normal="),
        (lambda: GL.pushbroom(8, 8, 0.0), "another kind"),
        (lambda: GL.pushbroom(8, 8, "fast"), "a finite number"),
        (lambda: GL.pinhole(8, 8, -1), "above 0"),
        (
            lambda: GL.cross_slit(8, 8, ([0, 0, 0], [1, 0, 0]), ([0, 0, 1], [2, 0, 0]), [0, 0, 3], 1),
            "slits are parallel",
        ),
        (
            lambda: GL.cross_slit(8, 8, ([0, 0, 0], [1, 0, 0]), ([0, 0, 1], [0, 1, 0]), [5, 5, 1], 1),
            "no two of these may be equal",
        ),
        (lambda: GL.cross_slit(8, 8, 3, ([0, 0, 1], [0, 1, 0]), [5, 5, 1], 1), "a point (3,) and a direction"),
        (
            lambda: GL.cross_slit(8, 8, ([0, 0, 0], [1, 0, 0]), ([0, 0, 1], [0, 1, 0]), [5, 5, 2], [1, 2, 3]),
            "a width and a height",
        ),
    ],
)
def test_mistakes_are_named(make, words):
    with pytest.raises(mp.InputError) as caught:
        make()
    assert words in str(caught.value) and "\n" not in str(caught.value)
