"""Mitsuba, with a vectorized variant in force, without disturbing a variant that the user chose."""

import contextlib
from collections.abc import Iterator
from typing import Any

from mpcam.backend import types
from mpcam.errors import SetupError


@contextlib.contextmanager
def mitsuba() -> Iterator[Any]:
    """The mitsuba module with the variant that fits the kernels' backend; the former variant is put back after.

    Raises SetupError where Mitsuba has no such variant or LLVM cannot be used.
    """
    import mitsuba as mi

    from mpcam_kernels.backend import backend_name

    types()  # checks LLVM before anything is compiled
    wanted, former = f"{backend_name()}_ad_rgb", mi.variant()
    if wanted not in mi.variants():
        raise SetupError(f"this Mitsuba has no variant {wanted}: it has {', '.join(mi.variants())}")
    if former != wanted:
        mi.set_variant(wanted)
    try:
        yield mi
    finally:
        if former is not None and former != wanted:
            mi.set_variant(former)
