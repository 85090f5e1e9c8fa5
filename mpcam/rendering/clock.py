"""Seconds by stage of one frame, with the device brought to rest after each."""

import time
from typing import Any


class Clock:
    """Adds up time by stage name; `done(stage, arrays)` evaluates the arrays and books the time since the last call."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def done(self, stage: str, arrays: Any = None) -> None:
        import drjit as dr

        if arrays is not None:
            dr.eval(arrays)
        dr.sync_thread()
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
        self._last = now
