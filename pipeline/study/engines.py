"""Workers that solve the points of a study: processes of this machine, or a running Dask cluster."""

import asyncio
import logging
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, TypeVar

from pipeline.storage.versions import code_digest
from pipeline.storage.workers import available_cores, close_workers, open_workers
from sensor.quantity import InputError, validation_error

if TYPE_CHECKING:
    from distributed import Client

Item = TypeVar("Item")
Result = TypeVar("Result")

MAX_PROCESSES = 1024
_RETRIES = 2  # number of retries of an item whose worker was lost
_IN_FLIGHT = 4  # submitted items per worker: enough that no worker is idle, few enough that a million need no memory
_CHECK_SECONDS = 5.0  # time without a result after which the engine is checked
_CONNECT_SECONDS = 4  # time allowed for a scheduler to accept a connection
_ANSWER_SECONDS = 15  # time allowed for a scheduler to answer
_WITHOUT_WORKERS_SECONDS = 120  # time allowed for a lost worker to be restarted


@dataclass(kw_only=True)
class Engine:
    """Workers that persist between studies, behind an executor that is opened when the first item is submitted.

    `open` and `close` start and end the executor, and `lost` lists the exceptions that it raises for a lost worker.
    `check` raises InputError if no result can arrive any more, because all workers are permanently lost.
    """

    open: Callable[[], Executor]
    close: Callable[[Executor], None]
    workers: int
    lost: tuple[type[Exception], ...]
    check: Callable[[], None] = lambda: None
    _executor: Executor | None = field(default=None, init=False)

    def submit(self, work: Callable[[Item], Result], item: Item) -> Future[Result]:
        """Submit `work` on an item to the workers, and return its future."""
        try:
            return self._current_executor().submit(work, item)
        except self.lost:  # an executor that has lost a worker accepts no more work, so another one is opened
            self.check()
            self.end()
            return self._current_executor().submit(work, item)

    def _current_executor(self) -> Executor:
        if self._executor is None:
            self._executor = self.open()
        return self._executor

    def end(self) -> None:
        """Close the executor immediately. The next submitted item opens another one."""
        executor, self._executor = self._executor, None
        if executor is not None:
            self.close(executor)


def completed_items(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item], if_lost: Callable[[Item], Result]
) -> Generator[tuple[Item, Result]]:
    """Yield each item with the result of `work` on it, in the order of completion.

    Items whose worker was lost are retried at the end, one at a time, because an item may be the cause of the loss. If
    the worker is lost each time, `if_lost` gives the result. Raises InputError if the engine has no workers any more.
    """
    lost_items: list[Item] = []
    yield from _run_items(engine, work, items, engine.workers * _IN_FLIGHT, lost_items)
    for _ in range(_RETRIES):
        if lost_items:
            engine.check()
            retried_items = lost_items
            lost_items = []
            yield from _run_items(engine, work, retried_items, 1, lost_items)
    for item in lost_items:
        yield item, if_lost(item)


def _run_items(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item], max_in_flight: int, lost_items: list[Item]
) -> Generator[tuple[Item, Result]]:
    """Yield each item with its result, in the order of completion.

    At most `max_in_flight` items are submitted at a time. An item whose worker was lost is appended to `lost_items`.
    """
    waiting = iter(items)
    running: dict[Future[Result], Item] = {}
    # Finished futures put themselves into a queue, because polling all of them would take longer than a task.
    finished: SimpleQueue[Future[Result]] = SimpleQueue()
    try:
        while True:
            for item in islice(waiting, max_in_flight - len(running)):
                future = engine.submit(work, item)
                running[future] = item
                future.add_done_callback(finished.put)
            if not running:
                return
            try:
                future = finished.get(timeout=_CHECK_SECONDS)
            except Empty:
                engine.check()
                continue
            item = running.pop(future)
            try:
                result = future.result()
            except engine.lost:
                lost_items.append(item)
            else:
                yield item, result
    finally:
        if running:  # the caller stopped early or an error occurred, so nothing needs these results
            engine.end()


def chosen_engine(processes: int | None, scheduler: str | None) -> AbstractContextManager[Engine]:
    """Return the engine that the flags request: the cluster of a scheduler, or processes on this machine.

    Raises InputError if both a scheduler and a number of processes are given.
    """
    if processes is not None and scheduler is not None:
        hint = "leave it out: the cluster has its own workers"
        raise validation_error("--processes", processes, "", "left out if --scheduler is given", hint)
    return process_engine(processes) if scheduler is None else cluster_engine(scheduler)


@contextmanager
def process_engine(processes: int | None = None) -> Iterator[Engine]:
    """Start the processes that solve the points of a study, for a `with` statement.

    Each process has one thread. All processes end when the statement ends.

    Parameters
    ----------
    processes : int, optional
        The number of processes; by default one for each core.

    Yields
    ------
    Engine
        The engine for `run_study`, which may serve several studies.

    Raises
    ------
    InputError
        If the number of processes is less than 1 or too large.

    Examples
    --------
    >>> study = twintip.read_study(Path("springs.toml"))
    >>> with twintip.process_engine(processes=2) as engine:
    ...     solved = twintip.run_study(study, Path("outputs/springs"), engine)
    >>> solved.points
    4
    """
    count = available_cores() if processes is None else processes
    if not 1 <= count <= MAX_PROCESSES:
        bound = f"at least 1 and at most {MAX_PROCESSES}"
        raise validation_error("--processes", count, "", bound, "leave it out for all cores")
    engine = Engine(open=lambda: open_workers(count), close=close_workers, workers=count, lost=(BrokenExecutor,))
    try:
        yield engine
    finally:
        engine.end()


@contextmanager
def cluster_engine(address: str) -> Iterator[Engine]:
    """Yield an engine whose workers belong to the Dask scheduler at `address`, for instance tcp://127.0.0.1:8786.

    Raises InputError if the package `distributed` is missing, the scheduler does not answer, it has no workers, or a
    worker runs different code.
    """
    try:
        from distributed.client import ClosedClientError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        hint = "install it with: pip install 'twintip[cluster]'"
        raise validation_error(
            "--scheduler", address, "", "used where the package distributed is installed", hint
        ) from error
    # A lost cluster is reported as an error of one line, so the log messages of `distributed` are suppressed. It sets
    # the level of each of these loggers itself.
    for name in ("distributed", "distributed.client", "tornado", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    client = _connect(address)

    def check() -> None:
        try:
            if client.scheduler is None:  # the client has given up
                raise ConnectionError
            client.wait_for_workers(1, timeout=_WITHOUT_WORKERS_SECONDS)
        except (OSError, RuntimeError) as error:
            bound = "the address of a scheduler that still answers and has workers"
            hint = "all finished points are kept; start the scheduler again and repeat the command"
            raise validation_error("--scheduler", address, "", bound, hint) from error

    def close(executor: Executor) -> None:
        with suppress(OSError, RuntimeError):  # a scheduler that is gone needs no shutdown
            executor.shutdown(wait=False)

    try:
        _refuse_other_code(client, address)
        yield Engine(
            open=lambda: client.get_executor(pure=False),  # the same item, submitted again, is a new task
            close=close,
            workers=sum(client.nthreads().values()),
            lost=(KilledWorker, CancelledError, ClosedClientError),
            check=check,
        )
    finally:
        with suppress(OSError):
            client.close()


def _connect(address: str) -> "Client":
    """Return a client of the scheduler at an address; raises InputError if no scheduler answers there."""
    from distributed import Client
    from distributed.comm import connect

    async def greet() -> None:
        connection = await connect(address, timeout=_CONNECT_SECONDS)
        await connection.close()

    try:
        asyncio.run(greet())  # a client without a scheduler would block for half a minute when it is closed
        return Client(address, timeout=_ANSWER_SECONDS, set_as_default=False)
    except (OSError, ValueError, RuntimeError, MemoryError) as error:  # MemoryError: something else answered
        hint = "start it with dask scheduler, and check the address"
        raise validation_error("--scheduler", address, "", "the address of a scheduler that answers", hint) from error


def _refuse_other_code(client: "Client", address: str) -> None:
    """Raise InputError if a cluster has no workers, or if a worker runs different code from this machine."""
    try:
        digests: dict[str, str] = client.run(code_digest)
    except ImportError as error:
        msg = "--scheduler: twintip is missing on a worker; install the version of this machine there"
        raise InputError(msg) from error
    if not digests:
        raise validation_error("--scheduler", address, "", "one with workers", "start some with: dask worker ADDRESS")
    for worker, digest in digests.items():
        if digest != code_digest():
            msg = f"--scheduler: worker {worker} runs different code from this machine; install the same version there"
            raise InputError(msg)
