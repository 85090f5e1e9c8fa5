"""The test kit: what every camera promises. A check takes any camera, and knows no more of it than its capabilities.

`CHECKS` holds them with what each needs; `files_keep_it` is for cameras of the register, which files can hold.
"""

import copy
import pickle
from collections.abc import Callable
from typing import Any, NamedTuple

import bent_cameras
import drjit.llvm as device
import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
from catalog import soup
from ray_fields import wrong_pixels
from triangle_cameras import centers

import mpcam as mp
from mpcam.backend import aligned
from mpcam.cameras.capabilities import Bends, Bounds, HasRays, Projects
from mpcam.cameras.registry import snake_case
from mpcam.cameras.serialize import camera_from_json, camera_to_json
from mpcam.cameras.tables import fits_a_table
from mpcam.io.scene_camera import camera_to_toml
from mpcam.tracing.meshes import mitsuba_mesh

FEW = 4
"""Images of a point that JAX and Dr.Jit are asked for: compiling those of many camera triangles takes a minute."""

MOTION = np.linalg.inv(mp.look_at((1.0, -2.0, 0.5), (0.3, 0.4, -0.2)))
"""A rigid motion of the world."""

STEPS = 40
_ROWS = np.array([(i, j) for i in range(STEPS + 1) for j in range(STEPS + 1 - i)]) / STEPS
WEIGHTS = np.stack([_ROWS[:, 0], _ROWS[:, 1], 1 - _ROWS.sum(1)], -1)


def scene() -> mp.Mesh:
    """Walls with openings, triangles of all sizes on all sides of the origin, and a ball of tiny ones."""
    room, ball = np.eye(4), np.diag([0.3, 0.3, 0.3, 1.0])
    room[2, 3], ball[:3, 3] = -1.0, (0.9, 1.2, 0.8)
    walls = mp.builtin_mesh("quad_room").transformed(room)
    walls = mp.Mesh(walls.vertices, walls.faces[1::2])
    return mp.Mesh.concatenate([walls, mp.builtin_mesh("sphere", triangles=20480).transformed(ball), soup(700, 11)])


def inner_pixels(camera: mp.Camera, count: int, margin: float = 1e-3, seed: int = 0) -> np.ndarray:
    """Random pixels (count, 2) that have rays, as have those at `margin` pixels around them."""
    rng = np.random.default_rng(seed)
    angle = np.arange(8) * np.pi / 4
    around = margin * np.stack([np.cos(angle), np.sin(angle)], -1)
    found = np.zeros((0, 2))
    for _ in range(100):
        pixels = rng.uniform(0, 1, (2 * count, 2)) * [camera.width, camera.height]
        inside = camera.ray(np.concatenate([pixels[:, None], pixels[:, None] + around], 1)).valid.all(-1)
        found = np.concatenate([found, pixels[inside]])
        if len(found) >= count:
            return found[:count]
    raise AssertionError("hardly a pixel has a ray")


def points_on(ray: mp.Ray, distance: np.ndarray) -> np.ndarray:
    return ray.origin + distance[..., None] * ray.direction


def along(camera: mp.Camera, pixels: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points so far along the rays of pixels (N, 2), bent ones too, and whether the rays are that long."""
    if not isinstance(camera, Bends):
        return points_on(camera.ray(pixels), distance), np.ones(len(pixels), bool)
    pieces = camera.ray_pieces(pixels)
    inside = pieces.valid & (pieces.start <= distance[:, None]) & (distance[:, None] <= pieces.end)
    row, piece = np.arange(len(pixels)), inside.argmax(1)
    rest = distance - pieces.start[row, piece]
    return pieces.origin[row, piece] + rest[:, None] * pieces.direction[row, piece], np.asarray(inside.any(1))


# Rays and images


def rays_are_rays(camera: mp.Camera) -> None:
    """Unit directions and the shapes of the input; what is no number has no ray, and no NaN comes back."""
    ray = camera.ray(centers(camera))
    shape = (camera.height, camera.width)
    assert ray.valid.shape == shape and ray.origin.shape == ray.direction.shape == (*shape, 3)
    assert np.abs(np.linalg.norm(ray.direction[ray.valid], axis=-1) - 1).max() < 1e-14
    assert np.isfinite(ray.origin).all() and np.isfinite(ray.direction).all()
    bad = camera.ray([[np.nan, 3.0], [3.0, np.inf], [-np.inf, np.nan]])
    assert not bad.valid.any() and np.isfinite(bad.origin).all() and np.isfinite(bad.direction).all()
    if camera.ray_geometry == "central":
        assert np.abs(ray.origin[ray.valid] - camera.eye).max() < 1e-13
    if camera.ray_geometry == "parallel":
        axis = np.asarray(camera.camera_from_world)[2, :3]
        assert np.abs(ray.direction[ray.valid] - axis).max() < 1e-14


def points_on_rays_come_back(camera: mp.Camera) -> None:
    """Pixel to ray to points at several depths: the pixel is among their images, at that depth."""
    pixels = inner_pixels(camera, 300)
    distance = 10 ** np.random.default_rng(1).uniform(-2, 2, 300)
    points, there = along(camera, pixels, distance)
    assert there.mean() > 0.5
    pixels, distance = pixels[there], distance[there]
    image = camera.project(points[there])
    off = np.where(image.valid, np.abs(image.pixel - pixels[:, None]).max(-1), np.inf)
    best = off.argmin(1)
    found = off.min(1) < 1e-7 * max(camera.width, camera.height)
    # Where rays are bent, images are looked for from a few starts, which may lie too far off near folds.
    assert found.mean() >= (1.0 if camera.images_per_point == 1 else 0.97)
    depth = np.take_along_axis(image.depth, best[:, None], 1)[:, 0]
    assert np.allclose(depth[found], distance[found], rtol=1e-9)


def images_lie_on_their_rays(camera: mp.Camera) -> None:
    """Point to pixels to rays: each ray runs through the point, at the image's depth; nonsense has no image."""
    rng = np.random.default_rng(2)
    points, _ = along(camera, inner_pixels(camera, 400), np.full(400, 2.0))
    points = points + 10 ** rng.uniform(-3, 0.5, (400, 1)) * rng.normal(size=(400, 3))
    image = camera.project(points)
    assert image.pixel.shape == (400, camera.images_per_point, 2)
    which, number = np.nonzero(image.valid & camera.contains(image.pixel))
    assert len(which) > 20
    again, there = along(camera, image.pixel[which, number], image.depth[which, number])
    there &= isinstance(camera, Bends) | camera.ray(image.pixel[which, number]).valid
    assert there.mean() > 0.99  # rounding at the rim
    assert np.linalg.norm(again - points[which], axis=-1)[there].max() < 1e-7
    nonsense = camera.project([[np.nan, 0.0, 1], [np.inf, 1, 1], [0, -np.inf, 2]])
    assert not nonsense.valid.any() and np.isfinite(nonsense.pixel).all()
    if camera.ray_geometry == "central":
        assert not camera.project(camera.eye).valid.any()


def boxes_hold_their_triangles(camera: mp.Camera) -> None:
    """No sampled point of a triangle has an image outside of the triangle's box."""
    corners = soup(300, 3).corners
    low, high, seen = extent(camera, corners)
    assert seen.mean() > 0.1
    box = camera.bound(corners)
    bad = seen & (~box.valid | (box.low > low + 1e-9).any(-1) | (box.high < high - 1e-9).any(-1))
    assert not bad.any(), np.flatnonzero(bad)


def extent(camera: mp.Camera, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Extreme pixels of sampled points of triangles (N, 3, 3), and which triangles were seen at all."""
    image = camera.project(np.einsum("mk,nkc->nmc", WEIGHTS, corners))
    low = np.where(image.valid[..., None], image.pixel, np.inf).min((1, 2))
    high = np.where(image.valid[..., None], image.pixel, -np.inf).max((1, 2))
    return np.clip(low, -1e9, 1e9), np.clip(high, -1e9, 1e9), image.valid.any((1, 2))


# Poses and libraries


def moving_everything_changes_nothing(camera: mp.Camera) -> None:
    """Camera and scene at another place: the same rays there, the same images, the same hits."""
    moved = camera.with_pose(np.asarray(camera.camera_from_world) @ np.linalg.inv(MOTION))
    pixels = inner_pixels(camera, 200)
    here, there = camera.ray(pixels), moved.ray(pixels)
    assert np.allclose(there.origin, there_of(here.origin), atol=1e-12)
    assert np.allclose(there.direction, here.direction @ MOTION[:3, :3].T, atol=1e-13)
    if isinstance(camera, Projects):
        points, _ = along(camera, pixels, np.full(200, 1.5))
        first, second = camera.project(points), moved.project(there_of(points))
        same = first.valid & second.valid
        assert (first.valid == second.valid).mean() > 0.99
        assert np.allclose(first.pixel[same], second.pixel[same], atol=1e-6)
        assert np.allclose(first.depth[same], second.depth[same], atol=1e-8)
    mesh = scene()
    first, second = mp.rasterize(camera, mesh), mp.rasterize(moved, mesh.transformed(MOTION))
    assert (first.triangle != second.triangle).mean() < 1e-3


def there_of(points: np.ndarray) -> np.ndarray:
    return points @ MOTION[:3, :3].T + MOTION[:3, 3]


def float32_agrees(camera: mp.Camera) -> None:
    """JAX and Dr.Jit in single precision against NumPy in double, away from the rim."""
    pixels = inner_pixels(camera, 400, 0.1 * min(camera.width, camera.height))
    exact = camera.ray(pixels)
    kernels = camera.ray(device.Array2f(*map(aligned, pixels.T)))
    for origin, direction, valid in (
        camera.ray(jnp.asarray(pixels, jnp.float32)),
        (kernels.origin.numpy().T, kernels.direction.numpy().T, kernels.valid.numpy()),
    ):
        assert np.asarray(valid).all()
        assert np.abs(np.asarray(origin) - exact.origin).max() < 5e-6
        assert np.abs(np.asarray(direction) - exact.direction).max() < 5e-6
    if not isinstance(camera, Projects) or camera.images_per_point > FEW:
        return
    points, there = along(camera, pixels, np.full(400, 3.0))
    images = camera.project(device.Array3f(*map(aligned, points.T)))
    plain = camera.project(jnp.asarray(points, jnp.float32))
    for pixel, valid in (
        (np.stack([part.numpy().T for part in images.pixel], 1), np.stack([part.numpy() for part in images.valid], 1)),
        (np.asarray(plain.pixel), np.asarray(plain.valid)),
    ):
        off = np.where(valid, np.abs(pixel - pixels[:, None]).max(-1), np.inf).min(-1)[there]
        assert (off < 2e-3).mean() >= (1.0 if camera.images_per_point == 1 else 0.97)


def gradients_match_differences(camera: mp.Camera) -> None:
    """JAX, in reverse, in the inputs and every number of the camera, against central differences in float64."""
    pixels = inner_pixels(camera, 4, 1.0)
    if hasattr(camera, "cx"):
        pixels[0] = camera.cx, camera.cy  # type: ignore[attr-defined]
    with jax.enable_x64(True):
        leaves, tree = jax.tree_util.tree_flatten(camera)

        def rays(numbers, pixel):
            ray = jax.tree_util.tree_unflatten(tree, numbers).ray(pixel)
            return ray.origin, ray.direction

        compare_gradients(rays, leaves, pixels, whole=isinstance(camera, Bends))
        if not isinstance(camera, Projects) or camera.images_per_point > FEW:
            return
        points, _ = along(camera, pixels, np.full(4, 2.5))
        valid = camera.project(points).valid

        def images(numbers, point):
            image = jax.tree_util.tree_unflatten(tree, numbers).project(point)
            return tuple(jnp.where(valid[..., None], part, 0.0) for part in (image.pixel, image.depth[..., None]))

        compare_gradients(images, leaves, points, whole=isinstance(camera, Bends))


def compare_gradients(function: Callable[..., Any], leaves: list[Any], given: np.ndarray, whole: bool = False) -> None:
    """Of a random mean of the arrays that function(leaves, given) gives, along a random way in each leaf.

    whole: compiled as one, which is faster where one operation after the other are very many.
    """
    rng = np.random.default_rng(5)
    numbers = [np.asarray(leaf, np.float64) for leaf in (*leaves, given)]
    shapes = [np.shape(part) for part in function(numbers[:-1], numbers[-1])]
    weights = [rng.normal(size=shape) / np.prod(shape) for shape in shapes]

    def mean(values: Any) -> Any:
        return sum((w * part).sum() for w, part in zip(weights, function(values[:-1], values[-1]), strict=True))

    gradient = jax.jit(jax.grad(mean)) if whole else jax.grad(mean)
    exact = gradient([jnp.asarray(value) for value in numbers])
    for place, (value, found) in enumerate(zip(numbers, map(np.asarray, exact), strict=True)):
        assert np.isfinite(found).all()
        along = rng.normal(size=value.shape) * np.maximum(1.0, np.abs(value))
        ends = [mean([*numbers[:place], value + step * along, *numbers[place + 1 :]]) for step in (1e-6, -1e-6)]
        difference = float(ends[0] - ends[1]) / 2e-6
        assert abs((found * along).sum() - difference) < 1e-5 * max(1.0, abs(difference)), place


def is_a_pytree(camera: mp.Camera) -> None:
    """Flattened and put together again it is equal, and has the same rays."""
    leaves, tree = jax.tree_util.tree_flatten(camera)
    again = jax.tree_util.tree_unflatten(tree, leaves)
    assert again == camera
    assert tree == jax.tree_util.tree_structure(again)
    pixels = inner_pixels(camera, 10)
    assert np.allclose(again.ray(pixels).direction, camera.ray(pixels).direction, atol=1e-9)


# Files


def files_keep_it(camera: mp.Camera, folder: Any) -> None:
    """JSON, a table of a scene file, the header of an image, pickle and copy: each makes an equal camera."""
    for again in (camera_from_json(camera_to_json(camera)), pickle.loads(pickle.dumps(camera)), copy.deepcopy(camera)):
        assert again == camera and type(again) is type(camera)
        assert camera_to_json(again) == camera_to_json(camera)
    assert camera != camera.with_pose(np.asarray(camera.camera_from_world) @ MOTION)
    mp.write_image(folder / "image.exr", np.zeros((camera.height, camera.width, 3), np.float32), camera=camera)
    assert mp.read_camera(folder / "image.exr") == camera
    if fits_a_table(type(camera)):
        text = camera_to_toml(camera)
    else:
        (folder / "camera.json").write_text(camera_to_json(camera))
        text = f'[camera]\nmodel = "{snake_case(type(camera).__name__)}"\nfile = "camera.json"\n'
    (folder / "scene.toml").write_text(f'[[mesh]]\nbuiltin = "cube"\n{text}')
    assert mp.load_scene(folder / "scene.toml").scene.camera == camera


# Hits


def hits_are_those_of_brute_force(camera: mp.Camera) -> None:
    """Away from edges, no pixel differs from what float64 finds by trying every triangle."""
    mesh = soup(250, 12)
    hits = mp.rasterize(camera, mesh)
    assert hits.mask.any()
    with np.errstate(invalid="ignore"):  # differences of infinities
        wrong = bent_cameras.wrong_pixels if isinstance(camera, Bends) else wrong_pixels
        assert wrong(camera, mesh, hits) == 0


def hits_are_those_of_embree(camera: mp.Camera) -> None:
    """By `invert`, by ray tracing, and as a Mitsuba sensor, which rays must be straight for; and the order of the faces
    does not matter."""
    for mesh in (scene(), mp.builtin_mesh("temple")):
        hits, truth = mp.rasterize(camera, mesh), mp.rasterize(camera, mesh, method="raytrace")
        depths = [truth.depth]
        if not isinstance(camera, Bends):
            image = depth_image(mp.truth.sensor(camera, 1, centered=True), mesh)
            depths.append(np.where(image > 0, image, np.inf))
        assert hits.mask.mean() > 0.1
        for depth in depths:
            assert (hits.mask != np.isfinite(depth)).mean() <= 2e-4
            agree(hits, depth, near=0.0 if camera.ray_geometry == "central" else 0.05)
        same = hits.mask & (hits.triangle == truth.triangle)
        assert same.sum() > 0.995 * hits.mask.sum()
        assert np.abs(hits.barycentric - truth.barycentric)[same].max() < 0.02
        away = np.linalg.norm(hits.points[same] - truth.points[same], axis=-1)
        assert np.percentile(away, 99.9, method="higher") < 1e-3
        order = np.random.default_rng(3).permutation(mesh.triangle_count)
        other = mp.rasterize(camera, mp.Mesh(mesh.vertices, mesh.faces[order]))
        assert (np.where(other.mask, order[other.triangle], -1) != hits.triangle).mean() <= 2e-4


def agree(hits: mp.Hits, other: np.ndarray, near: float) -> None:
    """Depths of common hits, relative to the depth, or to `near` extents of the scene: rays that start anywhere have an
    absolute error."""
    both = hits.mask & np.isfinite(other)
    off = np.abs(hits.depth[both] - other[both]) / np.maximum(other[both], near * np.ptp(hits.mesh.bounds))
    assert (off <= 1e-4).mean() >= 0.999


def depth_image(sensor: dict[str, Any], mesh: mp.Mesh, samples: int = 1) -> np.ndarray:
    """(H, W) depth that Mitsuba renders through a sensor; 0 where nothing is hit."""
    mi.set_variant("llvm_ad_rgb")
    mp.truth.register()
    shape = mitsuba_mesh(mi, "mesh", mesh.vertices, mesh.faces)
    found = mi.load_dict({"type": "scene", "integrator": {"type": "depth"}, "mesh": shape, "sensor": sensor})
    return np.array(mi.render(found, spp=samples))[..., 0]


class Check(NamedTuple):
    """A check, the capability that it needs, the size of its cameras, and how many examples of a model it is for."""

    run: Callable[[mp.Camera], None]
    needs: type = HasRays
    size: tuple[int, int] = (64, 48)
    examples: int = 100


LARGE = (160, 120)
CHECKS = (
    Check(rays_are_rays),
    Check(points_on_rays_come_back, Projects),
    Check(images_lie_on_their_rays, Projects),
    Check(boxes_hold_their_triangles, Bounds),
    Check(moving_everything_changes_nothing, size=LARGE),
    Check(float32_agrees),
    Check(gradients_match_differences, examples=2),  # seconds each, to compile
    Check(is_a_pytree),
    Check(hits_are_those_of_brute_force),
    Check(hits_are_those_of_embree, size=LARGE),
)


def applying(cameras: dict[str, mp.Camera], check: Check) -> dict[str, mp.Camera]:
    """Those that a check is for, of examples of one size."""
    found: dict[str, mp.Camera] = {}
    for name, camera in cameras.items():
        alike = sum(type(other) is type(camera) for other in found.values())
        if isinstance(camera, check.needs) and alike < check.examples:
            found[name] = camera
    return found
