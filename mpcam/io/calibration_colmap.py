"""COLMAP's cameras.txt: one line per camera, intrinsics only. Pixel centers are as here."""

from mpcam.cameras import BrownConrady, Camera, KannalaBrandt, Pinhole, UnifiedOmni
from mpcam.errors import InputError
from mpcam.io.calibration_parts import Section, as_number, coefficients, intrinsics, radtan, undistorted

STYLE = "COLMAP's cameras.txt"
MODELS: dict[type[Camera], str] = {
    Pinhole: "PINHOLE",
    BrownConrady: "FULL_OPENCV",
    KannalaBrandt: "OPENCV_FISHEYE",
    UnifiedOmni: "EUCM",
}
_RADTAN = ("SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV")  # the first that holds a camera is written

# Parameters of each model in the order of the file. f stands for fx and fy; k1 to k4 belong to the angle's polynomial
# where the model is a fisheye, whose other parameters must be zero.
_FRAME = "fx fy cx cy"
_PARAMETERS = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": _FRAME,
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": f"{_FRAME} k1 k2 p1 p2",
    "FULL_OPENCV": f"{_FRAME} k1 k2 p1 p2 k3 k4 k5 k6",
    "SIMPLE_FISHEYE": "f cx cy",
    "FISHEYE": _FRAME,
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
    "OPENCV_FISHEYE": f"{_FRAME} k1 k2 k3 k4",
    "THIN_PRISM_FISHEYE": f"{_FRAME} k1 k2 p1 p2 k3 k4 sx1 sy1",
    "RAD_TAN_THIN_PRISM_FISHEYE": f"{_FRAME} k1 k2 k3 k4 k5 k6 p1 p2 s1 s2 s3 s4",
    "EUCM": f"{_FRAME} alpha beta",
}


def recognizes(text: str) -> bool:
    """Whether the first line that is not a comment is a camera."""
    for line in text.splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            words = line.split()
            return len(words) > 4 and words[0].isdigit() and words[1].replace("_", "").isupper()
    return False


def read(text: str, name: str) -> dict[str, Camera]:
    """Cameras by their numbers, as texts."""
    cameras: dict[str, Camera] = {}
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        where = f"{name}:{number}"
        if len(words) < 5:
            raise InputError(f"{where}: a camera needs a number, a model, width, height and parameters")
        if words[0] in cameras:
            raise InputError(f"{where}: camera {words[0]} is there twice")
        cameras[words[0]] = _camera(where, words[1], words[2:4], words[4:])
    if not cameras:
        raise InputError(f"{name}: there is no camera in it")
    return cameras


def _camera(where: str, model: str, size: list[str], values: list[str]) -> Camera:
    if model not in _PARAMETERS:
        raise InputError(f"{where}: the model {model} is not known here: allowed are {', '.join(_PARAMETERS)}")
    names = _PARAMETERS[model].split()
    if len(values) != len(names):
        raise InputError(f"{where}: {model} has {len(names)} parameters ({', '.join(names)}), not {len(values)}")
    part = Section(where, dict(zip(names, values, strict=True)))
    given = {key: as_number(value, f"{where}: {key}") for key, value in part.data.items()}
    focal = (given.pop("f"),) * 2 if "f" in given else (given.pop("fx"), given.pop("fy"))
    frame = (*part.size(*size), *focal, given.pop("cx"), given.pop("cy"))
    if model == "EUCM":
        return part.camera(UnifiedOmni, *frame, given["alpha"], given["beta"])
    if not model.endswith("FISHEYE"):
        return radtan(part, frame[:2], list(frame[2:]), given)
    k = [given.pop(key, 0.0) for key in ("k1", "k2", "k3", "k4")]
    undistorted(part, list(given.values()), f"the distortion {', '.join(given)} of {model}")
    return part.camera(KannalaBrandt, *frame, k)


def write(cameras: dict[str, Camera]) -> str:
    """The file's text; names must be whole numbers."""
    lines = [
        "# Camera list with one line of data per camera:",
        "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]",
        f"# Number of cameras: {len(cameras)}",
    ]
    for name, camera in cameras.items():
        if not (name.isdecimal() and name.isascii()):
            raise InputError(f"camera {name!r}: {STYLE} numbers its cameras: give names like '1', '2'")
        parameters, model = [*intrinsics(camera, MODELS, STYLE)], MODELS[type(camera)]
        if isinstance(camera, KannalaBrandt):
            parameters += camera.k
        elif isinstance(camera, UnifiedOmni):
            parameters += [camera.alpha, camera.beta]
        elif isinstance(camera, BrownConrady):
            model, parameters = _smallest(camera, *parameters)
        words = [name, model, camera.width, camera.height, *(repr(float(p)) for p in parameters)]
        lines.append(" ".join(map(str, words)))
    return "\n".join(lines) + "\n"


def _smallest(camera: BrownConrady, fx: float, fy: float, cx: float, cy: float) -> tuple[str, list[float]]:
    """The model with the fewest parameters that holds a camera, and they."""
    given = coefficients(camera)
    needed = {name for name, value in given.items() if value} | ({"fx"} if fx != fy else set())
    model = next(model for model in _RADTAN if needed <= set(_PARAMETERS[model].split()))
    values = {"f": fx, "fx": fx, "fy": fy, "cx": cx, "cy": cy, **given}
    return model, [values[name] for name in _PARAMETERS[model].split()]
