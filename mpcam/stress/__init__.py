"""Stiff and extreme cases, model by model, against oracles that do not share the code under test.

The suite of a camera model is the module of this package with the class's name in snake case: it has
`run(triangles, points, progress)`, which gives the rows, and the largest error that passes, LIMIT.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from mpcam.cameras.registry import MODELS, snake_case
from mpcam.errors import InputError


def models() -> list[str]:
    """Cameras of the register that have cases: a module of that name is here."""
    names = map(snake_case, MODELS)
    return [name.replace("_", "-") for name in names if find_spec(f"mpcam.stress.{name}")]


OTHERS = ("depth-images",)
"""Suites that are not of one camera model."""


def names() -> list[str]:
    """All suites: those of the models, then the others."""
    return [*models(), *OTHERS]


def suite(model: str) -> Any:
    """The module that runs a model's cases: `run(triangles, points, progress)` and the largest error, LIMIT.

    model: one of `names()`. Raises InputError for others.
    """
    if model not in names():
        raise InputError(f"stress {model!r}: allowed are {', '.join(names())}, or none of them for all")
    return import_module(f"mpcam.stress.{model.replace('-', '_')}")
