"""Processes beside this one: loky's, behind the interface of `concurrent.futures`."""

import os
import signal
import tempfile
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TypeVar

from cad.kernel import load_kernel
from pipeline.storage.interrupts import interruptible, signals_for_this_thread, uninterrupted
from sensor.quantity import validation_error

T = TypeVar("T")
_PROC = Path("/proc/self")

# On one thread sums have one order, and so the same bits in every process.
ONE_THREAD = dict.fromkeys(("MKL_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
# Of a crash BrokenExecutor tells; loky would dump the stack too. An empty text turns that off, any other one on.
_ENVIRONMENT = {**ONE_THREAD, "PYTHONFAULTHANDLER": ""}
_LOKY = r"loky\.process_executor"  # not the one inside joblib
_IDLE_SECONDS = 20.0  # after which a worker ends by itself: the workers of a killed process have no other end


def available_cores() -> int:
    """Return how many cores this process may use; one where there is no /proc, without which no worker lives."""
    if not _PROC.is_dir():
        return 1
    return len(os.sched_getaffinity(0))


def open_workers(count: int) -> Executor:
    """Return an executor of some processes, each on one thread; `close_workers` ends it.

    Raises InputError without /proc, where loky's workers look up how much memory they hold.
    """
    if not _PROC.is_dir():
        raise validation_error(
            "/proc", "absent", "", "mounted for worker processes", "mount it, or use another machine"
        )
    from loky import ProcessPoolExecutor

    # Once it has meshed and solved, a worker holds more memory. loky then starts another one, and nothing is lost.
    warnings.filterwarnings("ignore", "A worker was restarted", UserWarning, _LOKY)

    class Workers(ProcessPoolExecutor):  # type: ignore[misc]  # loky is untyped
        """Processes with a folder of their own for what a worker that is killed leaves unfinished."""

        def __init__(self) -> None:
            self.folder = tempfile.TemporaryDirectory(prefix="twintip-", ignore_cleanup_errors=True)
            environment = {**_ENVIRONMENT, "TMPDIR": self.folder.name}
            with uninterrupted():  # its start unblocks both signals: the first worker would inherit them so
                resource_tracker.ensure_running()
            super().__init__(count, timeout=_IDLE_SECONDS, initializer=_prepare_worker, env=environment)

        def submit(self, *call: object, **named: object) -> Future[object]:
            with signals_for_this_thread():  # it may start a process
                future: Future[object] = super().submit(*call, **named)
            return future

        def shutdown(self, **how: object) -> None:
            super().shutdown(**how)
            self.folder.cleanup()

    executor: Executor = Workers()
    return executor


def close_workers(executor: Executor) -> None:
    """End the processes of an executor, whatever they are at."""
    with uninterrupted():
        executor.shutdown(kill_workers=True)  # type: ignore[call-arg]  # loky's own argument


@contextmanager
def cad_worker(wanted: bool = True) -> Iterator[Executor | None]:
    """Give a process for the CAD kernel, which imports it beside the solves; None where there is no core for it."""
    if not wanted or available_cores() == 1:
        yield None
        return
    with uninterrupted():
        executor = open_workers(1)
        try:
            executor.submit(load_kernel)
            with interruptible():
                yield executor
        finally:
            close_workers(executor)


def submit(executor: Executor | None, work: Callable[..., T], *arguments: object) -> Future[T]:
    """Return the future of a call in another process; without an executor the call is made here, at once."""
    if executor is not None:
        return executor.submit(work, *arguments)
    return finished_future(work(*arguments))


def finished_future(value: T) -> Future[T]:
    """Return a future that has its result."""
    future: Future[T] = Future()
    future.set_result(value)
    return future


def _prepare_worker() -> None:
    """Hear SIGTERM, as a worker inherits both signals blocked, and never Ctrl-C; keep quiet about library warnings."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    warnings.simplefilter("ignore")
