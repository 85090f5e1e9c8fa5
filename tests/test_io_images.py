"""Images through files and back: exact in EXR, half a code value in 8 bits, and one line for every mistake."""

import re
import struct
import subprocess
import sys

import numpy as np
import OpenImageIO as oiio
import pytest

from mpcam.cameras import Orthographic, Pinhole, Radial
from mpcam.errors import InputError
from mpcam.io.atomic import atomic_path
from mpcam.io.images import CAMERA_ATTRIBUTE, DEPTH_CHANNEL, read_camera, read_channels, read_image, write_image
from mpcam.math.pose import look_at
from mpcam.math.srgb import linear_from_srgb, srgb_from_linear

POSE = look_at((1.0, -2.0, 1.5), (0.25, 0.1, 0.3))
SPECIAL = [np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-45, 3.4e38, -1.5]


def random_image(*shape):
    return np.random.default_rng(7).random(shape, dtype=np.float32)


def bits(array):
    return np.ascontiguousarray(array, dtype=np.float32).view(np.uint32)


def raw_codes(path):
    """The 8-bit values of a file, decoded by another library."""
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image)


def write_raw(path, spec, pixels):
    """Writes what no write_image would: pixels (H, W, C) as the OpenImageIO spec says."""
    file = oiio.ImageOutput.create(str(path))
    assert file is not None
    assert file.open(str(path), spec) and file.write_image(np.ascontiguousarray(pixels))
    file.close()


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 1, 3), (1, 1, 4), (5, 7, 1), (5, 7, 3), (5, 7, 4), (3, 200, 3)])
def test_exr_keeps_every_bit(tmp_path, shape):
    image = random_image(*shape)
    image.ravel()[: len(SPECIAL)] = SPECIAL[: image.size]
    write_image(tmp_path / "a.exr", image)
    back = read_image(tmp_path / "a.exr")
    assert back.dtype == np.float32
    assert np.array_equal(bits(back), bits(image))


def test_two_axes_mean_one_channel(tmp_path):
    image = random_image(4, 6)
    write_image(tmp_path / "a.exr", image.astype(np.float64))
    assert np.array_equal(read_image(tmp_path / "a.exr"), image[..., None])
    assert list(read_channels(tmp_path / "a.exr")) == ["Y"]


def test_channels_and_depth_by_name(tmp_path):
    image, normal = random_image(4, 6, 3), random_image(4, 6)
    depth = np.full((4, 6), np.inf)
    depth[1, 2] = 3.25
    ids = np.arange(24).reshape(4, 6) - 1
    channels = {"triangle.id": ids, "normal.X": normal, "a.first": -normal, "zz": normal * 2, "Z": normal > 0.5}
    write_image(tmp_path / "a.exr", image, depth=depth, channels=channels)
    back = read_channels(tmp_path / "a.exr")
    assert set(back) == {"R", "G", "B", DEPTH_CHANNEL, *channels}
    assert np.array_equal(back[DEPTH_CHANNEL], depth.astype(np.float32))
    for name, plane in channels.items():
        assert np.array_equal(back[name], np.asarray(plane, np.float32)), name
    assert np.array_equal(read_image(tmp_path / "a.exr"), image)
    assert np.array_equal(np.stack([back[name] for name in "RGB"], axis=-1), image)


def test_depth_is_not_taken_for_z_depth(tmp_path):
    write_image(tmp_path / "a.exr", random_image(2, 2), depth=random_image(2, 2))
    file = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    assert file is not None
    assert file.spec().z_channel == -1
    file.close()


def test_half_is_for_colors_only(tmp_path):
    image, depth = random_image(4, 5, 4), random_image(4, 5)
    write_image(tmp_path / "a.exr", image, depth=depth, half=True)
    back = read_channels(tmp_path / "a.exr")
    assert np.array_equal(back["G"], image[..., 1].astype(np.float16).astype(np.float32))
    assert not np.array_equal(back["G"], image[..., 1])
    assert np.array_equal(back[DEPTH_CHANNEL], depth)


def test_colors_are_read_by_name_not_by_place(tmp_path):
    spec = oiio.ImageSpec(2, 1, 4, "float")
    spec.channelnames = ("B", "A", "R", "G")
    write_raw(tmp_path / "a.exr", spec, np.array([[[0.3, 1.0, 0.1, 0.2], [3, 1, 1, 2]]], np.float32))
    assert np.allclose(read_image(tmp_path / "a.exr"), [[[0.1, 0.2, 0.3, 1.0], [1, 2, 3, 1]]])


def test_integer_ids_in_foreign_exr_stay_integers(tmp_path):
    path = tmp_path / "a.exr"
    ids = np.array([[0, 1], [2**32 - 1, 2**24 + 1]], np.uint32)
    spec = oiio.ImageSpec(2, 2, 2, "uint32")
    spec.channelnames = ("half", "id")
    spec.channelformats = (oiio.TypeDesc("half"), oiio.TypeDesc("uint"))
    write_raw(path, spec, np.stack([ids, ids], axis=-1))
    back = read_channels(path)
    assert (back["half"].dtype, back["id"].dtype) == (np.float32, np.uint32)
    assert np.array_equal(back["id"], ids)
    with pytest.raises(InputError, match=r"no channels R, G, B or Y, but half, id: read them with read_channels"):
        read_image(path)


def test_exr_data_window_is_placed_in_the_display_window(tmp_path):
    spec = oiio.ImageSpec(3, 2, 1, "float")
    spec.x, spec.y = -1, 1  # one column left of the display window, starting at its second row
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, 4, 4
    write_raw(tmp_path / "a.exr", spec, np.arange(1.0, 7.0, dtype=np.float32).reshape(2, 3, 1))
    expected = np.zeros((4, 4))
    expected[1:3, 0:2] = [[2, 3], [5, 6]]
    assert np.array_equal(read_image(tmp_path / "a.exr")[..., 0], expected)


@pytest.mark.parametrize(
    "camera",
    [
        Radial.paraboloid(6, 4, camera_from_world=POSE),
        Radial.equidistant(6, 4, camera_from_world=POSE, fov=3.9),
        Pinhole(6, 4, 5.1, 5.3, 2.9, 2.2, POSE),
        Orthographic(6, 4, scale=0.1, camera_from_world=POSE),
    ],
)
def test_camera_comes_back_equal(tmp_path, camera):
    write_image(tmp_path / "a.exr", random_image(4, 6, 3), camera=camera)
    back = read_camera(tmp_path / "a.exr")
    assert type(back) is type(camera)
    assert back == camera


def test_no_camera_reads_as_none(tmp_path):
    for name in ("a.exr", "a.png"):
        write_image(tmp_path / name, random_image(2, 3))
        assert read_camera(tmp_path / name) is None


def test_world_to_camera_acts_on_row_vectors(tmp_path):
    path = tmp_path / "a.exr"
    write_image(path, random_image(4, 6, 3), camera=Pinhole(6, 4, camera_from_world=POSE))
    # read from the bytes of the header: the reader could undo what the writer did
    header = path.read_bytes()
    start = header.index(b"worldToCamera\0m44f\0") + len(b"worldToCamera\0m44f\0")
    assert struct.unpack_from("<i", header, start) == (64,)
    matrix = np.array(struct.unpack_from("<16f", header, start + 4)).reshape(4, 4)
    point = np.array([0.3, -0.7, 2.0, 1.0])
    assert np.allclose(point @ matrix, POSE @ point, atol=1e-6)
    assert np.allclose(matrix[3, :3], POSE[:3, 3], atol=1e-6), "the translation is in the last row"


def test_damaged_camera_attribute_is_reported(tmp_path):
    path = tmp_path / "a.exr"
    spec = oiio.ImageSpec(1, 1, 1, "float")
    for value, problem in (("{", "not JSON"), ('{"schema": 1, "model": "Periscope"}', "'Periscope' is unknown")):
        spec.attribute(CAMERA_ATTRIBUTE, value)
        write_raw(path, spec, np.zeros((1, 1, 1), np.float32))
        with pytest.raises(InputError, match=f"a.exr: attribute mpcam:camera: .*{problem}"):
            read_camera(path)


@pytest.mark.parametrize("suffix", ["png", "PNG", "bmp", "tga"])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_8_bits_are_within_half_a_code_value(tmp_path, suffix, channels):
    image = random_image(16, 16, channels)
    if channels == 4:
        image[..., 3] = 1.0
    write_image(tmp_path / f"a.{suffix}", image)
    back = read_image(tmp_path / f"a.{suffix}")
    assert back.shape[2] >= channels
    error = srgb_from_linear(back[..., :channels]) - srgb_from_linear(image)
    assert np.abs(error).max() <= 0.5 / 255 + 1e-6
    assert np.abs(error).max() > 0.4 / 255, "if this is smaller, more than 8 bits were stored"


def test_png_is_srgb_for_others(tmp_path):
    # 0.5 is 188 on the curve of IEC 61966-2-1; values outside of [0, 1] are clipped
    image = np.array([[0.0, 0.5, 1.0, 2.0, -1.0, np.inf, -np.inf]])
    write_image(tmp_path / "a.png", image)
    assert raw_codes(tmp_path / "a.png").tolist() == [[0, 188, 255, 255, 0, 255, 0]]
    assert b"sRGB" in (tmp_path / "a.png").read_bytes()[:64]


def test_all_codes_survive(tmp_path):
    codes = np.arange(256) / 255
    write_image(tmp_path / "a.png", linear_from_srgb(codes).reshape(16, 16))
    assert np.array_equal(raw_codes(tmp_path / "a.png").ravel(), np.arange(256))
    assert np.allclose(read_image(tmp_path / "a.png").ravel(), linear_from_srgb(codes), atol=1e-6)


def test_png_alpha_is_stored_apart_and_comes_back_multiplied(tmp_path):
    image = np.array([[[0.2, 0.1, 0.4, 0.5], [0.3, 0.0, 0.6, 0.6], [0.7, 0.7, 0.7, 0.0]]])
    write_image(tmp_path / "a.png", image)
    codes = raw_codes(tmp_path / "a.png")
    assert codes[0, 0].tolist() == [*np.rint(255 * srgb_from_linear(np.array([0.4, 0.2, 0.8]))), 128]
    assert codes[0, 2].tolist() == [0, 0, 0, 0]
    back = read_image(tmp_path / "a.png")
    assert np.allclose(back[0, :2], image[0, :2], atol=5e-3)
    assert np.array_equal(back[0, 2], [0, 0, 0, 0])


def test_gray_with_alpha_reads_as_rgba(tmp_path):
    from PIL import Image

    Image.fromarray(np.array([[[188, 255]]], np.uint8), "LA").save(tmp_path / "a.png")
    assert np.allclose(read_image(tmp_path / "a.png"), [[[0.5029, 0.5029, 0.5029, 1]]], atol=1e-4)


def test_16_bit_png_is_srgb_too(tmp_path):
    from PIL import Image

    Image.fromarray(np.array([[0, 32768, 65535]], np.uint16)).save(tmp_path / "a.png")
    assert np.allclose(read_image(tmp_path / "a.png").ravel(), [0, 0.21405, 1], atol=1e-4)


def test_tiff_floats_are_exact(tmp_path):
    image = random_image(5, 6, 4) * 10
    image[0, 0] = SPECIAL[:4]
    write_image(tmp_path / "a.tif", image)
    assert np.array_equal(bits(read_image(tmp_path / "a.tif")), bits(image))


@pytest.mark.parametrize(("name", "tolerance"), [("a.hdr", 0.01), ("a.jpg", 0.06), ("a.jpeg", 0.06), ("a.ppm", 0.01)])
def test_lossy_formats(tmp_path, name, tolerance):
    rows, columns = np.mgrid[0:16, 0:24] / 24
    image = np.stack([rows, columns, 1 - rows], axis=-1)
    write_image(tmp_path / name, image)
    assert np.abs(read_image(tmp_path / name) - image).max() < tolerance
    write_image(tmp_path / name, image[..., 0])
    assert np.abs(read_image(tmp_path / name)[..., 0] - image[..., 0]).max() < tolerance


def test_failed_writing_keeps_the_old_file(tmp_path):
    path = tmp_path / "a.jpg"
    write_image(path, np.zeros((2, 2)))
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"a\.jpg: cannot be written \(.*65500"):
        write_image(path, np.zeros((1, 70000)))  # wider than a JPEG may be
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.jpg"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError])
def test_atomic_path_leaves_nothing_behind(tmp_path, stop):
    path = tmp_path / "a.csv"
    path.write_text("old")
    with pytest.raises(stop), atomic_path(path) as temporary:
        temporary.write_text("half of the n")
        assert path.read_text() == "old"
        raise stop
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.csv"]
    with atomic_path(path) as temporary:
        assert temporary.parent == tmp_path and temporary.suffix == ".csv"
        temporary.write_text("new")
    assert path.read_text() == "new"


def test_a_link_is_followed(tmp_path):
    (tmp_path / "there").mkdir()
    target = tmp_path / "there" / "a.png"
    write_image(target, np.zeros((1, 1)))
    link = tmp_path / "link.png"
    link.symlink_to(target)
    write_image(link, np.ones((1, 1)))
    assert link.is_symlink()
    assert read_image(target)[0, 0, 0] == 1


def test_odd_file_names(tmp_path):
    for name in ("a b.exr", "ä.exr", "what?x=1.exr", "%04d.exr", "#.png", f"{'n' * 250}.exr"):
        write_image(tmp_path / name, np.full((1, 2), 0.25))
        assert read_image(tmp_path / name).shape == (1, 2, 1), name


IMAGE = np.zeros((4, 6, 3), np.float32)
BAD_WRITES = [
    ("a.xyz", IMAGE, {}, r"a\.xyz: images cannot be written as \.xyz: use \.bmp, \.exr, "),
    ("a", IMAGE, {}, "a file without suffix: use"),
    ("a.exr", np.zeros((4, 6, 2)), {}, r"image has shape \(4, 6, 2\): give \(H, W\)"),
    ("a.exr", np.zeros(4), {}, r"image has shape \(4,\)"),
    ("a.exr", np.zeros((0, 6, 3)), {}, r"image has shape \(0, 6, 3\).*at least 1x1"),
    ("a.exr", IMAGE.astype(np.uint8), {}, "image has type uint8: give floats of linear light"),
    ("a.exr", "picture", {}, "image has type"),
    ("a.exr", [[1.0], [1.0, 2.0]], {}, "image has rows of different lengths"),
    ("a.exr", np.full((1, 1), 1e300), {}, r"image has 1 finite values beyond 3\.40282e\+38"),
    ("a.exr", np.full((1, 2), 1e6), {"half": True}, "image has 2 finite values beyond 65504"),
    ("a.exr", IMAGE, {"depth": np.zeros((6, 4))}, r"depth has shape \(6, 4\): give \(4, 6\)"),
    ("a.exr", IMAGE, {"depth": np.full((4, 6), 1e39)}, "depth has 24 finite values beyond"),
    ("a.exr", IMAGE, {"channels": {"id": np.zeros((4, 5))}}, r"id has shape \(4, 5\)"),
    ("a.exr", IMAGE, {"channels": {"id": np.full((4, 6), 2**24 + 1)}}, r"id has integers beyond 2\*\*24"),
    ("a.exr", IMAGE, {"channels": {"id": np.full((4, 6), 1j)}}, "id has type complex128"),
    ("a.exr", IMAGE, {"channels": {"R": np.zeros((4, 6))}}, "'R' is kept for the image's own colors"),
    ("a.exr", IMAGE, {"channels": {"": np.zeros((4, 6))}}, "channel name '': give 1 to 255 printable characters"),
    ("a.exr", IMAGE, {"channels": {"a\0b": np.zeros((4, 6))}}, r"channel name 'a\\x00b'"),
    ("a.exr", IMAGE, {"channels": [np.zeros((4, 6))]}, "channels is a list: give a dict"),
    ("a.exr", IMAGE, {"depth": IMAGE[..., 0], "channels": {DEPTH_CHANNEL: IMAGE[..., 0]}}, "give one of them"),
    ("a.exr", IMAGE, {"camera": Pinhole(6, 5)}, "the camera is 6x5 pixels, the image 6x4"),
    ("a.png", IMAGE, {"depth": IMAGE[..., 0]}, r"\.png files cannot keep depth: write an \.exr file"),
    ("a.jpg", IMAGE, {"camera": Pinhole(6, 4)}, r"\.jpg files cannot keep camera: write an \.exr file"),
    ("a.tif", IMAGE, {"depth": 1, "channels": {"x": 1}}, "cannot keep depth and channels"),
    ("a.png", IMAGE, {"half": True}, "cannot keep half"),
    ("a.jpg", np.zeros((4, 6, 4)), {}, r"\.jpg files keep no alpha: give 3 channels"),
    ("a.png", np.full((2, 3, 3), np.nan), {}, r"6 of 6 pixels are NaN, which \.png cannot keep: write \.exr"),
    ("a.hdr", np.array([[-1.0, np.inf, 1.0]]), {}, r"2 values are NaN, infinite or negative.*write \.exr"),
    ("none/a.exr", IMAGE, {}, "the folder .*none does not exist: create it first"),
    ("folder.exr", IMAGE, {}, "this is a folder: give the name of a file in it"),
    (f"{'n' * 300}.exr", IMAGE, {}, "cannot be written"),
    ("a\0b.exr", IMAGE, {}, "cannot be written"),
]


@pytest.mark.parametrize(("name", "image", "more", "message"), BAD_WRITES)
def test_writing_mistakes_take_one_line(tmp_path, name, image, more, message):
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(InputError) as caught:
        write_image(f"{tmp_path}/{name}", image, **more)
    assert re.search(message, str(caught.value)), str(caught.value)
    assert "\n" not in str(caught.value)
    assert [entry.name for entry in tmp_path.rglob("*")] == ["folder.exr"]


def test_reading_mistakes_take_one_line_and_print_nothing(tmp_path, capfd):
    noise = np.random.default_rng(1).random((40, 50, 3))
    mistakes = {
        "none.exr": "none.exr: there is no such file",
        "folder.png": "folder.png: not a file",
        "empty.exr": "empty.exr: the file is empty",
        "text.png": "text.png: not an image that can be read",
        "text.xyz": "text.xyz: not an image that can be read",
        f"{'n' * 300}.exr": "cannot be read",
        "a\0b.exr": "cannot be read",
    }
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "empty.exr").touch()
    for name in ("text.png", "text.xyz"):
        (tmp_path / name).write_text("not a picture at all")
    for suffix in ("exr", "png", "jpg", "tif", "bmp", "tga", "hdr", "ppm"):
        write_image(tmp_path / f"whole.{suffix}", noise)
        data = (tmp_path / f"whole.{suffix}").read_bytes()
        for part in (0.3, 0.9):
            name = f"cut{part}.{suffix}"
            (tmp_path / name).write_bytes(data[: int(part * len(data))])
            mistakes[name] = f"{name}: "
    for read in (read_image, read_channels):
        for name, message in mistakes.items():
            with pytest.raises(InputError) as caught:
                read(f"{tmp_path}/{name}")
            assert message in str(caught.value)
            assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="there is no such file"):
        read_camera(tmp_path / "none.exr")
    printed = capfd.readouterr()
    assert (printed.out, printed.err) == ("", "")


def test_damaged_headers_are_mistakes_too(tmp_path):
    write_image(tmp_path / "a.exr", random_image(4, 4, 3), depth=random_image(4, 4))
    data = (tmp_path / "a.exr").read_bytes()
    random = np.random.default_rng(3)
    refused = 0
    for _ in range(300):
        damaged = bytearray(data)
        for place in random.integers(8, 330, 3):
            damaged[place] = random.integers(256)
        (tmp_path / "b.exr").write_bytes(damaged)
        try:
            assert read_channels(tmp_path / "b.exr")
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
    assert 100 < refused < 300


def test_import_is_light():
    code = (
        "import sys, mpcam.io.images, mpcam.io.scenes\n"
        "heavy = {'OpenImageIO', 'jax', 'drjit', 'mitsuba', 'trimesh', 'matplotlib', 'scipy'} & set(sys.modules)\n"
        "sys.exit(', '.join(heavy) or None)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
