"""One row per case of a stress run, and the table of them."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Case:
    """What one case of one model came to.

    count: inputs tried. worst: largest error in units of eps times the condition number (NaN where none is measured).
    missed: inputs with a true answer that came back invalid, or parts of the truth that a bound left out. invented:
    inputs without a true answer that came back valid.
    """

    model: str
    case: str
    precision: str
    count: int
    worst: float
    missed: int
    invented: int

    def good(self, limit: float) -> bool:
        """Nothing missed, nothing invented, and the error within the limit."""
        return self.missed == 0 and self.invented == 0 and not self.worst > limit


def as_dicts(cases: list[Case]) -> list[dict[str, Any]]:
    """Rows for JSON; an error that was not measured is None."""
    return [asdict(case) | {"worst": None if case.worst != case.worst else case.worst} for case in cases]


def print_cases(cases: list[Case], limit: float, console: Any) -> None:
    """The table on a terminal, failures in red."""
    from rich.table import Table

    table = Table(box=None, padding=(0, 1))
    for name in ("model", "case", "precision"):
        table.add_column(name)
    for name in ("inputs", "error / eps cond", "missed", "invented"):
        table.add_column(name, justify="right")
    for case in cases:
        worst = "" if case.worst != case.worst else f"{case.worst:.2g}"
        cells = (case.model, case.case, case.precision, f"{case.count:,}", worst, str(case.missed), str(case.invented))
        table.add_row(*cells, style=None if case.good(limit) else "bold red")
    console.print(table)
