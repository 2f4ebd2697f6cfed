"""The answer to a task that may be worked on elsewhere, and what it cost."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Done(Generic[T]):
    """What a task gave, and the wall and processor seconds that it took where it was done."""

    value: T
    wall: float = 0.0
    cpu: float = 0.0


class Answer(Generic[T]):
    """Waits for what a task gives, once; whoever asks again is told the same."""

    def __init__(self, wait: Callable[[], Done[T]]) -> None:
        """Keep what waits for the task, or does it."""
        self._wait = wait
        self._done: Done[T] | None = None

    def done(self) -> Done[T]:
        """Return what the task gave with its seconds; raises what the task raised."""
        if self._done is None:
            self._done = self._wait()
        return self._done

    def result(self) -> T:
        """Return what the task gave; raises what the task raised."""
        return self.done().value


def known(value: T) -> Answer[T]:
    """Return the answer to a task that need not be done, in no time."""
    return Answer(lambda: Done(value=value))


def timed(work: Callable[..., T], given: tuple[object, ...]) -> Done[T]:
    """Do a piece of work here and return what it gives with its seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    value = work(*given)
    return Done(value=value, wall=time.perf_counter() - wall, cpu=time.process_time() - cpu)
