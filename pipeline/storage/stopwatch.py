"""What each stage of a run costs, wall and processor seconds; who listens is told which one begins."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

Progress = Callable[[str], None]
"""Is told what is worked on from here on."""

Count = Callable[[int, int], None]
"""Is told how many parts of a piece of work have ended, and how many there are."""

WORK = {
    "contact": "how the fruit gives under the tips, meshed and solved",
    "sizing": "springs that the targets ask for",
    "springs": "both springs, meshed, solved and fitted by finite elements",
    "solids": "solids, their files and the checks of both",
    "response": "forces over travel and modulus",
    "reading": "what the sensor reads in every pose",
    "verdicts": "verdicts",
    "errors": "what each error is made of",
    "fabrication": "files for fabrication, and the springs across the plate",
    "behaviour": "how the springs tilt, stiffen and ring",
    "fields": "displacement and stress for ParaView",
}
"""What a stage of a run does, in words."""


@dataclass(frozen=True, kw_only=True)
class Seconds:
    """Wall and processor seconds of this process by stage, and `total`."""

    wall: dict[str, float]
    cpu: dict[str, float]


def silent(*_: object) -> None:
    """Hear progress and say nothing."""


class Stopwatch:
    """Adds up the seconds of named stages, which may be entered again, and inside each other: the inner one counts."""

    def __init__(self, progress: Progress = silent) -> None:
        """Start the total; `progress` is told of each stage that is another than the one before."""
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
        """Count the seconds of a block to a stage."""
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
        """Count the seconds since the last count to the innermost stage."""
        wall = time.perf_counter()
        cpu = time.process_time()
        if self._entered:
            stage = self._entered[-1]
            self._wall[stage] = self._wall.get(stage, 0.0) + wall - self._wall_counted
            self._cpu[stage] = self._cpu.get(stage, 0.0) + cpu - self._cpu_counted
        self._wall_counted = wall
        self._cpu_counted = cpu

    def seconds(self) -> Seconds:
        """Return the seconds of every stage so far, to the millisecond, and of the whole since the start."""
        wall = {**self._wall, "total": time.perf_counter() - self._wall_start}
        cpu = {**self._cpu, "total": time.process_time() - self._cpu_start}
        return Seconds(
            wall={name: round(value, 3) for name, value in wall.items()},
            cpu={name: round(value, 3) for name, value in cpu.items()},
        )
