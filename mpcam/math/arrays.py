"""The dozen elementwise functions whose home differs between NumPy, JAX and Dr.Jit.

Every equation of the toolkit is written once with these functions and the plain operators, and then runs on NumPy
float64 (checks), JAX (fits, gradients) and Dr.Jit (kernels). The library is chosen by the type of the arguments;
neither JAX nor Dr.Jit is imported unless one of its arrays comes in.
"""

import sys
from types import ModuleType
from typing import Any

import numpy as np

Array = Any  # a NumPy, JAX or Dr.Jit array, or a Python number

PI = 3.141592653589793


def library(*values: Array) -> str:
    """Name of the array library of the first argument that is not a NumPy array or a Python number.

    Returns "numpy", "jax" or "drjit".
    """
    for value in values:
        top = type(value).__module__.partition(".")[0]
        if top in ("drjit", "mitsuba"):
            return "drjit"
        if top in ("jax", "jaxlib"):
            return "jax"
    return "numpy"


def _functions(*values: Array) -> ModuleType:
    name = library(*values)
    if name == "drjit":
        return sys.modules["drjit"]
    if name == "jax":
        import jax.numpy

        return jax.numpy
    return np


def _apply(name: str, *values: Array) -> Array:
    """A function of the arguments' library; Python numbers give Python numbers, which no library seizes."""
    result = getattr(_functions(*values), name)(*values)
    return float(result) if all(type(value) in (float, int) for value in values) else result


def sqrt(x: Array) -> Array:
    return _apply("sqrt", x)


def sin(x: Array) -> Array:
    return _apply("sin", x)


def cos(x: Array) -> Array:
    return _apply("cos", x)


def tan(x: Array) -> Array:
    return _apply("tan", x)


def asin(x: Array) -> Array:
    return _apply("asin", x)


def acos(x: Array) -> Array:
    return _apply("acos", x)


def atan(x: Array) -> Array:
    return _apply("atan", x)


def atan2(y: Array, x: Array) -> Array:
    return _apply("atan2", y, x)


def absolute(x: Array) -> Array:
    return abs(x)


def minimum(x: Array, y: Array) -> Array:
    return _apply("minimum", x, y)


def maximum(x: Array, y: Array) -> Array:
    return _apply("maximum", x, y)


def isfinite(x: Array) -> Array:
    return _functions(x).isfinite(x)


def where(condition: Array, x: Array, y: Array) -> Array:
    """x where the condition holds, else y; Python numbers stay Python numbers."""
    if isinstance(condition, (bool, np.bool_)) and type(x) in (float, int) and type(y) in (float, int):
        return x if condition else y
    functions = _functions(condition, x, y)
    return functions.select(condition, x, y) if functions.__name__ == "drjit" else functions.where(condition, x, y)


def take(table: Array, index: Array) -> Array:
    """table[index] for a table (N,) and an array of whole numbers; NumPy tables go to the library of the index."""
    if library(index) == "drjit":
        dr = sys.modules["drjit"]
        if library(table) == "numpy":
            whole = table.dtype.kind in "iu"
            kind = dr.int32_array_t(type(index)) if whole else dr.float32_array_t(type(index))
            table = kind(np.ascontiguousarray(table, np.int32 if whole else np.float32))
        return dr.gather(type(table), table, dr.uint32_array_t(type(index))(index))
    if "jax" in (library(index), library(table)):
        import jax

        if library(table) == "numpy":  # the type named: JAX mixes up constants that were float64 in another function
            table = jax.numpy.asarray(table, jax.dtypes.canonicalize_dtype(table.dtype))
        return table[index]
    return table[index]


def take_row(table: Array, index: Array) -> tuple[Array, ...]:
    """Row number `index` of a table (N, 4), of its library, as four components; Dr.Jit tables are flat, (4 N,)."""
    if library(table) == "drjit":
        dr = sys.modules["drjit"]
        kind = getattr(sys.modules[type(table).__module__], "Array4f64" if epsilon(table) == 2.0**-52 else "Array4f")
        return tuple(dr.gather(kind, table, dr.uint32_array_t(type(table))(index)))
    if library(index) == "jax" and library(table) == "numpy":
        import jax

        table = jax.numpy.asarray(table, jax.dtypes.canonicalize_dtype(table.dtype))
    if type(index) is int and library(table) == "numpy":
        return tuple(table[index].tolist())  # Python's numbers do not seize the arithmetic
    return tuple(table[index, k] for k in range(4))


def whole(x: Array) -> Array:
    """Numbers that are not negative, cut to whole ones of 32 bits."""
    if library(x) == "drjit":
        return sys.modules["drjit"].int32_array_t(type(x))(x)
    return np.int32(x) if library(x) == "numpy" else x.astype(np.int32)


def detach(x: Array) -> Array:
    """The same value, without a derivative."""
    name = library(x)
    if name == "jax":
        import jax

        return jax.lax.stop_gradient(x)
    return sys.modules["drjit"].detach(x) if name == "drjit" else x


def epsilon(x: Array) -> float:
    """Distance from 1 to the next number in the precision of x: 2**-23 or 2**-52."""
    if library(x) == "drjit":
        drjit = sys.modules["drjit"]
        return 2.0**-52 if drjit.type_v(x) == drjit.VarType.Float64 else 2.0**-23
    return 2.0**-23 if getattr(x, "dtype", None) == np.float32 else 2.0**-52


def smallest(x: Array) -> float:
    """Smallest number with all its digits in the precision of x: 2**-126 or 2**-1022."""
    return 2.0**-126 if epsilon(x) > 2.0**-52 else 2.0**-1022


def safe_divide(x: Array, y: Array, otherwise: Array = 0.0) -> Array:
    """x / y, and `otherwise` where y is zero; the guard stands on both sides, so gradients stay finite too."""
    nonzero = y != 0
    return where(nonzero, x / where(nonzero, y, 1.0), otherwise)


def safe_sqrt(x: Array) -> Array:
    """sqrt(x), and 0 where x is not positive, with a derivative of 0 there instead of an infinite one."""
    positive = x > 0
    return where(positive, sqrt(where(positive, x, 1.0)), 0.0)
