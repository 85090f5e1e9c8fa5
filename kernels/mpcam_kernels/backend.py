"""The one place where the Dr.Jit backend is chosen: LLVM, or CUDA by MPCAM_BACKEND=cuda."""

import functools
import importlib
import os
from types import ModuleType
from typing import Any

from mpcam_kernels.llvm import REMEDY, usable

VARIABLE = "MPCAM_BACKEND"
NAMES = ("llvm", "cuda")


class BackendError(RuntimeError):
    """The backend that is asked for cannot run here; one line with the remedy."""


@functools.cache
def load(name: str) -> ModuleType:
    """The Dr.Jit array types of a backend, checked to work before anything is compiled."""
    import drjit

    if name not in NAMES:
        raise BackendError(f"{VARIABLE}={name!r} is not a backend: allowed are {', '.join(NAMES)}")
    kind = {"llvm": drjit.JitBackend.LLVM, "cuda": drjit.JitBackend.CUDA}[name]
    if name == "llvm":
        problem = usable(drjit.detail.llvm_version())
        if problem:
            raise BackendError(f"{problem}: {REMEDY}")
    if not drjit.has_backend(kind):
        raise BackendError(
            f"Dr.Jit finds no {name.upper()} device: unset {VARIABLE} to use LLVM, or see 'mpcam doctor'"
        )
    return importlib.import_module(f"drjit.{name}")


def backend_name() -> str:
    """The backend in force: the value of MPCAM_BACKEND, else "llvm"."""
    return os.environ.get(VARIABLE, "").strip().lower() or "llvm"


def types() -> Any:
    """Dr.Jit array types (Float, UInt, Array3f, ...) of the backend in force."""
    return load(backend_name())
