"""What each stage of a run costs: wall and processor seconds."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

from pipeline.storage.announcement import announce

WORK = {
    "contact": "how the fruit gives under the tips, meshed and solved",
    "sizing": "springs that the targets ask for",
    "springs": "both springs, meshed, solved and fitted by finite elements",
    "solids": "solids, their files and the checks of both",
    "response": "forces over travel and modulus",
    "reading": "what the sensor reads in every pose",
    "verdicts": "verdicts",
    "mounts": "what other mounts do to the springs",
    "errors": "what each error is made of",
    "fabrication": "files for fabrication, and the springs across the plate",
    "behaviour": "modes of vibration",
    "fields": "displacement and stress for ParaView",
}
"""What a stage of a run does, in words."""

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
        _tell(stage)
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            return work(*arguments, **keywords)
        finally:
            self._add(stage, time.perf_counter() - wall, time.process_time() - cpu)

    @contextmanager
    def stage(self, stage: str) -> Iterator[None]:
        """Count the seconds of a block to a stage."""
        _tell(stage)
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self._add(stage, time.perf_counter() - wall, time.process_time() - cpu)

    def _add(self, stage: str, wall: float, cpu: float) -> None:
        self._wall[stage] = self._wall.get(stage, 0.0) + wall
        self._cpu[stage] = self._cpu.get(stage, 0.0) + cpu

    def seconds(self) -> Seconds:
        """Return the seconds of every stage so far, to the millisecond, and of the whole since the start."""
        wall = {**self._wall, "total": time.perf_counter() - self._started[0]}
        cpu = {**self._cpu, "total": time.process_time() - self._started[1]}
        return Seconds(wall=_rounded(wall), cpu=_rounded(cpu))


def _tell(stage: str) -> None:
    announce(f"{stage}: {WORK[stage]}" if stage in WORK else stage)


def _rounded(seconds: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 3) for name, value in seconds.items()}
