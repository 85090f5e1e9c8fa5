"""General linear cameras in scene files: what each kind takes, and what is said of mistakes."""

import json

import numpy as np
import pytest

import mpcam as mp
from mpcam.io.scenes import load_scene

GL, MANY = mp.GeneralLinear, mp.GeneralLinears
EYE = {"eye": [0.0, -2.0, 1.0], "target": [0.0, 0.0, 1.0]}
POSE = mp.look_at(EYE["eye"], EYE["target"])
SLITS = {"slits": [[[0, -3, 1], [1, 0, 0]], [[0, -2, 0], [0, 0, 1]]], "look": [0, 2, 1], "extent": 5}


def read(tmp_path, **keys):
    """The camera of a scene file with these keys."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in keys.items()]
    file = tmp_path / "scene.toml"
    text = '[[mesh]]\nbuiltin = "quad_room"\n[camera]\nmodel = "general_linear"\nsize = [40, 30]\n' + "\n".join(lines)
    file.write_text(text.replace('model = "general_linear"\nsize = [40, 30]\nmodel', "size = [40, 30]\nmodel"))
    return load_scene(file).scene.camera


@pytest.mark.parametrize(
    ("keys", "camera"),
    [
        ({"kind": "pinhole", "focal": 33.0}, GL.pinhole(40, 30, 33.0, camera_from_world=POSE)),
        (
            {"kind": "orthographic", "scale": 7.0, "center": [3, 4]},
            GL.orthographic(40, 30, 7.0, 3.0, 4.0, camera_from_world=POSE),
        ),
        (
            {"kind": "pushbroom", "step": 0.02, "focal": 20.0},
            GL.pushbroom(40, 30, 0.02, 20.0, camera_from_world=POSE),
        ),
        ({"kind": "pencil", "slide": 0.02}, GL.pencil(40, 30, 0.02, camera_from_world=POSE)),
        (
            {"kind": "twisted_orthographic", "twist": 0.5, "scale": 9.0},
            GL.twisted_orthographic(40, 30, 0.5, 9.0, camera_from_world=POSE),
        ),
        ({"kind": "bilinear", "twist": 0.5, "spread": 0.1}, GL.bilinear(40, 30, 0.5, 0.1, camera_from_world=POSE)),
        ({"kind": "epi", "step": 0.5}, GL.epi(40, 30, 0.5, camera_from_world=POSE)),
        (
            {"rays": [[0, 0, 0, 0], [0.1, 0, 1, 0], [0, 0, 0, 1]], "image": [[0, 0], [1, 0.5], [0, 1]]},
            GL(
                [[0, 0, 0, 0], [0.1, 0, 1, 0], [0, 0, 0, 1]], 40, 30, [[0, 0], [1, 0.5], [0, 1]], camera_from_world=POSE
            ),
        ),
    ],
    ids=lambda value: value.get("kind", "rays") if isinstance(value, dict) else "",
)
def test_kinds_by_their_numbers(tmp_path, keys, camera):
    assert read(tmp_path, **keys, **EYE) == camera


def test_crossed_slits_place_themselves(tmp_path):
    wanted = GL.cross_slit(40, 30, *SLITS["slits"], SLITS["look"], 5.0)
    assert read(tmp_path, kind="cross_slit", **SLITS) == wanted
    leaning = GL.cross_slit(40, 30, *SLITS["slits"], SLITS["look"], 5.0, (0.3, 0, 1))
    assert read(tmp_path, kind="cross_slit", top=[0.3, 0, 1], **SLITS) == leaning


def test_many_in_one_image(tmp_path):
    around = {"model": "general_linears", "center": [0, 0, 1], "radius": 2, "extent": 1.5}
    assert read(tmp_path, **around) == MANY.around((0, 0, 1), 2, 1.5, 40, 30)
    part = read(tmp_path, **around, pieces=5, turn=[30, 300], outward=True, top=[0, 1, 0])
    turn = (np.radians(30), np.radians(300))
    assert part == MANY.around((0, 0, 1), 2, 1.5, 40, 30, 5, turn=turn, outward=True, up=(0, 1, 0))
    path, slits = [[-1, -2, 1], [0, -2, 1], [1, -1.5, 1]], [[0, 3, 0], [0, 3, 0]]
    along = read(tmp_path, model="general_linears", path=path, slits=slits, slope=[-1, 0.5], columns=[10, 30])
    assert along == MANY.along_path(path, slits, 40, 30, (-1.0, 0.5), columns=[10, 30])
    assert read(tmp_path, model="general_linears", path=path, slits=slits, away=True) == MANY.along_path(
        path, slits, 40, 30, away=True
    )


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "give kind"),
        ({"kind": "pushbroom"}, "camera.step"),
        ({"kind": "pushbroom", "step": 1, "twist": 1}, "does not go with pushbroom: allowed are step, focal, center"),
        ({"kind": "pushbroom", "step": 0}, "step=0"),
        ({"kind": "panorama"}, "kind"),
        ({"kind": "pinhole", "rays": [[0, 0, 0, 0]] * 3}, "rays"),
        ({"rays": [[0, 0, 0, 0]] * 3, "focal": 3}, "without kind"),
        ({"kind": "cross_slit", "look": [0, 0, 0], "extent": 1}, "needs slits, look, extent"),
        ({"kind": "cross_slit", **SLITS, "eye": [0, 0, 0]}, "leave it out"),
        ({"model": "general_linears"}, "give center, radius and extent, or path and slits"),
        ({"model": "general_linears", "center": [0, 0, 0]}, "needs center, radius, extent"),
        ({"model": "general_linears", "center": [0, 0, 0], "path": [[0, 0, 0]]}, "along a path"),
        ({"model": "general_linears", "center": [0, 0, 0], "radius": 1, "extent": 1, "up": [0, 0, 1]}, "leave it out"),
        ({"model": "general_linears", "center": [0, 0, 0], "radius": -1, "extent": 1}, "radius"),
    ],
)
def test_mistakes_are_named(tmp_path, keys, words):
    with pytest.raises(mp.InputError, match=words):
        read(tmp_path, **keys)
