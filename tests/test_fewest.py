"""The fewest camera triangles within an error: the search by itself, and on surfaces against a scan."""

import math

import numpy as np
import pytest

import mpcam as mp
from mpcam.cli import main
from mpcam.cli_common import angle
from mpcam.decomposition.fewest import Limit, fewest, fewest_within
from mpcam.decomposition.reflector import reflector_of
from mpcam.errors import InputError

EYE = np.array([3.0, 1.0, 2.5])
BALL = mp.Surface.sphere().mesh(300)


@pytest.mark.parametrize("most", [0.3, 0.01, 1e-4, 1e-2 / 137])
@pytest.mark.parametrize("power", [0.7, 1.0, 1.6])
def test_the_search_finds_the_smallest_number(power, most):
    asked = []

    def error(count: int) -> float:
        return 1.0 / count**power

    found = fewest(lambda count: asked.append(count) or count, error, most, 104, 10**7, "an error")
    least = math.ceil(most ** (-1 / power) * (1 - 1e-12))
    assert error(found) <= most and least <= found <= max(1.021 * least, least + 1)
    assert len(asked) < 30 and min(asked) >= 1


@pytest.mark.parametrize("seed", range(8))
def test_errors_that_do_not_fall_evenly(seed):
    noise = np.random.default_rng(seed).uniform(0.95, 1.05, 10_000)

    def error(count: int) -> float:
        return noise[count] / count

    found = fewest(lambda count: count, error, 1e-3, 104, 9_999, "an error")
    scan = next(count for count in range(1, 10_000) if error(count) <= 1e-3)
    assert error(found) <= 1e-3 and found <= 1.1 * scan


def test_an_exact_surface_needs_one_and_a_hopeless_one_is_refused():
    assert fewest(lambda count: count, lambda count: 0.0, 1e-3, 104, 1000, "an error") == 1
    with pytest.raises(InputError, match=r"max_angle=0.001 is not reached: 1,000 camera triangles are off by 2"):
        fewest(lambda count: count, lambda count: 2.0, 1e-3, 104, 1000, "max_angle=0.001")


def test_decompositions_are_within_the_angle_and_hardly_larger_than_need_be():
    cams = mp.decompose(BALL, EYE, max_angle=40e-3)
    assert mp.ray_error(cams, BALL, EYE, samples=13_577).angle_rms <= 1.02 * 40
    fewer = mp.decompose(BALL, EYE, int(0.88 * cams.count))
    assert mp.ray_error(fewer, BALL, EYE, samples=13_577).angle_rms > 40


@pytest.mark.slow
@pytest.mark.parametrize(("name", "most"), [("sphere", 5e-3), ("wave", 0.1), ("teapot", 0.5)])
def test_no_number_of_a_scan_is_much_smaller(name, most):
    shape = {"sphere": mp.Surface.sphere, "wave": mp.Surface.wave, "teapot": lambda: mp.builtin_mesh("teapot")}[name]()
    cams = mp.decompose(shape, EYE, max_angle=most)
    assert mp.ray_error(cams, shape, EYE, samples=13_577).angle_rms <= 1.02e3 * most
    for count in np.linspace(0.75, 0.9, 6) * cams.count:
        fewer = mp.decompose(shape, EYE, round(count))
        assert mp.ray_error(fewer, shape, EYE, samples=13_577).angle_rms > 0.98e3 * most


@pytest.mark.parametrize("name", ["max_angle", "max_error"])
def test_the_limit_is_that_of_ray_error_and_may_be_met_exactly(name):
    cams = mp.decompose(BALL, EYE, 20)
    found = mp.ray_error(cams, BALL, EYE)
    most = 1e-3 * found.angle_rms if name == "max_angle" else found.rms
    assert fewest_within(lambda count: cams, Limit(name, most), reflector_of(BALL), EYE, 104) is cams
    with pytest.raises(InputError, match=f"{name}=.* is not reached: 104 camera triangles"):
        fewest_within(lambda count: cams, Limit(name, 0.9999 * most), reflector_of(BALL), EYE, 104)


def test_errors_may_be_distances_and_rays_directions():
    cams = mp.decompose(BALL, EYE, max_error=0.5, mode="directions")
    assert cams.normals is None and 0.25 < mp.ray_error(cams, BALL, EYE).rms <= 0.501


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"max_angle": 0.0}, "max_angle=0.0: give a finite number above 0, in radians"),
        ({"max_error": "much"}, "max_error='much': give a finite number above 0, in scene units"),
        ({"max_angle": 0.1, "max_error": 1.0}, "give one of them"),
        ({"max_angle": 0.1, "triangles": 104}, "give one of them"),
    ],
)
def test_what_is_no_limit_is_refused(settings, words):
    with pytest.raises(InputError, match=words):
        mp.decompose(mp.Surface.sphere(), EYE, **settings)


def test_angles_on_the_command_line(tmp_path, capsys):
    assert angle("2mrad", "--max-angle") == 0.002 and angle("1.5e-3", "--x") == angle("1.5e-3rad", "--x") == 1.5e-3
    assert angle(" 0.5 deg ", "--x") == pytest.approx(math.radians(0.5))
    for text in ("-1mrad", "0", "fast", "1e", "3 mm", "inf"):
        with pytest.raises(InputError, match="--max-angle .*: give an angle above 0"):
            angle(text, "--max-angle")
    scene = tmp_path / "mirror.toml"
    scene.write_text('[mirror]\nfile = "ball.obj"\n[[mesh]]\nbuiltin = "cube"\n')
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in BALL.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in BALL.faces + 1]
    (tmp_path / "ball.obj").write_text("\n".join(lines) + "\n")
    output = tmp_path / "cams.json"
    command = ["decompose", str(scene), "--output", str(output), "--eye", "3,1,2.5"]
    assert main([*command, "--max-angle", "3deg"]) == 0 and output.exists()
    off = float(capsys.readouterr().out.split("rays off by ")[1].split(" mrad")[0])
    assert 0.6 * 52.36 < off <= 52.4
    assert main([*command, "--max-angle", "3deg", "--triangles", "9"]) == 2
    assert "give one of them" in capsys.readouterr().err


def test_closest_points_where_triangles_differ_much_in_size():
    random = np.random.default_rng(5)
    sizes = 10.0 ** random.uniform(-3, 0.3, 400)
    corners = random.normal(size=(400, 1, 3)) + sizes[:, None, None] * random.normal(size=(400, 3, 3))
    whole = reflector_of(mp.Mesh(corners.reshape(-1, 3), np.arange(1200).reshape(-1, 3)).flat())
    points, ways = random.normal(size=(60, 3)), random.normal(size=(60, 3))
    face, second, third = whole.closest(points, ways)
    weights = np.stack([1 - second - third, second, third], -1)
    here = np.einsum("nk,nkx->nx", weights, whole.vertices[whole.faces[face]])
    grid = [(i / 40, j / 40) for i in range(41) for j in range(41 - i)]
    basis = np.array([(1 - s - t, s, t) for s, t in grid])
    dense = np.einsum("gk,fkx->fgx", basis, whole.vertices[whole.faces])
    fits = whole.face_normals @ ways.T > 0
    for number, point in enumerate(points):
        assert fits[face[number], number]
        away = np.linalg.norm(dense[fits[:, number]] - point, axis=-1).min()
        assert np.linalg.norm(here[number] - point) <= away + 1e-12
