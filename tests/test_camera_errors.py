"""Wrong cameras: one line that says what was given, what is allowed, how to mend it."""

import numpy as np
import pytest

import mpcam as mp
from mpcam.cameras.serialize import camera_from_dict, camera_from_json

SHEAR = np.eye(4)
SHEAR[0, 1] = 0.5
MIRROR = np.diag([-1.0, 1, 1, 1])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: mp.Pinhole(0, 4), "width=0"),
        (lambda: mp.Pinhole(4, 2.5), "height=2.5"),
        (lambda: mp.Pinhole(True, 4), "width=True"),
        (lambda: mp.Pinhole(4, 4, fx=-1), "fx=-1"),
        (lambda: mp.Pinhole(4, 4, fx=np.nan), "fx=nan"),
        (lambda: mp.Pinhole(4, 4, cx="middle"), "cx='middle'"),
        (lambda: mp.Pinhole.from_fov(4, 4, 3.5), "fov_x=3.5"),
        (lambda: mp.Orthographic(4, 4, 0), "scale=0"),
        (lambda: mp.Pinhole(4, 4, camera_from_world=np.eye(3)), r"shape \(3, 3\)"),
        (lambda: mp.Pinhole(4, 4, camera_from_world="here"), "4x4 matrix of numbers"),
        (lambda: mp.Pinhole(4, 4, camera_from_world=SHEAR), "not a rigid transform"),
        (lambda: mp.Pinhole(4, 4, camera_from_world=MIRROR), "not a rigid transform"),
        (lambda: mp.Pinhole(4, 4, camera_from_world=np.full((4, 4), np.nan)), "NaN or infinity"),
        (lambda: mp.Radial.cosine_sphere(4, 4, fov=4.0), "cosine_sphere profile reaches fields of view up to 3.14159"),
        (lambda: mp.Radial.paraboloid(4, 4, fov=2 * np.pi), "below 6.28319"),
        (lambda: mp.Radial(4, 4, "fisheye"), "allowed are paraboloid, cosine_sphere"),
        (lambda: mp.Radial(4, 4, 3), "Radial.from_function"),
        (lambda: mp.Radial.equidistant(4, 4, radius=-3), "radius=-3"),
        (lambda: mp.Radial.from_function(4, 4, lambda t: mp.math.sin(2 * t)), "does not increase beyond theta = 0.78"),
        (lambda: mp.Radial.from_function(4, 4, lambda t: t + 1), r"f\(0\) = 1"),
        (lambda: mp.Radial.from_function(4, 4, mp.math.tan, fov=1.2 * np.pi), "does not increase|is not finite"),
        (lambda: mp.Radial.from_function(4, 4, lambda t: 1.0), "maps shape"),
        (lambda: mp.Radial.from_function(4, 4, lambda t: t, slope=lambda t: 2 + 0 * t), "slope is off"),
        (lambda: mp.Radial.from_function(4, 4, lambda t: t, angle=lambda r: 2 * r), "angle"),
        (lambda: mp.custom_profile(lambda t: t, 4.0), "max_angle=4.0"),
        (lambda: mp.KannalaBrandt(4, 4, 3, 3, 2, 2, 0.1), "k=0.1.*four numbers k1, k2, k3, k4 are needed"),
        (lambda: mp.KannalaBrandt(4, 4, 3, 3, 2, 2, (0, 0, 0)), "four numbers k1, k2, k3, k4 are needed, not 3"),
        (lambda: mp.KannalaBrandt(4, 4, 3, 3, 2, 2, (0, 0, 0, np.nan)), "between -1e.06 and 1e.06"),
        (lambda: mp.KannalaBrandt(4, 4, 3, 3, 2, 2, "none"), "four numbers k1, k2, k3, k4"),
        (lambda: mp.KannalaBrandt(4, 4, 0, 3, 2, 2, (0, 0, 0, 0)), "fx=0.*above 0"),
        (lambda: mp.KannalaBrandt(4, 4, 3, 3, 2, 2, (0, 0, 0, 0), max_angle=4), "radians above 0 and at most pi"),
        (lambda: mp.DoubleSphere(4, 4, 3, 3, 2, 2, -1.0, 0.5), "xi=-1.*above -1"),
        (lambda: mp.DoubleSphere(4, 4, 3, 3, 2, 2, 0.0, 1.5), "alpha=1.5.*from 0 up to 1"),
        (lambda: mp.UnifiedOmni(4, 4, 3, 3, 2, 2, -0.1), "alpha=-0.1.*from 0 up to 1"),
        (lambda: mp.UnifiedOmni(4, 4, 3, 3, 2, 2, 0.5, 0), "beta=0.*above 0"),
        (lambda: mp.UnifiedOmni.mei(4, 4, 3, 3, 2, 2, -0.1), "xi=-0.1.*from 0"),
        (lambda: mp.UnifiedOmni.mei(4, 4, 3, 3, 2, 2, "big"), "xi='big'"),
        (lambda: mp.UnifiedOmni.mei(4, 4, "wide", 3, 2, 2, 1), "gamma_x='wide'"),
        (lambda: mp.look_at((0, 0, 0), (0, 0, 0)), "eye and target are both"),
        (lambda: mp.look_at((0, 0), (0, 0, 1)), "3 finite numbers each"),
        (lambda: mp.Pinhole(4, 4).ray([1, 2, 3]), r"shape \(3,\): the last axis must have length 2"),
        (lambda: mp.Pinhole(4, 4).project(5), "must have length 3"),
        (lambda: mp.Pinhole(4, 4).project(["a", "b", "c"]), r"numbers of shape \(..., 3\)"),
        (lambda: mp.Pinhole(4, 4).bound(np.zeros((3,))), "corners by rows"),
        (lambda: camera_from_json("{"), "not JSON"),
        (lambda: camera_from_json("[1]"), "JSON list"),
        (lambda: camera_from_dict({"model": "Fancy"}), "'Fancy' is unknown: allowed are Radial, Pinhole"),
        (lambda: camera_from_dict({"model": ["x"]}), "is unknown"),
        (lambda: camera_from_dict({"model": "Pinhole", "width": 3, "height": 3, "lens": 1}), "no field 'lens'"),
        (lambda: camera_from_dict({"model": "Pinhole", "schema": 9}), "schema 9"),
        (lambda: camera_from_dict({"model": "Pinhole"}), "missing"),
        (lambda: camera_from_dict({"model": "DoubleSphere", "limit": 1}), "no field 'limit'"),
    ],
)
def test_one_line(make, words):
    with pytest.raises(mp.InputError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_a_profile_that_only_numpy_can_run_is_named():
    camera = mp.Radial.from_function(8, 8, lambda theta: np.tan(theta / 3))
    with pytest.raises(mp.InputError, match="does not run on Dr.Jit arrays|use mpcam.math functions"):
        mp.rasterize(camera, mp.builtin_mesh("cube"))


def test_look_at_where_up_is_the_view():
    pose = mp.look_at((0, 0, 0), (0, 0, 5))
    assert np.allclose(pose[2, :3], [0, 0, 1])
    assert abs(np.linalg.det(pose[:3, :3]) - 1) < 1e-12


def test_width_and_height_of_one_pixel():
    camera = mp.Radial.equidistant(1, 1)
    assert camera.ray([0.5, 0.5]).valid
    assert camera.project([0, 0, 2.0]).pixel.tolist() == [[0.5, 0.5]]
