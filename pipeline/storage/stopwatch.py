"""Measurement of the wall-clock and CPU time of each stage of a run, with a callback when a stage begins."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

Progress = Callable[[str], None]
"""A function that is called with a description of the current stage."""

Count = Callable[[int, int], None]
"""A function that is called with the number of finished parts of the work, and the number of all parts."""

WORK = {
    "contact": "compliance of the fruit under the tips, meshed and solved",
    "sizing": "springs that the targets require",
    "springs": "both springs, meshed, solved and fitted by finite elements",
    "solids": "solids, their files and the checks of both",
    "response": "forces as a function of travel and modulus",
    "reading": "readings of the sensor in every pose",
    "verdicts": "verdicts",
    "errors": "error budget of each number",
    "fabrication": "files for fabrication, and the springs across the plate",
    "behaviour": "tilt, stiffening and frequency of the springs",
    "fields": "displacement and stress for ParaView",
}
"""The descriptions of the stages of a run, which are shown as progress."""


@dataclass(frozen=True, kw_only=True)
class Seconds:
    """The wall-clock and CPU time [s] that this process spent in each stage, and in `total`."""

    wall: dict[str, float]
    cpu: dict[str, float]


def ignore_progress(*_: object) -> None:
    """Do nothing; this is the default for callers that do not show progress."""


class Stopwatch:
    """A stopwatch that adds up the time of named stages.

    A stage may be entered several times, also inside another stage. The time of a nested stage is added only to the
    inner stage.
    """

    def __init__(self, progress: Progress = ignore_progress) -> None:
        """Start measuring the total time; `progress` is called with the description of each stage that begins."""
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
        """Add the time spent in the block to a stage, and report the description of the stage as progress.

        A stage that is entered twice in a row is reported only once. If the block contains another stage, the time of
        the inner stage is not added.
        """
        description = f"{stage}: {WORK[stage]}" if stage in WORK else stage
        if description != self._description:
            self._description = description
            self._progress(description)
        self._count()  # the time until now belongs to the enclosing stage
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
        """Return the time of each stage until now, and the total time since the start [s], rounded to milliseconds."""
        wall = {**self._wall, "total": time.perf_counter() - self._wall_start}
        cpu = {**self._cpu, "total": time.process_time() - self._cpu_start}
        return Seconds(
            wall={name: round(value, 3) for name, value in wall.items()},
            cpu={name: round(value, 3) for name, value in cpu.items()},
        )
