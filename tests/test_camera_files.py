"""A file wherever a camera is needed: scene files, --camera, names, sizes, and where the camera is put."""

import io
import re

import numpy as np
import pytest
from calibration_examples import CAMCHAIN, DOUBLE, FISHEYE

import mpcam as mp
from mpcam.cameras.serialize import camera_to_json
from mpcam.cli import main
from mpcam.io.cameras import load_camera
from mpcam.io.scene_view import viewed

MESH = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 2 0\nf 1 2 3 4\nf 1 2 5\nf 3 4 5\n"  # y up
K = "K: [300, 0, 32, 0, 300, 24, 0, 0, 1]\nD: [0.1, 0, 0, 0]\nfisheye_model: 1\n"
POSE = mp.look_at((0.5, -3.0, 2.0), (0.0, 0.0, 1.0))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "chain.yaml").write_text(CAMCHAIN)
    (tmp_path / "tent.obj").write_text(MESH)
    (tmp_path / "K.yml").write_text(K)
    (tmp_path / "camera.json").write_text(camera_to_json(DOUBLE.with_pose(POSE)))
    return tmp_path


def scene(folder, keys):
    (folder / "s.toml").write_text(f'[[mesh]]\nbuiltin = "cube"\n[camera]\n{keys}\n')
    return mp.load_scene(folder / "s.toml").scene


def lens(camera):
    return camera.with_pose(np.eye(4))


# Scene files


def test_scene_files_name_a_camera(folder):
    base = 'file = "chain.yaml"\nname = "cam1"\n'
    chosen = mp.read_calibration("chain.yaml")["cam1"]
    assert lens(scene(folder, base).camera) == lens(chosen)
    rows = POSE.tolist()
    for keys in (f"pose = {rows}", f"pose = {rows[:3]}", f"camera_from_world = {rows}"):
        assert np.allclose(scene(folder, base + keys).camera.camera_from_world, POSE, rtol=0, atol=1e-15)
    assert scene(folder, base + 'pose = "file"').camera == chosen
    placed = scene(folder, base + "eye = [0.5, -3.0, 2.0]\ntarget = [0, 0, 1]").camera
    assert np.array_equal(placed.camera_from_world, POSE)
    own = scene(folder, 'file = "camera.json"\nmodel = "double_sphere"').camera
    assert own == DOUBLE.with_pose(POSE)


def test_a_lens_without_a_place_sees_everything(folder):
    found = scene(folder, 'file = "chain.yaml"\nname = "cam0"')
    seen = found.camera.project(found.mesh.vertices)
    assert seen.valid.all() and found.camera.contains(seen.pixel[:, 0]).all()


def test_sizes_in_scene_files(folder):
    assert scene(folder, 'file = "K.yml"\nsize = [64, 48]').camera.width == 64
    half = scene(folder, 'file = "chain.yaml"\nname = "cam0"\nsize = [256, 200]').camera
    assert (half.width, half.height) == (256, 200) and half.fx == FISHEYE.fx / 2


def test_a_rounded_pose_in_a_scene_file(folder):
    rows = np.round(POSE, 3).tolist()
    with pytest.warns(UserWarning, match="s.toml: pose: its rotation is off by"):
        camera = scene(folder, f'file = "camera.json"\npose = {rows}').camera
    assert np.allclose(camera.camera_from_world, POSE, rtol=0, atol=2e-3)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('file = "chain.yaml"', r"s.toml:4: camera.file = .*has 5 cameras: give the name of one.*there are cam0, cam1"),
        ('file = "chain.yaml"\nname = "cam9"', r"s.toml:5: camera.name = \"cam9\": .*no camera 'cam9'.*there are cam0"),
        ('file = "none.yaml"', r"s.toml:4: camera.file = .*cannot be read"),
        ('file = "K.yml"', r"s.toml:4: camera.file = .*has no image size.*size = \[width, height\]"),
        ('file = "camera.json"\nname = "left"', "camera.name = .*its only camera has no name"),
        ('file = "camera.json"\nmodel = "pinhole"', "5: camera.model = .*holds a DoubleSphere: give model = 'double"),
        ('file = "camera.json"\nfov = 3', "5: camera.fov = 3: there is no such key: .*allowed here are file, name"),
        ('file = "camera.json"\nup = [0, 1, 0]', "5: camera.up = .*give eye and target too"),
        ('file = "camera.json"\npose = "file"\neye = [1, 2, 3]', "camera.eye = .*give pose or eye, not both"),
        ('file = "camera.json"\npose = [[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0]]', "5: camera.pose = .*off by 3"),
        ('file = "camera.json"\npose = [[1, 0, 0, 0]]', "5: camera.pose = .*four rows of four"),
        ('file = "camera.json"\npose = "world"', "5: camera.pose = \"world\": "),
        ('file = "s.toml"', "is a scene file: give it as SCENE"),
    ],
)  # fmt: skip
def test_mistakes_in_scene_files(folder, keys, message):
    with pytest.raises(mp.InputError, match=message) as caught:
        scene(folder, keys)
    assert "\n" not in str(caught.value)


# Names


def test_names_after_a_colon(folder):
    assert load_camera("chain.yaml:cam2") == mp.read_calibration("chain.yaml")["cam2"]
    (folder / "a:b.yaml").write_text(CAMCHAIN.split("cam1:")[0])
    assert lens(load_camera("a:b.yaml")) == lens(load_camera("a:b.yaml:cam0")) == load_camera("chain.yaml:cam0")
    assert load_camera("K.yml", size=(64, 48)).height == 48
    assert load_camera("cube", size=(64, 48)).height == 48
    for text, message in (
        ("chain.yaml:cam7", "chain.yaml: there is no camera 'cam7': did you mean cam4"),
        ("chian.yaml:cam1", "chian.yaml: cannot be read: No such file"),
        ("tent.obj:cam1", "tent.obj: is a scene, which has one camera"),
    ):
        with pytest.raises(mp.InputError, match=message.replace("did you mean cam4", "did you mean")):
            load_camera(text)


# Views of a scene


def test_views(folder):
    loaded = mp.load_scene("tent.obj")
    found = viewed(loaded, "chain.yaml:cam1", eye=np.array([3.0, 1.0, 2.0])).scene
    assert lens(found.camera) == lens(mp.read_calibration("chain.yaml")["cam1"])
    assert np.allclose(found.camera.camera_from_world, mp.look_at((3, 1, 2), (0, 1, 0), (0, 1, 0)))
    assert found.lights != loaded.scene.lights, "the light comes from behind the camera still"
    given = viewed(loaded, "camera.json").scene.camera
    assert given == DOUBLE.with_pose(POSE)
    moved = viewed(loaded, eye=np.array([3.0, 1.0, 2.0]), target=np.zeros(3), up=np.array([1.0, 0, 0])).scene.camera
    assert np.allclose(moved.camera_from_world, mp.look_at((3, 1, 2), (0, 0, 0), (1, 0, 0)))
    alone = viewed(loaded, "chain.yaml:cam0").scene
    seen = alone.camera.project(alone.mesh.vertices)
    assert seen.valid.all() and alone.camera.contains(seen.pixel[:, 0]).all()


def test_render_from_a_file_of_a_rig(folder, capsys):
    """The picture of the command is that of the function, and its EXR is a camera again."""
    view = ["--camera", "chain.yaml:cam1", "--eye=-3,1,2", "--target", "0,1,0", "--size", "94x60"]
    assert main(["render", "tent.obj", *view, "--output", "a.exr"]) == 0
    camera = mp.read_camera("a.exr")
    assert isinstance(camera, mp.DoubleSphere) and camera.fx == DOUBLE.fx / 8
    mask = mp.rasterize(camera, mp.load_mesh("tent.obj")).mask
    assert mask.any() and np.array_equal(mp.read_image("a.exr")[..., :3].any(-1), mask)
    assert main(["render", "tent.obj", "--camera", "a.exr", "--output", "b.exr"]) == 0
    assert mp.read_camera("b.exr") == camera
    assert np.array_equal(mp.read_image("a.exr"), mp.read_image("b.exr"))
    assert capsys.readouterr().err.count("mpcam:") == 0


def test_project_through_a_file(folder, capsys, monkeypatch):
    text = "x,y,z\n0,1,0\n1,0,1\n"
    (folder / "p.csv").write_text(text)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    camera = mp.read_calibration("chain.yaml")["cam1"]
    points = np.array([[0.0, 1, 0], [1, 0, 1]])
    moved = camera.with_pose(mp.look_at((-3, 1, 2), (0, 1, 0)))
    up = camera.with_pose(mp.look_at((-3, 1, 2), (0, 1, 0), (0, 1, 0)))
    eye = ["--camera", "chain.yaml:cam1", "--eye=-3,1,2"]
    for arguments, expected in (
        (["chain.yaml:cam1", "p.csv"], camera),
        (["--camera", "chain.yaml:cam1", "p.csv"], camera),
        (["--camera", "chain.yaml:cam1", "-"], camera),
        ([*eye, "--target", "0,1,0", "p.csv"], moved),
        (["tent.obj", "p.csv", *eye], up),
        (["camera.json", "p.csv"], DOUBLE.with_pose(POSE)),
    ):
        assert main(["project", *arguments]) == 0
        rows = [line.split(",") for line in capsys.readouterr().out.splitlines()[1:]]
        found = expected.project(points)
        assert [row[1:3] for row in rows] == [[*map(str, map(float, pixel))] for pixel in found.pixel[:, 0]]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            "render tent.obj --output a.png --camera chain.yaml",
            "has 5 cameras: give the name of one, as chain.yaml:cam4",
        ),
        ("render tent.obj --output a.png --camera chain.yaml:left", "there is no camera 'left': there are cam0, cam1"),
        ("render tent.obj --output a.png --camera K.yml", "no image size, such as .* --size WIDTHxHEIGHT"),
        ("render tent.obj --output a.png --camera tent.obj", "is a mesh: give a camera's file, and the mesh as SCENE"),
        ("render tent.obj --output a.png --target 1,2,3", "target 1,2,3 goes with an eye: give the eye too"),
        ("render tent.obj --output a.png --eye 0,1,0", "eye 0,1,0 is where the target is: give another point"),
        ("render tent.obj --output a.png --eye 0,1", "--eye 0,1: give three numbers"),
        ("render tent.obj --output a.png --eye 3,1,0 --up 0,0,0", "up 0,0,0: give a direction"),
        (
            "render tent.obj --output a.png --camera K.yml --projection equisolid",
            "--projection equisolid does not go with",
        ),
        ("compare --demo --camera chain.yaml:cam1", "do not go with --demo"),
        ("project chain.yaml:cam1", "POINTS are missing"),
        ("project --camera chain.yaml:cam1 p.csv --eye 1,2,3", "eye 1,2,3 needs a target"),
    ],
)
def test_mistakes_of_the_command_line(folder, arguments, said, capsys):
    (folder / "p.csv").write_text("0 0 1\n")
    assert main(arguments.split()) == 2
    error = capsys.readouterr().err
    assert error.startswith("mpcam: ") and error.count("\n") == 1
    assert re.search(said, error), error
    assert not (folder / "a.png").exists()


def test_warnings_are_one_line(folder, capsys, monkeypatch):
    monkeypatch.setattr("warnings.filters", [])
    rounded = CAMCHAIN.replace("[1.0, 0.0, 0.0, -0.1]", "[0.999, 0.0, 0.001, -0.1]")
    (folder / "chain.yaml").write_text(rounded)
    (folder / "p.csv").write_text("0 0 1\n")
    assert main(["project", "chain.yaml:cam0", "p.csv"]) == 0
    error = capsys.readouterr().err
    assert error.startswith("mpcam: warning: chain.yaml: cam1: T_cn_cnm1: its rotation is off")
    assert error.count("\n") == 1
