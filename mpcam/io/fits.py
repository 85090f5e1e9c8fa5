"""Fitted camera triangles in .npz files: the camera, its errors and the history, to go on from or to use."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.ray_error import RayError
from mpcam.errors import InputError
from mpcam.fitting.levenberg import Step
from mpcam.fitting.result import ERRORS, STATUSES, Fit
from mpcam.io.atomic import atomic_path

_SCHEMA = 1
_TABLES = ("vertices", "faces", "directions", "normals", "eye", "resolution", "index", "camera_from_world")


def write_fit(path: str | Path, result: Fit) -> None:
    """Write a Fit to an .npz file, every digit of it. Raises InputError for other suffixes and places."""
    if Path(path).suffix.lower() != ".npz":
        raise InputError(f"{path}: fits are written as .npz: give such a name")
    if not isinstance(result, Fit):
        raise InputError(f"write_fit: a {type(result).__name__} is no Fit: give what mpcam.fit returned")
    camera = result.camera
    tables = {name: np.asarray(getattr(camera, name)) for name in _TABLES if getattr(camera, name) is not None}
    about = {
        "schema": _SCHEMA,
        "ray_scale": camera.ray_scale,
        "degree": camera.degree,
        "status": result.status,
        "history": [list(step) for step in result.history],
        "errors": {name: dataclasses.asdict(getattr(result, name)) for name in ERRORS},
    }
    with atomic_path(path) as temporary:
        np.savez(temporary, about=np.array(json.dumps(about)), allow_pickle=False, **tables)


def read_fit(path: str | Path) -> Fit:
    """The Fit in a file that `write_fit` wrote. Raises InputError for others, and for files that cannot be read."""
    try:
        with np.load(path, allow_pickle=False) as file:
            tables: dict[str, Any] = {name: file[name] for name in _TABLES if name in file.files}
            about = json.loads(str(file["about"]))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise InputError(f"{path}: is not what mpcam.write_fit writes ({error})") from None
    if about.get("schema") != _SCHEMA or about.get("status") not in STATUSES:
        raise InputError(f"{path}: has schema {about.get('schema')!r}: this version reads schema {_SCHEMA}")
    try:
        for name in ("index", "resolution"):
            if name in tables and tables[name].ndim == 0:
                tables[name] = tables[name].item()
        camera = CameraTriangles(**tables, ray_scale=about["ray_scale"], degree=about.get("degree", 1))
        errors = {name: RayError(**about["errors"][name]) for name in ERRORS}
        history = tuple(Step(*step) for step in about["history"])
    except (KeyError, TypeError) as error:
        raise InputError(f"{path}: is not what mpcam.write_fit writes ({error})") from None
    return Fit(camera=camera, status=about["status"], history=history, **errors)
