"""Lists of coefficients as fields of cameras hold them: tuples of floats, or of arrays of another library."""

from typing import Any

from mpcam.errors import InputError
from mpcam.math import Array, library


def coefficients_of(model: str, name: str, values: Any, most: int, largest: float) -> tuple[Array, ...]:
    """Numbers as a tuple of Python floats; arrays of JAX and Dr.Jit pass.

    model, name: whose they are, for messages. Raises InputError for more than `most`, and beyond `largest`.
    """
    try:
        numbers = tuple(float(value) if library(value) == "numpy" else value for value in values)
    except (TypeError, ValueError):
        numbers = None
    if numbers is None or len(numbers) > most:
        raise InputError(f"{model}({name}={values!r}): at most {most} numbers are needed")
    if not all(library(number) != "numpy" or abs(number) <= largest for number in numbers):
        raise InputError(f"{model}({name}={values!r}): numbers between {-largest:g} and {largest:g} are needed")
    return numbers
