"""The whole comparison: what theory says of each method, and what happens when something is wrong."""

import json
import math

import numpy as np
import pytest

import mpcam
import mpcam.comparison
from mpcam.cameras import Orthographic, Radial
from mpcam.comparison.motion import moving_vertices
from mpcam.errors import InputError
from mpcam.geometry.mesh import Material, Mesh
from mpcam.math.pose import look_at
from mpcam.scene.scene import DirectionalLight, Scene

SIZE = 128
RESOLUTIONS = (32, 64, 128)


def wall() -> Mesh:
    """Eight triangles in front of the camera, textured, tilted so that depth varies."""
    u, v = np.meshgrid(np.linspace(-1, 1, 3), np.linspace(-1, 1, 3))
    vertices = np.stack([1.6 * u, 1.4 * v, 1.5 + 0.3 * u + 0.2 * v], -1).reshape(-1, 3)
    corner = np.array([0, 1, 3, 4])
    faces = np.array(
        [(corner[i] + a, corner[i] + b, corner[i] + c) for i in range(4) for a, b, c in ((0, 3, 1), (1, 3, 4))]
    )
    board = np.indices((8, 8)).sum(0)[..., None] % 2 * np.ones(3, np.float32) * 0.8 + 0.1
    return Mesh(vertices, faces, uv=np.stack([u, v], -1).reshape(-1, 2), materials=(Material(texture=board),))


def scene(camera=None, mesh=None) -> Scene:
    light = DirectionalLight((0.2, 0.3, 1.0))
    return Scene((mesh or wall(),), camera=camera or Radial.paraboloid(SIZE, SIZE), lights=(light,), name="wall")


@pytest.fixture(scope="module")
def compared() -> mpcam.Comparison:
    few = {"cubemap": RESOLUTIONS, "hemicube": RESOLUTIONS}
    return mpcam.compare(scene(), repeats=2, settings=few)


def test_compare_is_the_function_whatever_is_imported():
    assert callable(mpcam.compare)
    assert mpcam.compare is mpcam.comparison.compare


def test_every_method_and_setting_has_a_row(compared):
    assert [row.label for row in compared] == [
        "invert",
        *(f"vertex level {level}" for level in range(5)),
        *(f"cubemap {resolution}" for resolution in RESOLUTIONS),
        *(f"hemicube {resolution}" for resolution in RESOLUTIONS),
        "raytrace",
    ]
    assert compared.left_out == {}
    for name in ("still_ms", "moving_ms", "shade_ms", "compile_ms"):
        assert (compared.column(name) > 0).all()
    assert any(row.on_front for row in compared)
    assert set(compared.row("raytrace").stages_ms) >= {"build", "trace"}


def test_inversion_is_at_float_precision(compared):
    row = compared.row("invert")
    assert row.projection_p95 < 1e-3
    assert row.depth_p999 < 1e-5
    assert row.hit_mismatch < 1e-3
    assert row.triangle_mismatch == 0
    assert row.flip < 1e-3


def test_straight_edges_miss_curved_ones_by_a_quarter_per_level(compared):
    # the chord of an arc leaves it by h**2 / (8 r), and each level halves h
    for name in ("projection_median", "projection_p95"):
        errors = [getattr(compared.row("vertex", level), name) for level in range(5)]
        ratios = np.divide(errors[:-1], errors[1:])
        assert ((ratios[1:] > 3.5) & (ratios[1:] < 4.5)).all(), (name, errors)


def test_resampled_views_miss_by_half_a_texel(compared):
    for method in ("cubemap", "hemicube"):
        errors = [compared.row(method, resolution).projection_median for resolution in RESOLUTIONS]
        ratios = np.divide(errors[:-1], errors[1:])
        assert ((ratios > 1.7) & (ratios < 2.3)).all(), (method, errors)


def test_errors_of_the_truth_are_zero_and_its_projection_is_measured(compared):
    row = compared.row("raytrace")
    assert (row.hit_mismatch, row.triangle_mismatch, row.depth_p999, row.rmse, row.flip) == (0, 0, 0, 0, 0)
    assert row.psnr == math.inf
    assert 0 < row.projection_p95 < 1e-3


def test_images_and_facts_are_kept(compared):
    assert set(compared.images) == {row.label for row in compared}
    assert compared.images["invert"].shape == compared.truth_image.shape == (SIZE, SIZE, 3)
    assert compared.truth_depth.shape == (SIZE, SIZE)
    assert compared.scene["triangles"] == "8"
    assert compared.scene["camera"].startswith("Radial(profile=paraboloid")
    assert {"processor", "LLVM", "threads", "drjit", "date"} <= set(compared.machine)


def test_a_camera_that_sees_behind_itself_leaves_the_hemicube_out():
    wide = mpcam.compare(scene(Radial.equidistant(32, 32, fov=1.5 * np.pi)), ["invert", "hemicube"], repeats=1)
    assert [row.label for row in wide] == ["invert"]
    assert "270" in wide.left_out["hemicube"]


def test_a_camera_without_one_center_leaves_the_cubes_out():
    camera = Orthographic(32, 32, 8.0)
    parallel = mpcam.compare(scene(camera), repeats=1, moving=False, settings={"vertex": [0]})
    assert [row.label for row in parallel] == ["invert", "vertex level 0", "raytrace"]
    assert set(parallel.left_out) == {"cubemap", "hemicube"}
    assert parallel.row("vertex").projection_p95 < 1e-3  # straight edges are exact here


def test_still_frames_alone(tmp_path):
    still = mpcam.compare(scene(), ["invert", "raytrace"], repeats=1, moving=False, output=tmp_path / "out")
    assert np.isnan(still.column("moving_ms")).all()
    assert "moving" not in still.measured
    data = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert {front["time"] for front in data["fronts"]} == {"still_ms"}
    assert (tmp_path / "out" / "report.html").stat().st_size > 20_000


def test_a_mesh_and_a_camera_will_do():
    rows = mpcam.compare(wall(), "vertex", camera=Radial.equisolid(16, 16), settings={"vertex": [1]}, repeats=1)
    assert [row.label for row in rows] == ["vertex level 1"]


def test_progress_counts_up_to_the_end():
    seen = []
    mpcam.compare(scene(), ["invert", "hemicube"], repeats=1, progress=lambda *step: seen.append(step))
    counts = [count for count, _, _ in seen]
    assert counts == list(range(1, len(seen) + 1))
    assert seen[-1][0] == seen[-1][1]


@pytest.mark.parametrize(
    ("size", "corners"),
    [
        (16, []),
        (1, [(0, 0, -5), (1, 0, -5), (0, 1, -5)]),
        (16, [(0, 0, 2), (0, 0, 2), (0, 0, 2)]),
        (1, [(0, 0, np.nan), (1, 0, 2), (0, 1, 2)]),
    ],
    ids=["no faces", "behind", "no area", "not a number"],
)
def test_scenes_without_anything_to_see(size, corners, tmp_path):
    mesh = Mesh(np.array(corners, float).reshape(-1, 3), np.arange(len(corners)).reshape(-1, 3))
    empty = mpcam.compare(
        scene(Radial.paraboloid(size, size), mesh),
        repeats=1,
        settings={"vertex": [1], "cubemap": [8], "hemicube": [8]},
        output=tmp_path / "out",
    )
    assert len(empty) == 5
    assert (empty.column("hit_mismatch") == 0).all()
    assert (empty.column("flip") == 0).all()
    assert np.isnan(empty.column("projection_median")).all()
    assert "no method" in str(empty).lower()


def test_an_interrupted_comparison_leaves_nothing(tmp_path):
    def interrupt(done: int, total: int, what: str) -> None:
        if done > 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mpcam.compare(scene(), ["invert"], repeats=1, output=tmp_path / "out", progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_moving_vertices_keep_close_and_move_everywhere():
    mesh = wall()
    first, second = moving_vertices(mesh)
    np.testing.assert_array_equal(first, mesh.vertices)
    distance = np.linalg.norm(second - first, axis=-1)
    diagonal = np.linalg.norm(mesh.bounds[1] - mesh.bounds[0])
    assert (distance > 0).all()
    assert distance.max() < 2e-3 * diagonal


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"methods": ["inverse"]}, "Unknown method 'inverse'"),
        ({"methods": []}, "No method is left to compare"),
        ({"methods": ["hemicube"], "camera": Radial.equidistant(8, 8, fov=5.0)}, "No method is left.*hemicube"),
        ({"settings": {"vertex": [99]}}, "level=99"),
        ({"repeats": 0}, "repeats=0"),
        ({"shading": "toon"}, "shading='toon'"),
    ],
)
def test_mistakes_are_named(settings, text):
    with pytest.raises(InputError, match=text) as caught:
        mpcam.compare(scene(Radial.paraboloid(8, 8)), **settings)
    assert "\n" not in str(caught.value)


def test_a_scene_needs_a_camera_and_an_output_needs_a_folder(tmp_path):
    with pytest.raises(InputError, match="has no camera"):
        mpcam.compare(wall())
    (tmp_path / "file").write_text("x", encoding="utf-8")
    with pytest.raises(InputError, match="is a file"):
        mpcam.compare(scene(), output=tmp_path / "file")


def test_the_camera_argument_comes_first():
    turned = Radial.paraboloid(16, 16, camera_from_world=look_at((0, 0, 0), (0, 0, -1), (0, 1, 0)))
    assert mpcam.compare(scene(), ["invert"], camera=turned, repeats=1).row("invert").rendered == 0
