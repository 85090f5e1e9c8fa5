"""What is said of a frame or a picture: which stages it takes, which are left out, and why."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """A stage, whether it runs, and on what, or why it does not."""

    name: str
    ran: bool
    why: str


@dataclass(frozen=True)
class Explanation:
    """The stages of a picture in order; printed, a line each."""

    steps: tuple[Step, ...]

    @property
    def ran(self) -> tuple[str, ...]:
        """Names of the stages that run."""
        return tuple(step.name for step in self.steps if step.ran)

    @property
    def left_out(self) -> dict[str, str]:
        """Names of the stages that are left out, and why."""
        return {step.name: step.why for step in self.steps if not step.ran}

    def __str__(self) -> str:
        wide = max((len(step.name) for step in self.steps), default=0)
        return "\n".join(f"{'runs' if s.ran else 'left out':8}  {s.name:{wide}}  {s.why}" for s in self.steps)


def timed_steps(stages: Mapping[str, float], method: str) -> Iterator[Step]:
    """The stages that a method times, for methods that have no more to say of themselves."""
    for name in stages:
        yield Step(name, True, f"of method {method!r}")
