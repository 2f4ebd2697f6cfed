"""Worker processes from the library loky, with the interface of `concurrent.futures`."""

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

from loky import ProcessPoolExecutor

from cad.kernel import load_kernel
from pipeline.storage.interrupts import interruptible, signals_for_this_thread, uninterrupted
from sensor.quantity import validation_error

T = TypeVar("T")
_PROC = Path("/proc/self")

# With a single thread, sums are always computed in the same order, so all processes give bitwise identical results.
ONE_THREAD = dict.fromkeys(("MKL_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
# A crash is reported by BrokenExecutor, so loky's stack dump is disabled. Only an empty string disables the dump.
_ENVIRONMENT = {**ONE_THREAD, "PYTHONFAULTHANDLER": ""}
_LOKY = r"loky\.process_executor"  # does not match the copy of loky inside joblib
_IDLE_SECONDS = 20.0  # time after which an idle worker ends; if this process is killed, only this ends its workers


def available_cores() -> int:
    """Return the number of cores that this process may use; 1 without /proc, because workers need it."""
    if not _PROC.is_dir():
        return 1
    return len(os.sched_getaffinity(0))


class _Workers(ProcessPoolExecutor):  # type: ignore[misc]  # loky is untyped
    """Worker processes with their own temporary folder, so that the files of a killed worker are also removed."""

    def __init__(self, count: int) -> None:
        self.folder = tempfile.TemporaryDirectory(prefix="twintip-", ignore_cleanup_errors=True)
        environment = {**_ENVIRONMENT, "TMPDIR": self.folder.name}
        # Starting the resource tracker unblocks both signals. The tracker is started here, because the first worker
        # would otherwise start it and inherit the unblocked state.
        with uninterrupted():
            resource_tracker.ensure_running()
        super().__init__(count, timeout=_IDLE_SECONDS, initializer=_prepare_worker, env=environment)

    def submit(self, *call: object, **named: object) -> Future[object]:
        with signals_for_this_thread():  # `submit` may start a process
            future: Future[object] = super().submit(*call, **named)
        return future

    def shutdown(self, **options: object) -> None:
        super().shutdown(**options)
        self.folder.cleanup()


def open_workers(count: int) -> Executor:
    """Return an executor with `count` processes of one thread each; `close_workers` ends it.

    A process is started when it is first needed. Raises InputError if there is no /proc, which loky's workers read to
    check their memory.
    """
    if not _PROC.is_dir():
        raise validation_error(
            "/proc", "absent", "", "mounted for worker processes", "mount it, or use another machine"
        )
    # The memory of a worker grows as it meshes and solves. loky then replaces the worker without losing work, so its
    # warning is not useful.
    warnings.filterwarnings("ignore", "A worker was restarted", UserWarning, _LOKY)
    executor: Executor = _Workers(count)
    return executor


def close_workers(executor: Executor) -> None:
    """End the processes of an executor immediately."""
    with uninterrupted():
        executor.shutdown(kill_workers=True)  # type: ignore[call-arg]  # only loky has this argument


@contextmanager
def cad_worker(wanted: bool = True) -> Iterator[Executor | None]:
    """Yield an executor with one worker process, which imports the CAD kernel while this process solves.

    The process ends with the block. Yields None if no worker is `wanted`, or if only one core is available, because
    another process would then save no time.
    """
    if not wanted or available_cores() == 1:
        yield None
        return
    with uninterrupted():  # a signal must not arrive between opening and closing the executor
        executor = open_workers(1)
        try:
            executor.submit(load_kernel)  # its result is not needed
            with interruptible():
                yield executor
        finally:
            close_workers(executor)


def submit(executor: Executor | None, work: Callable[..., T], *arguments: object) -> Future[T]:
    """Call `work` with the given arguments in another process, and return the future of its result.

    Without an executor, the call is made immediately in this process.
    """
    if executor is not None:
        return executor.submit(work, *arguments)
    return finished_future(work(*arguments))


def finished_future(value: T) -> Future[T]:
    """Return a future that already has the result `value`."""
    future: Future[T] = Future()
    future.set_result(value)
    return future


def _prepare_worker() -> None:
    """Prepare a worker process: ignore Ctrl-C, unmask SIGTERM, which it inherits masked, and suppress warnings."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    warnings.simplefilter("ignore")
