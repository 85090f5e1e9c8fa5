"""The register of cameras: each of its models, in each of its examples, keeps all that a camera promises."""

import kit
import pytest
from catalog import POSE, own, registered

REGISTERED = registered(64, 48, POSE)
CASES = [
    pytest.param(check.run, camera, id=f"{check.run.__name__}-{name}")
    for check in kit.CHECKS
    for name, camera in kit.applying(registered(*check.size, POSE) | own(*check.size, POSE), check).items()
]


@pytest.mark.parametrize(("check", "camera"), CASES)
def test_every_camera_keeps_its_promises(check, camera):
    check(camera)


@pytest.mark.parametrize("name", REGISTERED)
def test_files_keep_every_camera(name, tmp_path):
    kit.files_keep_it(REGISTERED[name], tmp_path)
