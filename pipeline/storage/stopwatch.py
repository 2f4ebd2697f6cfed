"""Wall-clock and CPU time of each stage of a run; a listener is called when a stage begins."""

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
    """Wall-clock and CPU time of this process by stage, and in `total` [s]."""

    wall: dict[str, float]
    cpu: dict[str, float]


def silent(*_: object) -> None:
    """Ignore progress."""


class Stopwatch:
    """Adds up the time of named stages, each of which may be entered more than once and inside another stage.

    The time of a nested stage is counted only for the inner stage.
    """

    def __init__(self, progress: Progress = silent) -> None:
        """Start the total time; `progress` is called with the description of each new stage."""
        self._progress = progress
        self._description = ""
        self._wall_start = time.perf_counter()
        self._cpu_start = time.process_time()
        self._wall_last = self._wall_start
        self._cpu_last = self._cpu_start
        self._wall: dict[str, float] = {}
        self._cpu: dict[str, float] = {}
        self._open_stages: list[str] = []

    @contextmanager
    def stage(self, stage: str) -> Iterator[None]:
        """Add the time of a block to a stage."""
        description = f"{stage}: {WORK[stage]}" if stage in WORK else stage
        if description != self._description:
            self._description = description
            self._progress(description)
        self._count()
        self._open_stages.append(stage)
        try:
            yield
        finally:
            self._count()
            self._open_stages.pop()

    def _count(self) -> None:
        """Add the time since the last call to the innermost stage."""
        wall = time.perf_counter()
        cpu = time.process_time()
        if self._open_stages:
            stage = self._open_stages[-1]
            self._wall[stage] = self._wall.get(stage, 0.0) + wall - self._wall_last
            self._cpu[stage] = self._cpu.get(stage, 0.0) + cpu - self._cpu_last
        self._wall_last = wall
        self._cpu_last = cpu

    def seconds(self) -> Seconds:
        """Return the time of every stage until now and the total since the start [s], rounded to milliseconds."""
        wall = {**self._wall, "total": time.perf_counter() - self._wall_start}
        cpu = {**self._cpu, "total": time.process_time() - self._cpu_start}
        return Seconds(
            wall={name: round(value, 3) for name, value in wall.items()},
            cpu={name: round(value, 3) for name, value in cpu.items()},
        )
