"""Projection models compared: error against run time, next to ray-traced truth.

`mpcam.compare` is the entry; this package holds its parts and is named differently so that it does not hide the
function (`mpcam.compare` would name both once the package is imported).
"""

from mpcam.comparison.columns import COLUMNS
from mpcam.comparison.driver import compare
from mpcam.comparison.rows import Row
from mpcam.comparison.table import Comparison

__all__ = ["COLUMNS", "Comparison", "Row", "compare"]
