"""Points in another frame."""

from typing import Any


def placed(types: Any, pose: list[Any], point: Any) -> Any:
    """Points in another frame; pose: nine numbers of a rotation, row by row, and three of a shift."""
    x, y, z = point
    rows = [pose[3 * i] * x + pose[3 * i + 1] * y + pose[3 * i + 2] * z + pose[9 + i] for i in range(3)]
    return types.Array3f(*rows)
