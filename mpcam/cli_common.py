"""What several commands need: scenes by name and size, a machine that can run them, numbers as JSON."""

import json
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.io.scenes import SceneFile


def load(name: str, size: str | None) -> "SceneFile":
    from mpcam.cameras.change import resized
    from mpcam.io.scenes import load_scene

    loaded = load_scene(name)
    if size is None:
        return loaded
    return replace(loaded, scene=replace(loaded.scene, camera=resized(loaded.scene.camera, *image_size(size))))


def image_size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})(?:x(\d{1,6}))?", text.strip().lower())
    if not found or 0 in (size := (int(found[1]), int(found[2] or found[1]))):
        raise InputError(f"--size {text}: give the width and height in pixels, as 640x480 or 512")
    return size


def check_machine() -> None:
    from mpcam.doctor import check_llvm
    from mpcam_kernels.backend import backend_name

    if backend_name() == "llvm":
        check_llvm()


def print_json(data: Any) -> None:
    print(json.dumps(data, indent=2, allow_nan=False))
