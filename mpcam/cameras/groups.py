"""Functions of a number and arrays, evaluated for the entries of each number apart."""

from collections.abc import Callable

import numpy as np

from mpcam.math import Array, library


def grouped(function: Callable[..., list[Array]], number: Array, *arrays: Array) -> list[Array]:
    """function(number, *arrays), a list of arrays.

    For NumPy it is called once for each number that occurs, a Python int then, with the entries that have it: what it
    looks up in tables is then one value instead of many.
    """
    if library(number, *arrays) != "numpy":
        return function(number, *arrays)
    shape = np.shape(number)
    number = np.ravel(number)
    if number.size == 0:
        return [np.broadcast_to(part, shape) for part in function(number, *arrays)]
    order = np.argsort(number, kind="stable")
    values, starts = np.unique(number[order], return_index=True)
    flat = [np.broadcast_to(array, shape).ravel()[order] for array in arrays]
    ends = [*starts[1:], len(order)]
    parts = [
        function(int(value), *(array[start:end] for array in flat))
        for value, start, end in zip(values, starts, ends, strict=True)
    ]
    back = np.argsort(order)
    return [np.concatenate(columns)[back].reshape(shape) for columns in zip(*parts, strict=True)]
