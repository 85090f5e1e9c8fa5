"""Scene files: what they mean, and that every mistake is reported by file, line and key."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mpcam.cameras import DoubleSphere, KannalaBrandt, Orthographic, Pinhole, Radial, UnifiedOmni
from mpcam.errors import InputError
from mpcam.geometry.builtin import builtin_mesh
from mpcam.io.images import write_image
from mpcam.io.scene_camera import default_camera
from mpcam.io.scenes import CompareSettings, load_scene
from mpcam.math.pose import look_at
from mpcam.scene.scene import DirectionalLight, PointLight

EXAMPLES = sorted((Path(__file__).parent.parent / "examples" / "scenes").glob("*.toml"))
TRIANGLE = "v 0 0 0\nv 2 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
MESH = '[[mesh]]\nbuiltin = "cube"\n'


@pytest.fixture
def scene(tmp_path):
    """Loads a TOML text from a folder that has two triangles and a texture: with and without texture coordinates."""
    (tmp_path / "bare.obj").write_text(TRIANGLE + "f 1 2 3\n")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "textured.obj").write_text(TRIANGLE + "f 1/1 2/2 3/3\n")
    write_image(tmp_path / "gray.png", np.full((2, 2), 0.5))

    def load(text):
        (tmp_path / "scene.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_scene(tmp_path / "scene.toml")

    return load


def all_seen(camera, mesh):
    """Whether all finite vertices are in the image."""
    projected = camera.project(mesh.vertices)
    pixel = projected.pixel[projected.valid]
    inside = (pixel >= 0).all() and (pixel <= [camera.width, camera.height]).all()
    return projected.valid.any(axis=-1).all() and inside


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_load(path):
    loaded = load_scene(path)
    assert loaded.path == path
    assert loaded.scene.mesh.triangle_count > 0
    assert loaded.scene.lights
    seen = loaded.scene.camera.project(loaded.scene.mesh.vertices)
    assert seen.valid.any()


def test_there_are_examples_of_each_kind():
    cameras = {type(load_scene(path).scene.camera) for path in EXAMPLES}
    assert len(EXAMPLES) >= 3
    assert cameras == {Radial, Pinhole}


def test_everything_is_taken_over(scene):
    loaded = scene("""
name = "all"
ambient = 0.25
background = [0.1, 0.2, 0.3]
[[mesh]]
file = "bare.obj"
color = [0.5, 0.25, 1.0]
[[mesh]]
builtin = "sphere"
triangles = 320
[camera]
model = "radial"
projection = "equisolid"
fov = 200
size = [64, 48]
eye = [3, 0, 1]
target = [0, 0, 0]
up = [0, 1, 0]
[[light]]
type = "directional"
direction = [0, 0, -2]
radiance = 0.5
[[light]]
type = "point"
position = [1, 2, 3]
intensity = [1, 2, 3]
[compare]
methods = ["vertex", "invert", "cubemap"]
vertex.levels = [0, 3]
cubemap = { resolutions = [64] }
shading = "texture"
repeats = 7
""")
    made = loaded.scene
    assert made.name == "all"
    assert made.ambient == (0.25, 0.25, 0.25)
    assert made.background == (0.1, 0.2, 0.3)
    assert [mesh.triangle_count for mesh in made.meshes] == [1, 320]
    assert made.meshes[0].materials[0].color == (0.5, 0.25, 1.0)
    pose = look_at((3, 0, 1), (0, 0, 0), (0, 1, 0))
    assert made.camera == Radial.equisolid(64, 48, camera_from_world=pose, fov=np.radians(200))
    assert made.lights == (
        DirectionalLight((0, 0, -1), (0.5, 0.5, 0.5)),
        PointLight((1.0, 2.0, 3.0), (1.0, 2.0, 3.0)),
    )
    assert loaded.compare == CompareSettings(
        ("vertex", "invert", "cubemap"),
        {"vertex": ({"level": 0}, {"level": 3}), "cubemap": ({"resolution": 64},)},
        "texture",
        7,
    )


def test_defaults(scene):
    loaded = scene(MESH)
    assert loaded.compare == CompareSettings()
    assert loaded.scene.name == "scene"
    assert isinstance(loaded.scene.camera, Radial)
    assert loaded.scene.camera.profile.name == "paraboloid"
    assert all_seen(loaded.scene.camera, loaded.scene.mesh)
    (light,) = loaded.scene.lights
    assert np.dot(light.direction, loaded.scene.camera.camera_from_world[2, :3]) > 0.5, (
        "shines the way the camera looks"
    )
    assert scene("light = []\n" + MESH).scene.lights == ()


def test_meshes_are_scaled_then_rotated_then_moved(scene):
    (mesh,) = scene("""
[[mesh]]
file = "bare.obj"
scale = [2, 3, 1]
rotate = { axis = [0, 0, 5], degrees = 90 }
translate = [10, 0, 1]
""").scene.meshes
    # (2, 0, 0) -> (4, 0, 0) -> (0, 4, 0) -> (10, 4, 1); (0, 1, 0) -> (0, 3, 0) -> (-3, 0, 0) -> (7, 0, 1)
    assert np.allclose(mesh.vertices, [[10, 0, 1], [10, 4, 1], [7, 0, 1]])


def test_texture_is_linear_and_replaces_materials(scene):
    text = '[[mesh]]\nfile = "sub/textured.obj"\ntexture = "gray.png"\n'
    (material,) = scene(text).scene.meshes[0].materials
    assert material.texture is not None
    assert material.texture.shape == (2, 2, 3)
    assert np.allclose(material.texture, 0.5, atol=4e-3)
    assert material.color == (1, 1, 1)
    (material,) = scene(text + "color = 0.5\n").scene.meshes[0].materials
    assert material.color == (0.5, 0.5, 0.5)


@pytest.mark.parametrize(
    "keys",
    [
        'model = "radial"',
        'model = "radial"\nprojection = "equidistant"\nfov = 360',
        'model = "radial"\nfov = 20\nsize = [300, 100]',
        'model = "radial"\nup = [0, 1, 0]',
        'model = "pinhole"',
        'model = "pinhole"\nfov = 10\nsize = [50, 200]',
        'model = "pinhole"\nfov = 170\nsize = [300, 100]',
        'model = "pinhole"\nfocal = [900, 500]\ncenter = [250, 251]',
        'model = "orthographic"',
        'model = "orthographic"\nsize = [40, 90]',
        'model = "kannala_brandt"\nfocal = [150, 151]\nk = [0.05, -0.01, 0, 0]',
        'model = "double_sphere"\nfocal = [200, 201]\nxi = -0.2\nalpha = 0.59\nsize = [640, 200]',
        'model = "unified_omni"\nfocal = [200, 201]\nalpha = 0.55\nfov = 150',
    ],
)
@pytest.mark.parametrize("place", ["", "scale = [5, 1, 0.1]", "scale = 1e-6\ntranslate = [0, 0, 3]", "scale = 1e9"])
def test_cameras_without_a_pose_see_everything(scene, keys, place):
    made = scene(f"{MESH}{place}\n[camera]\n{keys}").scene
    assert all_seen(made.camera, made.mesh)
    extent = np.ptp(made.camera.project(made.mesh.vertices).pixel.reshape(-1, 2), axis=0)
    assert extent.max() > 0.2 * min(made.camera.width, made.camera.height), "and not from too far away"


def test_pinhole_and_orthographic_numbers(scene):
    matrix = look_at((1, 2, 3), (0, 0, 0))
    pose = f"camera_from_world = {matrix.tolist()}"
    camera = scene(f'{MESH}[camera]\nmodel = "pinhole"\nfov = 90\nsize = [80, 60]\n{pose}').scene.camera
    assert isinstance(camera, Pinhole)
    assert np.allclose((camera.fx, camera.fy, camera.cx, camera.cy), (40, 40, 40, 30))
    assert np.array_equal(camera.camera_from_world, matrix)
    camera = scene(f'{MESH}[camera]\nmodel = "pinhole"\nfocal = [50, 60]\ncenter = [1, 2]\n{pose}').scene.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (50, 60, 1, 2)
    camera = scene(f'{MESH}[camera]\nmodel = "orthographic"\nscale = 25\n{pose}').scene.camera
    assert isinstance(camera, Orthographic)
    assert camera.scale == 25


def test_numbers_of_lenses(scene):
    def camera(keys):
        return scene(f"{MESH}[camera]\nsize = [80, 60]\nfocal = [50, 60]\n{keys}").scene.camera.with_pose(np.eye(4))

    frame = (80, 60, 50, 60, 40, 30)
    assert camera('model = "kannala_brandt"') == KannalaBrandt(*frame, (0, 0, 0, 0))
    lens = camera('model = "kannala_brandt"\nk = [0.1, 0, 0.3, 0]\nfov = 180')
    assert lens == KannalaBrandt(*frame, (0.1, 0, 0.3, 0), max_angle=np.pi / 2)
    lens = camera('model = "double_sphere"\nxi = -0.2\nalpha = 0.6\ncenter = [41, 29]')
    assert lens == DoubleSphere(80, 60, 50, 60, 41, 29, -0.2, 0.6)
    assert camera('model = "unified_omni"\nalpha = 0.6\nbeta = 1.1') == UnifiedOmni(*frame, 0.6, 1.1)
    assert camera('model = "unified_omni"\nxi = 1.5') == UnifiedOmni.mei(*frame, 1.5)


def test_mesh_file_is_shown_from_outside(tmp_path):
    (tmp_path / "thing.obj").write_text(TRIANGLE + "v 0 0 40\nf 1 2 3\nf 1 2 4\n")
    loaded = load_scene(str(tmp_path / "thing.obj"))
    assert loaded.path == tmp_path / "thing.obj"
    assert loaded.scene.name == "thing"
    assert len(loaded.scene.lights) == 1
    assert all_seen(loaded.scene.camera, loaded.scene.mesh)
    # y is up in OBJ files: a higher point is higher in the image
    above = loaded.scene.camera.project(np.array([[0.0, 0.0, 20.0], [0.0, 5.0, 20.0]])).pixel[:, 0, 1]
    assert above[1] < above[0]


def test_builtin_scenes_by_name():
    assert {"cube", "sphere"} <= set(builtin_mesh.names)
    loaded = load_scene("cube")
    assert loaded.path is None
    assert loaded.scene.camera is not None
    assert loaded.scene.mesh.triangle_count == 12


def test_default_camera_of_degenerate_bounds():
    for bounds in (
        np.zeros((2, 3)),
        np.full((2, 3), 1e12),
        np.array([[0, 0, 0], [1e-300, 0, 0]]),
        [[0, 0, 0], [0, 0, 5]],
    ):
        camera = default_camera(np.array(bounds, float))
        center = camera.project(np.mean(bounds, axis=0)[None])
        assert center.valid.all()
        assert np.allclose(center.pixel, 256, atol=1)
    with pytest.raises(InputError, match="too large to place a camera"):
        default_camera(np.array([[-1e200] * 3, [1e200] * 3]))


def test_byte_order_mark_and_windows_lines(scene):
    assert scene(b"\xef\xbb\xbf" + MESH.replace("\n", "\r\n").encode()).scene.mesh.triangle_count == 12


CAMERA = MESH + "[camera]\n"
RADIAL = CAMERA + 'model = "radial"\n'
MISTAKES = [
    # the file as such
    ("", "1: mesh: this key is missing: give tables in double brackets, with the keys file, builtin"),
    ("[[mesh]\n", "1: not valid TOML: Expected ']]'"),
    (MESH + "\nscale =\n", "4: not valid TOML: Invalid value"),
    (MESH + "scale = 1\nscale = 2\n", "4: not valid TOML: Cannot overwrite a value"),
    (MESH + 'x = """never closed\n\n', "3: not valid TOML: .* at the end of the file"),
    (MESH.encode() + b"# \xff", "3: not UTF-8 text: save the file as UTF-8"),
    ("a = " + "[" * 5000, " arrays or tables are nested too deeply"),
    # keys
    (MESH + "sclae = 2", r"3: mesh\[0\]\.sclae = 2: there is no such key: did you mean scale\? allowed here are file"),
    (RADIAL + 'projecton = "x"', r'5: camera\.projecton = "x": there is no such key: did you mean projection\?'),
    (CAMERA + 'model = "pinhole"\nprojection = "x"', r"5: camera\.projection = .*allowed here are model, size, eye"),
    (MESH + "ambient = 1", r"3: mesh\[0\]\.ambient = 1: .*put ambient above the first \[table\]"),
    (MESH + '["odd key"]\nx = 1', '3: "odd key": there is no such key: allowed here are mesh, camera'),
    (CAMERA + "fov = 90", "3: camera.model: this key is missing: give one of radial, pinhole, orthographic"),
    (MESH + "rotate.degrees = 1", r"3: mesh\[0\]\.rotate\.axis: this key is missing: give a list of 3, each a number"),
    (MESH + "[[light]]\ndirection = [0, 0, 1]", r"3: light\[0\]\.type: this key is missing: give one of directional"),
    # values of the wrong kind
    ("mesh = 3", "1: mesh = 3: give tables in double brackets"),
    ("[[mesh]]\nbuiltin = 3", r"2: mesh\[0\]\.builtin = 3: give a text in quotes"),
    (RADIAL + 'projection = "parabola"', r'5: camera\.projection = "parabola": allowed are .*paraboloid'),
    (CAMERA + 'model = "fisheye"', r'4: camera\.model = "fisheye": allowed are radial, pinhole, orthographic'),
    (
        RADIAL + "size = [\n 512, # wide\n 0, # high\n]",
        r"7: camera\.size\[1\] = 0: give a whole number from 1 up to 32768",
    ),
    (RADIAL + "size = [512]", r"5: camera\.size = \[512\]: give a list of 2, each a whole number"),
    (RADIAL + "size = [5.5, 2]", r"5: camera\.size\[0\] = 5\.5: give a whole number"),
    (RADIAL + "fov = true", r"5: camera\.fov = true: give a number above 0 up to 360"),
    (RADIAL + "fov = 361", r"5: camera\.fov = 361: give a number above 0 up to 360"),
    (RADIAL + "eye = [nan, 0, 0]", r"5: camera\.eye\[0\] = NaN: give a number between -1e\+30 and 1e\+30"),
    (RADIAL + "camera_from_world = [\n[1, 0, 0, 0],\n[0, 1, 0]]", r"5: camera\.camera_from_world = .*list of 4, each"),
    (MESH + "translate = 2020-01-01", r'3: mesh\[0\]\.translate = "2020-01-01": give a list of 3'),
    (MESH + "scale = 'big'", r'3: mesh\[0\]\.scale = "big": give a number or a list of 3, each a number'),
    (MESH + 'light = [{ type = "spot" }]', r"3: mesh\[0\]\.light: there is no such key: put light above"),
    ('light = [\n{ type = "spot" }]\n' + MESH, r'2: light\[0\]\.type = "spot": allowed are directional, point'),
    # values that are not usable
    ("[[mesh]]\n[[mesh]]\nbuiltin = 'cube'", r"1: mesh\[0\]: give either file .* or builtin"),
    (MESH + 'file = "bare.obj"', r"1: mesh\[0\]: give either file"),
    ('[[mesh]]\n\nfile = "none.obj"', r'3: mesh\[0\]\.file = "none\.obj": .*none\.obj does not exist'),
    ('[[mesh]]\nfile = "scene.toml"', r'2: mesh\[0\]\.file = "scene\.toml": .*mesh files are'),
    ('[[mesh]]\nfile = "bare.obj"\ntriangles = 9', r"3: mesh\[0\]\.triangles = 9: only built-in meshes"),
    ('[[mesh]]\nbuiltin = "cow"', r'2: mesh\[0\]\.builtin = "cow": allowed are facade, '),
    (MESH + "triangles = 1", r"3: mesh\[0\]\.triangles = 1: cube has 12 to"),
    (MESH + "scale = [1, 0, 1]", r"3: mesh\[0\]\.scale = \[1, 0, 1\]: give numbers above 0 "),
    (
        MESH + "rotate = { axis = [0, 0, 0], degrees = 1 }",
        r"3: mesh\[0\]\.rotate\.axis = \[0, 0, 0\]: give a direction",
    ),
    (MESH + "color = [1, -1, 0]", r"3: mesh\[0\]\.color = \[1, -1, 0\]: give linear RGB numbers that are not negative"),
    ('[[mesh]]\nfile = "bare.obj"\ntexture = "gray.png"', r"3: mesh\[0\]\.texture = .*no texture coordinates"),
    ('[[mesh]]\nfile = "sub/textured.obj"\ntexture = "none.png"', r"3: mesh\[0\]\.texture = .*there is no such file"),
    ('[[mesh]]\nfile = "sub/textured.obj"\ntexture = "bare.obj"', r"3: mesh\[0\]\.texture = .*not an image"),
    ("ambient = -1\n" + MESH, "1: ambient = -1: give linear RGB numbers that are not negative"),
    ("background = [0, 0, -1]\n" + MESH, r"1: background = \[0, 0, -1\]: give linear RGB"),
    (
        RADIAL + 'projection = "cosine_sphere"\nfov = 190',
        r"6: camera\.fov = 190: .*cosine_sphere reaches up to 180 degrees",
    ),
    (RADIAL + "fov = 360", r"5: camera\.fov = 360: the projection paraboloid reaches below 360 degrees"),
    (RADIAL + "eye = [1, 2, 3]", r"5: camera\.eye = \[1, 2, 3\]: give camera\.target too"),
    (RADIAL + "target = [1, 2, 3]", r"5: camera\.target = \[1, 2, 3\]: give camera\.eye too"),
    (RADIAL + "eye = [1, 2, 3]\ntarget = [1, 2, 3]", r"6: camera\.target = \[1, 2, 3\]: this is where the eye is"),
    (RADIAL + "up = [0, 0, 0]", r"5: camera\.up = \[0, 0, 0\]: give a direction"),
    (
        RADIAL + "camera_from_world = [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]",
        "3: camera: camera_from_world .*not a rigid",
    ),
    (
        RADIAL + "eye = [1, 1, 1]\ncamera_from_world = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]",
        r"5: camera\.eye = .*not eye",
    ),
    (CAMERA + 'model = "kannala_brandt"', "3: camera.focal: this key is missing: give a list of 2"),
    (CAMERA + 'model = "kannala_brandt"\nfocal = [9, 9]\nk = [1]', r"6: camera\.k = \[1\]: give a list of 4"),
    (CAMERA + 'model = "double_sphere"\nfocal = [9, 9]\nxi = -1', r"6: camera\.xi = -1: give a number above -1"),
    (CAMERA + 'model = "unified_omni"\nfocal = [9, 9]', "3: camera: give either alpha .* or xi"),
    (
        CAMERA + 'model = "unified_omni"\nfocal = [9, 9]\nxi = 1\nbeta = 2',
        r"7: camera\.beta = 2: give alpha with it, not xi",
    ),
    (CAMERA + 'model = "pinhole"\nfov = 40\nfocal = [1, 1]', r"5: camera\.fov = 40: give fov or focal, not both"),
    (CAMERA + 'model = "pinhole"\ncenter = [1, 1]', r"5: camera\.center = \[1, 1\]: give camera\.focal too"),
    (MESH + '[[light]]\ntype = "directional"\ndirection = [0, 0, 0]', r"3: light\[0\]: light direction is \(0, 0, 0\)"),
    (
        MESH + '[[light]]\ntype = "point"\nposition = [0, 0, 0]\nintensity = -1',
        r"6: light\[0\]\.intensity = -1: give linear",
    ),
    (MESH + "scale = 1e200", r"3: mesh\[0\]\.scale = 1e\+200: give a number between"),
    (
        MESH + "translate = [0, 1" + "0" * 400 + ", 0]",
        r"3: mesh\[0\]\.translate\[1\] = 10{50,}\.\.\.: give a number between",
    ),
    ("a = 1" + "0" * 5000, " not valid TOML: Exceeds the limit"),
    (
        MESH + "[compare]\nvertex.levels = [0, 1, 8]",
        r"4: compare\.vertex\.levels\[2\] = 8: give a whole number from 0 up to 7",
    ),
    (MESH + "[compare]\nvertex.levels = [1, 1]", r"4: compare\.vertex\.levels = \[1, 1\]: give each number once"),
    (
        MESH + "[compare]\nhemicube.resolutions = []",
        r"4: compare\.hemicube\.resolutions = \[\]: give a list, .*at least one",
    ),
    (MESH + '[compare]\nmethods = ["invert", "magic"]', r'4: compare\.methods\[1\] = "magic": allowed are .*invert'),
    (MESH + '[compare]\nmethods = ["invert", "invert"]', r"4: compare\.methods = .*give each method once"),
    (
        MESH + '[compare]\nmethods = ["invert"]\n[compare.vertex]\nlevels = [1]',
        r"5: compare\.vertex: vertex is not among",
    ),
    (MESH + "[compare]\nrepeats = 0", r"4: compare\.repeats = 0: give a whole number from 1"),
]


@pytest.mark.parametrize(("text", "message"), MISTAKES)
def test_mistakes_are_reported_by_line_and_key(scene, tmp_path, text, message):
    with pytest.raises(InputError) as caught:
        scene(text)
    assert re.match(re.escape(f"{tmp_path}/scene.toml:") + message, str(caught.value)), str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).count("scene.toml:") == 1


def test_names_that_lead_nowhere(tmp_path):
    (tmp_path / "notes.txt").write_text("hello")
    for name, message in (
        ("cubes", r"cubes: no such file, and no built-in scene: did you mean cube\? .*one of facade, "),
        (tmp_path / "none.toml", "none.toml: no such file"),
        (tmp_path, "not a file: give a .toml or mesh file"),
        (tmp_path / "notes.txt", "mesh files are"),
        ("n" * 300, "cannot be read"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            load_scene(name)
        assert "\n" not in str(caught.value)


def test_scene_tables_survive_garbage_collection():
    # in a process of its own: some unions of limited numbers make msgspec crash when its types are collected
    code = (
        "import gc, msgspec\n"
        "from mpcam.io import scene_tables\n"
        "from mpcam.io.scene_text import SceneText\n"
        f"SceneText('a', {MESH!r}).read(scene_tables.SceneTable)\n"
        "gc.collect()\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
