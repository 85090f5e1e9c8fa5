"""A camera of one's own, exactly as the page has it: used as it is, and built in by one file and one line."""

import dataclasses
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from catalog import POSE
from triangle_cameras import centers

import mpcam as mp
from mpcam.cameras.serialize import camera_to_json

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "own_camera.md").read_text(encoding="utf-8")
FILE = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)[0]
LINE = re.findall(r"^    (from mpcam.cameras.pushbroom import .*)$", PAGE, re.MULTILINE)[0]

PROGRAM = """
import inspect, pathlib, sys
import kit, mpcam as mp
from catalog import POSE, registered

assert inspect.getfile(mp.Pushbroom) == str(pathlib.Path("mpcam/cameras/pushbroom.py").resolve())
assert "Pushbroom" in dir(mp) and "Pushbroom" in mp.__all__
for check in kit.CHECKS:
    cameras = {name: camera for name, camera in registered(*check.size, POSE).items() if type(camera) is mp.Pushbroom}
    for name, camera in kit.applying(cameras, check).items():
        check.run(camera)
        print(check.run.__name__, name)
for camera in mp.Pushbroom.examples(64, 48, POSE).values():
    kit.files_keep_it(camera, pathlib.Path("."))
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Any:
    """The class, from a file of its own."""
    path = tmp_path_factory.mktemp("own") / "own_pushbroom.py"
    path.write_text(FILE, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Pushbroom


def test_the_camera_is_short():
    code = [line for line in FILE[FILE.index("@") :].splitlines() if line.strip() and '"""' not in line]
    assert len(code) <= 20


def test_one_file_and_one_line(tmp_path):
    """In a copy of the package, then all that `kit` asks of a camera holds."""
    shutil.copytree(ROOT / "mpcam", tmp_path / "mpcam", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "mpcam" / "cameras" / "pushbroom.py").write_text(FILE, encoding="utf-8")
    register = tmp_path / "mpcam" / "cameras" / "registry.py"
    text = register.read_text(encoding="utf-8")
    last = re.findall(r"^from mpcam.cameras.*$", text, re.MULTILINE)[-1]
    register.write_text(text.replace(last, f"{last}\n{LINE}"), encoding="utf-8")
    folders = (tmp_path, ROOT / "kernels", ROOT / "tests")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PROGRAM],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, folders))},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert {"gradients_match_differences", "hits_are_those_of_embree"} <= set(done.stdout.split())


def test_everything_takes_it_without_the_register(model, tmp_path):
    camera = model(64, 48, camera_from_world=POSE)
    scene = mp.Scene.of(mp.builtin_mesh("quad_room"))
    for method in ("invert", "raytrace"):
        assert mp.rasterize(camera, scene, method=method).mask.any()
    assert mp.render(camera, scene).shape == (48, 64, 3)
    assert mp.truth.sensor(camera)["film"]["width"] == 64
    result = mp.compare(dataclasses.replace(scene, camera=camera), methods=("invert", "raytrace"), repeats=1)
    result.write(tmp_path / "out")
    assert (tmp_path / "out" / "truth.exr").exists()


def test_an_image_keeps_its_rays(model, tmp_path):
    """As a ray map, since its class would not be known to a reader."""
    camera = model(64, 48, camera_from_world=POSE)
    mp.write_image(tmp_path / "a.exr", np.zeros((48, 64)), camera=camera)
    kept = mp.read_camera(tmp_path / "a.exr")
    assert isinstance(kept, mp.RayMap)
    for part, same in zip(kept.ray(centers(camera)), camera.ray(centers(camera)), strict=True):
        assert np.allclose(part, same, atol=1e-6)


def test_text_wants_it_registered(model, tmp_path, monkeypatch):
    with pytest.raises(mp.InputError, match=r"has Radial, .*; add yours, mpcam.cameras.MODELS\['Pushbroom'\]"):
        camera_to_json(model(64, 48))
    scene = tmp_path / "scene.toml"
    scene.write_text('[[mesh]]\nbuiltin = "cube"\n[camera]\nmodel = "pushbroom"\nstep = 0.25\n')
    with pytest.raises(mp.InputError, match='camera.model = "pushbroom": allowed are radial, '):
        mp.load_scene(scene)
    monkeypatch.setitem(mp.cameras.MODELS, "Pushbroom", model)
    assert mp.load_scene(scene).scene.camera.step == 0.25
    scene.write_text(scene.read_text().replace("0.25", '"far"'))
    with pytest.raises(mp.InputError, match=r':5: camera.step = "far": give a number'):
        mp.load_scene(scene)
    assert mp.Pushbroom is model
