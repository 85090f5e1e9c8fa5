"""COLMAP's models against pycolmap: every lens, text and binary, poses of images."""

import struct

import numpy as np
import pycolmap
import pytest

import mpcam as mp
from mpcam.io.cameras import load_camera

FRAME = [300, 301, 321, 239]
MODELS = {
    "SIMPLE_PINHOLE": [300, 321, 239],
    "PINHOLE": FRAME,
    "SIMPLE_RADIAL": [300, 321, 239, -0.1],
    "RADIAL": [300, 321, 239, -0.1, 0.02],
    "OPENCV": [*FRAME, -0.1, 0.02, 0.003, -0.002],
    "OPENCV_FISHEYE": [*FRAME, 0.02, -0.003, 0.001, -0.0002],
    "FULL_OPENCV": [*FRAME, -0.1, 0.02, 0.003, -0.002, 0.01, 0.04, 0.03, 0.02],
    "FOV": [*FRAME, 0.93],
    "SIMPLE_RADIAL_FISHEYE": [300, 321, 239, 0.02],
    "RADIAL_FISHEYE": [300, 321, 239, 0.02, -0.003],
    "THIN_PRISM_FISHEYE": [*FRAME, 0.02, -0.003, 0, 0, 0.001, -0.0002, 0, 0],
    "RAD_TAN_THIN_PRISM_FISHEYE": [*FRAME, 0.4, -0.5, -0.2, 0.3, -0.1, 0.02, 0, 0, 0, 0, 0, 0],
    "SIMPLE_DIVISION": [300, 321, 239, -0.1],
    "DIVISION": [*FRAME, 0.07],
    "SIMPLE_FISHEYE": [300, 321, 239],
    "FISHEYE": FRAME,
    "EUCM": [*FRAME, 0.55, 1.2],
    "EQUIRECTANGULAR": [640, 480],
}
POINTS = np.random.default_rng(2).uniform(-1, 1, (50, 3)) + [0, 0, 2]


def camera_of(number, model):
    return pycolmap.Camera(camera_id=number, model=model, width=640, height=480, params=MODELS[model])


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A model of all lenses, each with an image, written by pycolmap: folders of text and binary, and poses by name."""
    folder, poses = tmp_path_factory.mktemp("colmap"), {}
    found = pycolmap.Reconstruction()
    rng = np.random.default_rng(3)
    for number, name in enumerate(MODELS, 1):
        found.add_camera_with_trivial_rig(camera_of(number, name))
        turn = rng.normal(size=4)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(turn / np.linalg.norm(turn)), rng.normal(size=3))
        image = pycolmap.Image(name=f"folder/image {number}.jpg", camera_id=number, image_id=number)
        if number % 2:
            image.points2D = pycolmap.Point2DList([pycolmap.Point2D(np.array([3.0, 4.0]))])
        found.add_image_with_trivial_frame(image, pose)
        poses[image.name] = (name, pose.matrix())
    for kind in ("text", "binary"):
        (folder / kind).mkdir()
    found.write_text(str(folder / "text"))
    found.write_binary(str(folder / "binary"))
    return folder, poses


def test_all_models_of_colmap_are_here():
    assert set(MODELS) == {name for name in dir(pycolmap.CameraModelId) if name.isupper()} - {"INVALID"}


@pytest.mark.parametrize("kind", ["text/cameras.txt", "binary/cameras.bin"])
def test_every_lens_projects_as_theirs(model, kind):
    cameras = mp.read_calibration(model[0] / kind)
    assert list(cameras) == [str(number) for number in range(1, len(MODELS) + 1)]
    for number, name in enumerate(MODELS, 1):
        theirs = camera_of(number, name).img_from_cam(POINTS)
        found = cameras[str(number)].project(POINTS)
        assert found.valid.all(), name
        assert np.abs(theirs - found.pixel[:, 0]).max() < 1e-9, name


@pytest.mark.parametrize("kind", ["text", "binary", "text/images.txt", "binary/images.bin"])
def test_images_have_their_poses(model, kind):
    folder, poses = model
    cameras = mp.read_calibration(folder / kind)
    assert set(cameras) == set(poses)
    for number, (name, (lens, pose)) in enumerate(poses.items(), 1):
        world = (POINTS - pose[:, 3]) @ pose[:, :3]
        theirs = camera_of(number, lens).img_from_cam(POINTS)
        assert np.abs(cameras[name].project(world).pixel[:, 0] - theirs).max() < 1e-9
    one = load_camera(f"{folder / kind}:folder/image 3.jpg")
    assert one == cameras["folder/image 3.jpg"]


def test_one_kind_of_file_goes_with_the_other(model, tmp_path):
    (tmp_path / "images.txt").write_bytes((model[0] / "text" / "images.txt").read_bytes())
    (tmp_path / "cameras.bin").write_bytes((model[0] / "binary" / "cameras.bin").read_bytes())
    assert mp.read_calibration(tmp_path / "images.txt") == mp.read_calibration(model[0] / "binary")


@pytest.mark.parametrize(
    "camera",
    [
        mp.FieldOfView(640, 480, 300, 301, 321, 239, 0.93),
        mp.Scaramuzza(640, 480, 300, 301, 321, 239, (0.07,)),
        mp.Scaramuzza(640, 480, 300, 301, 321, 239),
    ],
)
def test_what_is_written_is_theirs(tmp_path, camera):
    mp.write_calibration(tmp_path / "cameras.txt", camera)
    assert mp.read_calibration(tmp_path / "cameras.txt")["1"].project(POINTS).pixel.tolist() == (
        camera.project(POINTS).pixel.tolist()
    )
    found = pycolmap.Reconstruction()
    (tmp_path / "images.txt").write_text("")
    (tmp_path / "points3D.txt").write_text("")
    found.read_text(str(tmp_path))
    theirs = found.cameras[1].img_from_cam(POINTS)
    assert np.abs(theirs - camera.project(POINTS).pixel[:, 0]).max() < 1e-9


def test_a_binary_file_by_hand(tmp_path):
    """COLMAP's documented layout: count, then number, model, size, parameters."""
    path = tmp_path / "lens.dat"
    path.write_bytes(struct.pack("<QIiQQ8d", 1, 7, 5, 640, 480, 300, 301, 320, 240, 0.01, 0, 0, 0))
    assert mp.read_calibration(path)["7"] == mp.KannalaBrandt(640, 480, 300, 301, 320, 240, (0.01, 0, 0, 0))


def test_mistakes(model, tmp_path):
    data = (model[0] / "binary" / "cameras.bin").read_bytes()
    images = (model[0] / "binary" / "images.bin").read_bytes()
    for name, content, message in (
        ("cameras.bin", data[:-3], "ends in the middle of COLMAP's records: is it cameras.bin, whole"),
        ("cameras.bin", data + b"12", "2 bytes follow the last camera"),
        (
            "cameras.bin",
            data[:12] + b"\x63" + data[13:],
            "camera [0-9]+: the model 99 is not known here: allowed are 0 to 17",
        ),
        ("images.bin", images, "put cameras.bin or cameras.txt beside it"),
        ("points3D.bin", b"\1\0\0\0", "is COLMAP's points3D.bin: give cameras.bin"),
        ("database.db", b"SQLite format 3\0", "is a database, as COLMAP's database.db: export the model"),
        ("cameras.txt", b"1 PINHOLE 640 480 1 2 3 4 5\n", r":1: PINHOLE has 4 parameters \(fx, fy, cx, cy\), not 5"),
        ("cameras.txt", b"1 EQUIRECTANGULAR 640 480 640 481\n", "give those of the image"),
    ):
        path = tmp_path / f"{len(content)}{message[:3]}" / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
        with pytest.raises(mp.InputError, match=message) as caught:
            mp.read_calibration(path)
        assert "\n" not in str(caught.value)
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 480 1 2 3 4\n")
    line = "1 1 0 0 0 0 0 0 {} a.jpg\n\n"
    (tmp_path / "images.txt").write_text(line.format(2))
    with pytest.raises(mp.InputError, match="images.txt:1: camera 2 of image 'a.jpg' is not in"):
        mp.read_calibration(tmp_path / "images.txt")
    (tmp_path / "images.txt").write_text(line.format(1) * 2)
    with pytest.raises(mp.InputError, match="images.txt:3: image 'a.jpg' is there twice"):
        mp.read_calibration(tmp_path / "images.txt")
