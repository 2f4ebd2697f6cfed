"""Worker processes of the library loky, with the interface of `concurrent.futures`."""

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

# With one thread, sums are always added in the same order, so results are equal to the last bit in every process.
ONE_THREAD = dict.fromkeys(("MKL_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
# A crash is reported by BrokenExecutor, so loky's dump of the stack is turned off. Only an empty text does that.
_ENVIRONMENT = {**ONE_THREAD, "PYTHONFAULTHANDLER": ""}
_LOKY = r"loky\.process_executor"  # not the copy inside joblib
_IDLE_SECONDS = 20.0  # time after which an idle worker ends; nothing else ends the workers of a killed process


def available_cores() -> int:
    """Return the number of cores that this process may use; 1 without /proc, where no worker can run."""
    if not _PROC.is_dir():
        return 1
    return len(os.sched_getaffinity(0))


def open_workers(count: int) -> Executor:
    """Return an executor of `count` processes with one thread each; `close_workers` ends it.

    Raises InputError if there is no /proc, which loky's workers read to check their memory.
    """
    if not _PROC.is_dir():
        raise validation_error(
            "/proc", "absent", "", "mounted for worker processes", "mount it, or use another machine"
        )
    # The memory of a worker grows while it meshes and solves. loky then replaces the worker without losing work, so its
    # warning is of no use.
    warnings.filterwarnings("ignore", "A worker was restarted", UserWarning, _LOKY)

    class Workers(ProcessPoolExecutor):  # type: ignore[misc]  # loky is untyped
        """Worker processes with a temporary folder of their own, so that files of a killed worker are removed too."""

        def __init__(self) -> None:
            self.folder = tempfile.TemporaryDirectory(prefix="twintip-", ignore_cleanup_errors=True)
            environment = {**_ENVIRONMENT, "TMPDIR": self.folder.name}
            # The start of the resource tracker unblocks both signals. It is started here, because otherwise the first
            # worker would inherit that state.
            with uninterrupted():
                resource_tracker.ensure_running()
            super().__init__(count, timeout=_IDLE_SECONDS, initializer=_prepare_worker, env=environment)

        def submit(self, *call: object, **named: object) -> Future[object]:
            with signals_for_this_thread():  # submit may start a process
                future: Future[object] = super().submit(*call, **named)
            return future

        def shutdown(self, **how: object) -> None:
            super().shutdown(**how)
            self.folder.cleanup()

    executor: Executor = Workers()
    return executor


def close_workers(executor: Executor) -> None:
    """End the processes of an executor immediately."""
    with uninterrupted():
        executor.shutdown(kill_workers=True)  # type: ignore[call-arg]  # loky's own argument


@contextmanager
def cad_worker(wanted: bool = True) -> Iterator[Executor | None]:
    """Yield a worker process for the CAD kernel, which imports the kernel while this process solves.

    Yields None if it is not `wanted`, or if there is only one core.
    """
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
    """Call `work` with these arguments in another process, and return the future of its result.

    Without an executor the call is made here at once.
    """
    if executor is not None:
        return executor.submit(work, *arguments)
    return finished_future(work(*arguments))


def finished_future(value: T) -> Future[T]:
    """Return a future that already has its result."""
    future: Future[T] = Future()
    future.set_result(value)
    return future


def _prepare_worker() -> None:
    """Prepare a worker process: unblock SIGTERM, which it inherits blocked, ignore Ctrl-C, and suppress warnings."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    warnings.simplefilter("ignore")
