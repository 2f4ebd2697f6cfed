"""What each stage of a run costs: wall and processor seconds."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Seconds:
    """Wall and processor seconds of this process by stage, and `total`."""

    wall: dict[str, float]
    cpu: dict[str, float]


class Stopwatch:
    """Adds up the seconds of named stages; a stage may be entered more than once."""

    def __init__(self) -> None:
        """Start the total."""
        self._started = (time.perf_counter(), time.process_time())
        self._wall: dict[str, float] = {}
        self._cpu: dict[str, float] = {}

    def __call__(self, stage: str, work: Callable[P, T], *arguments: P.args, **keywords: P.kwargs) -> T:
        """Return what a piece of work returns, its seconds counted to a stage."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            return work(*arguments, **keywords)
        finally:
            self._wall[stage] = self._wall.get(stage, 0.0) + time.perf_counter() - wall
            self._cpu[stage] = self._cpu.get(stage, 0.0) + time.process_time() - cpu

    def seconds(self) -> Seconds:
        """Return the seconds of every stage so far, to the millisecond, and of the whole since the start."""
        wall = {**self._wall, "total": time.perf_counter() - self._started[0]}
        cpu = {**self._cpu, "total": time.process_time() - self._started[1]}
        return Seconds(wall=_rounded(wall), cpu=_rounded(cpu))


def _rounded(seconds: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 3) for name, value in seconds.items()}
