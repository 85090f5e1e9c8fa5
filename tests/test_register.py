"""The register of cameras: each of its models, in each of its examples, keeps all that a camera promises."""

import kit
import pytest
from catalogue import POSE, own, registered

REGISTERED = registered(*kit.SMALL, POSE)
CAMERAS = {size: registered(*size, POSE) | own(*size, POSE) for size in (kit.SMALL, kit.LARGE)}
CASES = [
    pytest.param(check, camera, id=f"{check.__name__}-{name}")
    for check, (capability, size) in kit.CHECKS.items()
    for name, camera in CAMERAS[size].items()
    if isinstance(camera, capability)
]


@pytest.mark.parametrize(("check", "camera"), CASES)
def test_every_camera_keeps_its_promises(check, camera):
    check(camera)


@pytest.mark.parametrize("name", REGISTERED)
def test_files_keep_every_camera(name, tmp_path):
    kit.files_keep_it(REGISTERED[name], tmp_path)
