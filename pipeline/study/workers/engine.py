"""Where the tasks of a study run: a pool of processes on this machine, or a cluster; lost workers lose no task."""

import os
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Generic, TypeVar

from cad.quantity import validation_error
from pipeline.study.workers.pool import ProcessPool, WorkerLostError

Given = TypeVar("Given")
Found = TypeVar("Found")

MOST_PROCESSES = 1024
ATTEMPTS = 5  # of a task whose worker was lost
_IN_FLIGHT = 4  # tasks a worker: enough that none waits, few enough that a million need no memory
_LISTEN_S = 5.0  # after which the engine is asked again whether answers can still come
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def _shut(executor: Executor) -> None:
    executor.shutdown(wait=False, cancel_futures=True)


def _no_check() -> None:
    """Accept workers that start anew by themselves."""


@dataclass(frozen=True, kw_only=True)
class Engine:
    """Opens and closes executors, says how many workers they have, and which errors mean that a worker was lost.

    `check` raises InputError where no answer can come any more, as all workers are gone for good.
    """

    open: Callable[[], Executor]
    workers: int
    lost: tuple[type[Exception], ...]
    close: Callable[[Executor], None] = _shut
    check: Callable[[], None] = _no_check


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0))


@contextmanager
def process_engine(processes: int | None = None) -> Iterator[Engine]:
    """Give a pool of processes, one for each core if no number is given; each computes on one thread.

    Sums in one order give the same bits in every pool. Raises InputError for a number that is none.
    """
    count = available_cores() if processes is None else processes
    if not 1 <= count <= MOST_PROCESSES:
        raise validation_error(
            "--processes", count, "", f"at least 1 and at most {MOST_PROCESSES}", "leave it out for all cores"
        )
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield Engine(open=lambda: ProcessPool(count), workers=count, lost=(WorkerLostError,))
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def completed(
    engine: Engine, work: Callable[[Given], Found], given: Iterable[Given], lost: Callable[[Given], Found]
) -> Generator[Found]:
    """Yield what a piece of work makes of each thing given, in the order in which they end.

    A thing whose worker was lost is given again; after five times `lost` says what becomes of it. Raises InputError
    where the engine has no workers any more.
    """
    flight = _Flight(engine, work, given)
    try:
        while flight.fill():
            yield from flight.land(lost)
    finally:
        engine.close(flight.executor)


class _Flight(Generic[Given, Found]):
    """The things that workers have at the moment, and those that wait to be given again."""

    def __init__(self, engine: Engine, work: Callable[[Given], Found], given: Iterable[Given]) -> None:
        """Open an executor."""
        self.executor = engine.open()
        self._engine, self._work, self._source = engine, work, iter(given)
        self._waiting: dict[Future[Found], tuple[Given, int]] = {}
        self._again: list[tuple[Given, int]] = []
        self._checked = time.monotonic()

    def fill(self) -> bool:
        """Give things out until every worker has some; say whether any are out."""
        while len(self._waiting) < self._engine.workers * _IN_FLIGHT:
            try:
                thing, attempts = self._again.pop() if self._again else (next(self._source), 0)
            except StopIteration:
                break
            try:
                self._waiting[self.executor.submit(self._work, thing)] = thing, attempts
            except self._engine.lost:
                self._again.append((thing, attempts))
                break
        return bool(self._waiting or self._again)

    def land(self, lost: Callable[[Given], Found]) -> Iterator[Found]:
        """Yield what has ended, at least one thing or none where workers were lost."""
        done, _ = wait(self._waiting, timeout=_LISTEN_S, return_when=FIRST_COMPLETED)
        for future in done:
            thing, attempts = self._waiting.pop(future)
            try:
                found = future.result()
            except self._engine.lost:
                if attempts + 1 < ATTEMPTS:
                    self._again.append((thing, attempts + 1))
                    continue
                found = lost(thing)
            yield found
        if self._again or not done or time.monotonic() - self._checked > _LISTEN_S:
            self._engine.check()
            self._checked = time.monotonic()
