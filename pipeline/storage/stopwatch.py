"""What each stage of a run costs: wall and processor seconds."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Adds up the seconds of named stages; a stage may be entered more than once."""

    def __init__(self) -> None:
        """Start the total."""
        self._started = (time.perf_counter(), time.process_time())
        self._wall: dict[str, float] = {}
        self._cpu: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the seconds spent inside the block to a stage."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self._wall[name] = self._wall.get(name, 0.0) + time.perf_counter() - wall
            self._cpu[name] = self._cpu.get(name, 0.0) + time.process_time() - cpu

    def wall_seconds(self) -> dict[str, float]:
        """Return wall seconds by stage, and `total` since the start."""
        return _rounded({**self._wall, "total": time.perf_counter() - self._started[0]})

    def cpu_seconds(self) -> dict[str, float]:
        """Return processor seconds of this process by stage, and `total` since the start."""
        return _rounded({**self._cpu, "total": time.process_time() - self._started[1]})


def _rounded(seconds: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 3) for name, value in seconds.items()}
