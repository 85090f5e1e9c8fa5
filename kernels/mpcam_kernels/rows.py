"""Rows of four numbers, those of one item next to each other in memory."""

from dataclasses import dataclass
from typing import Any

import drjit as dr


@dataclass(frozen=True)
class Rows:
    """`count` rows of four numbers for each item, in one array."""

    flat: Any
    count: int

    def at(self, types: Any, number: Any, active: Any = True) -> list[Any]:
        """The rows of items by number."""
        return [dr.gather(types.Array4f, self.flat, number * self.count + k, active) for k in range(self.count)]

    def store(self, rows: Any, number: Any, active: Any = True) -> None:
        """Write the rows of items by number.

        One scatter in a loop: several to one array would be as many kernels, each with all that leads to the rows.
        """
        first, *rest = rows

        def write(k: Any) -> Any:
            chosen = first
            for i, row in enumerate(rest):
                chosen = dr.select(k == i + 1, row, chosen)
            dr.scatter(self.flat, chosen, number * self.count + k, active)
            return (k + 1,)

        if rest:
            dr.while_loop((0 * dr.uint32_array_t(type(number))(number),), lambda k: k < self.count, write)
        else:
            dr.scatter(self.flat, first, number, active)


def room(types: Any, count: int, items: int) -> Rows:
    """Rows to be written; for frozen functions from outside, since what they make themselves keeps its length."""
    return Rows(dr.empty(types.Float, 4 * count * items), count)
