"""What several commands need: scenes by name and size, a machine that can run them, numbers as JSON."""

import json
import math
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.io.scenes import SceneFile


_Point = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


@Parameter(name="*")
@dataclass(frozen=True)
class View:
    """Who looks, in place of the scene's own camera.

    Args:
        camera: FILE or FILE:NAME with a camera: a calibration (Kalibr, OpenCV, ROS, COLMAP and others), a camera as
            JSON, or an EXR image that mpcam wrote.
        eye: Point x,y,z to look from; if not given, where the file says, else where all meshes are seen.
        target: Point x,y,z to look at; the middle of the meshes if not given.
        up: Direction x,y,z towards the top of the image; if not given, y for OBJ, PLY and glTF files, else z.
    """

    camera: str | None = None
    eye: _Point = None
    target: _Point = None
    up: _Point = None

    def points(self) -> dict[str, Any]:
        """eye, target and up as arrays, or None."""
        from mpcam.io.points import read_point

        given = {"eye": self.eye, "target": self.target, "up": self.up}
        return {name: None if text is None else read_point(text, f"--{name}") for name, text in given.items()}


def load(name: str, size: str | None, view: View | None = None) -> "SceneFile":
    from mpcam.io.scene_view import viewed
    from mpcam.io.scenes import load_scene

    view = view or View()
    points, pixels = view.points(), None if size is None else image_size(size)
    loaded = load_scene(name)
    if view == View() and pixels is None:
        return loaded
    return viewed(loaded, view.camera, **points, size=pixels)


@contextmanager
def say_warnings() -> Iterator[None]:
    """Within it, a warning about what was given is one line, as mistakes are."""

    def say(message: Warning | str, category: type[Warning], *rest: Any) -> None:
        if issubclass(category, UserWarning):
            print("mpcam: warning:", " ".join(str(message).split()), file=sys.stderr)
        else:
            usual(message, category, *rest)

    with warnings.catch_warnings():
        usual, warnings.showwarning = warnings.showwarning, say
        yield


def image_size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})(?:x(\d{1,6}))?", text.strip().lower())
    if not found or 0 in (size := (int(found[1]), int(found[2] or found[1]))):
        raise InputError(f"--size {text}: give the width and height in pixels, as 640x480 or 512")
    return size


def angle(text: str, option: str) -> float:
    """Radians, from a text such as 1mrad, 0.05deg, 0.001rad or 0.001."""
    found = re.fullmatch(r"([\d.eE+-]+)\s*(mrad|rad|deg)?", text.strip())
    try:
        value = float(found[1]) if found else math.nan
    except ValueError:
        value = math.nan
    if not found or not 0 < value < math.inf:
        raise InputError(f"{option} {text}: give an angle above 0, as 1mrad, 0.05deg or, in radians, 0.001")
    return value * {"mrad": 1e-3, "deg": math.pi / 180}.get(found[2] or "rad", 1.0)


def check_machine() -> None:
    from mpcam.doctor import check_llvm
    from mpcam_kernels.backend import backend_name

    if backend_name() == "llvm":
        check_llvm()


def print_json(data: Any) -> None:
    print(json.dumps(data, indent=2, allow_nan=False))
