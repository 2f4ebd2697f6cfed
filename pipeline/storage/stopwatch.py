"""Wall and processor seconds of each stage of a run; a listener is called when a stage begins."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

Progress = Callable[[str], None]
"""Called with the current piece of work."""

Count = Callable[[int, int], None]
"""Called with the number of finished parts of a piece of work, and their total."""

WORK = {
    "contact": "compliance of the fruit under the tips, meshed and solved",
    "sizing": "springs that the targets require",
    "springs": "both springs, meshed, solved and fitted by finite elements",
    "solids": "solids, their files and the checks of both",
    "response": "forces over travel and modulus",
    "reading": "readings of the sensor in every pose",
    "verdicts": "verdicts",
    "errors": "parts of each error",
    "fabrication": "files for fabrication, and the springs across the plate",
    "behaviour": "tilt, stiffening and frequency of the springs",
    "fields": "displacement and stress for ParaView",
}
"""Descriptions of the stages of a run."""


@dataclass(frozen=True, kw_only=True)
class Seconds:
    """Wall and processor seconds of this process by stage, and `total`."""

    wall: dict[str, float]
    cpu: dict[str, float]


def silent(*_: object) -> None:
    """Ignore progress."""


class Stopwatch:
    """Adds up the seconds of named stages, which may be entered again and nested.

    Nested time counts for the inner stage.
    """

    def __init__(self, progress: Progress = silent) -> None:
        """Start the total; `progress` is called with each new stage."""
        self._progress = progress
        self._told = ""
        self._wall_start = time.perf_counter()
        self._cpu_start = time.process_time()
        self._wall_counted = self._wall_start
        self._cpu_counted = self._cpu_start
        self._wall: dict[str, float] = {}
        self._cpu: dict[str, float] = {}
        self._entered: list[str] = []

    @contextmanager
    def stage(self, stage: str) -> Iterator[None]:
        """Add the seconds of a block to a stage."""
        told = f"{stage}: {WORK[stage]}" if stage in WORK else stage
        if told != self._told:
            self._told = told
            self._progress(told)
        self._count()
        self._entered.append(stage)
        try:
            yield
        finally:
            self._count()
            self._entered.pop()

    def _count(self) -> None:
        """Add the seconds since the last call to the innermost stage."""
        wall = time.perf_counter()
        cpu = time.process_time()
        if self._entered:
            stage = self._entered[-1]
            self._wall[stage] = self._wall.get(stage, 0.0) + wall - self._wall_counted
            self._cpu[stage] = self._cpu.get(stage, 0.0) + cpu - self._cpu_counted
        self._wall_counted = wall
        self._cpu_counted = cpu

    def seconds(self) -> Seconds:
        """Return the seconds of every stage until now, to the millisecond, and the total since the start."""
        wall = {**self._wall, "total": time.perf_counter() - self._wall_start}
        cpu = {**self._cpu, "total": time.process_time() - self._cpu_start}
        return Seconds(
            wall={name: round(value, 3) for name, value in wall.items()},
            cpu={name: round(value, 3) for name, value in cpu.items()},
        )
