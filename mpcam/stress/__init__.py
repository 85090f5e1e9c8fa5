"""Stiff and extreme cases, model by model, against oracles that do not share the code under test."""

from importlib import import_module
from typing import Any

MODELS = ("radial", "camera-triangles")


def suite(model: str) -> Any:
    """The module that runs a model's cases: `run(triangles, points, progress)` and the largest error, LIMIT."""
    return import_module(f"mpcam.stress.{model.replace('-', '_')}")
