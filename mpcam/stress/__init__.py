"""Stiff and extreme cases, model by model, against oracles that do not share the code under test.

The suite of a camera model is the module of this package with the class's name in snake case: it has
`run(triangles, points, progress)`, which gives the rows, and the largest error that passes, LIMIT.
"""

import re
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from mpcam.errors import InputError


def models() -> list[str]:
    """Names of the suites on the command line: of every camera model that has one."""
    from mpcam import cameras

    classes = [value for value in vars(cameras).values() if isinstance(value, type)]
    names = [re.sub("(?<!^)(?=[A-Z])", "-", m.__name__).lower() for m in classes if issubclass(m, cameras.Camera)]
    return [name for name in names if find_spec(_module(name)) is not None]


def suite(model: str) -> Any:
    """The module that runs a model's cases, by the model's name on the command line; raises InputError."""
    if model not in models():
        raise InputError(f"stress {model!r}: allowed are {', '.join(models())}, or none of them for all")
    return import_module(_module(model))


def _module(name: str) -> str:
    return f"{__name__}.{name.replace('-', '_')}"
