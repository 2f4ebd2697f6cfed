"""Engines that solve the points of a study, with processes on this machine or with a running Dask cluster."""

import asyncio
import logging
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
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
_RETRIES = 2  # maximum number of retries of an item whose worker was lost
_IN_FLIGHT = 4  # submitted items per worker: enough to keep all workers busy, few enough to limit memory
_CHECK_SECONDS = 5.0  # time without a result after which the engine is checked
_CONNECT_SECONDS = 4  # timeout for a scheduler to accept a connection
_ANSWER_SECONDS = 15  # timeout for a scheduler to answer
_WITHOUT_WORKERS_SECONDS = 120  # timeout for a lost worker to be restarted


@dataclass(kw_only=True)
class Engine:
    """A pool of workers that several studies can share.

    `open` starts an executor when the first item is submitted, and `close` ends it. `lost` lists the exceptions that
    the executor raises if a worker is lost. `check` raises InputError if all workers are permanently lost, so that no
    further result can arrive.
    """

    open: Callable[[], Executor]
    close: Callable[[Executor], None]
    workers: int
    lost: tuple[type[Exception], ...]
    check: Callable[[], None] = lambda: None
    _executor: Executor | None = field(default=None, init=False)

    def submit(self, work: Callable[[Item], Result], item: Item) -> Future[Result]:
        """Submit the call `work(item)` to the workers, and return its future."""
        try:
            return self._current_executor().submit(work, item)
        except self.lost:  # an executor that has lost a worker does not accept more work, so a new one is opened
            self.check()
            self.end()
            return self._current_executor().submit(work, item)

    def _current_executor(self) -> Executor:
        """Return the executor of the workers, which is opened on first use."""
        if self._executor is None:
            self._executor = self.open()
        return self._executor

    def end(self) -> None:
        """Close the executor immediately. The next submitted item opens a new one."""
        executor, self._executor = self._executor, None
        if executor is not None:
            self.close(executor)


def completed_items(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item], if_lost: Callable[[Item], Result]
) -> Generator[tuple[Item, Result]]:
    """Yield each item and the result of `work(item)`, in the order of completion.

    The workers of the engine do the `work`. An item whose worker was lost is retried at the end. No other item is then
    solved in parallel, because the item itself may be the cause of the loss. If the worker is lost in every attempt,
    the result is `if_lost(item)`. Raises InputError if the engine has no workers left.
    """
    lost_items: list[Item] = []  # `_run_items` appends to it
    yield from _run_items(engine, work, items, engine.workers * _IN_FLIGHT, lost_items)
    for _ in range(_RETRIES):
        if lost_items:
            engine.check()
            retried_items = lost_items
            lost_items = []  # receives the items that are lost again
            yield from _run_items(engine, work, retried_items, 1, lost_items)
    for item in lost_items:
        yield item, if_lost(item)


def _run_items(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item], max_in_flight: int, lost_items: list[Item]
) -> Generator[tuple[Item, Result]]:
    """Yield each item and the result of `work(item)`, in the order of completion.

    At most `max_in_flight` items are submitted at a time. An item whose worker was lost is appended to `lost_items`
    instead. If the caller stops early or an error occurs, the engine is ended. Raises InputError if the engine has no
    workers left.
    """
    waiting_items = iter(items)
    running: dict[Future[Result], Item] = {}
    # Each future puts itself into this queue when it is finished. Polling all futures would take longer than a task.
    finished: SimpleQueue[Future[Result]] = SimpleQueue()
    try:
        while True:
            for item in islice(waiting_items, max_in_flight - len(running)):
                future = engine.submit(work, item)
                running[future] = item
                future.add_done_callback(finished.put)
            if not running:
                return
            try:
                future = finished.get(timeout=_CHECK_SECONDS)
            except Empty:
                engine.check()  # raises InputError if all workers are lost
                continue  # the items only take long
            item = running.pop(future)
            try:
                result = future.result()
            except engine.lost:
                lost_items.append(item)
            else:
                yield item, result
    finally:
        if running:  # the loop ended early, so these results are not needed
            engine.end()


def chosen_engine(processes: int | None, scheduler: str | None) -> AbstractContextManager[Engine]:
    """Return the engine that the flags request: the cluster of a scheduler, or processes on this machine.

    Raises InputError if both a scheduler and a number of processes are given.
    """
    if processes is not None and scheduler is not None:
        hint = "leave it out, because the cluster has its own workers"
        raise validation_error("--processes", processes, "", "left out if --scheduler is given", hint)
    return process_engine(processes) if scheduler is None else cluster_engine(scheduler)


@contextmanager
def process_engine(processes: int | None = None) -> Iterator[Engine]:
    """Provide processes on this machine that solve the points of a study, as a context manager.

    Each process has one thread. All processes end when the `with` statement ends.

    Parameters
    ----------
    processes : int, optional
        Number of processes; by default one per core.

    Yields
    ------
    Engine
        Engine for `run_study`. Several studies may use it.

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
        raise validation_error("--processes", count, "", bound, "leave it out to use all cores")
    engine = Engine(open=lambda: open_workers(count), close=close_workers, workers=count, lost=(BrokenExecutor,))
    try:
        yield engine
    finally:
        engine.end()


@contextmanager
def cluster_engine(address: str) -> Iterator[Engine]:
    """Provide an engine with the workers of the Dask scheduler at `address`, for instance tcp://127.0.0.1:8786.

    The connection is closed when the `with` statement ends, but the cluster continues. Raises InputError if the package
    `distributed` is missing, if the scheduler does not answer or has no workers, or if a worker runs different code.
    """
    try:  # `distributed` is an optional dependency
        from distributed.client import ClosedClientError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        hint = "install it with: pip install 'twintip[cluster]'"
        raise validation_error(
            "--scheduler", address, "", "used with the package distributed, which is not installed", hint
        ) from error
    _suppress_cluster_logs()
    client = _connect(address)

    def close(executor: Executor) -> None:
        with suppress(OSError, RuntimeError):  # the scheduler may have ended already
            executor.shutdown(wait=False)

    try:
        _check_worker_code(client, address)
        yield Engine(
            open=lambda: client.get_executor(pure=False),  # with pure=True, a retried item would not be a new task
            close=close,
            workers=sum(client.nthreads().values()),
            lost=(KilledWorker, CancelledError, ClosedClientError),
            check=partial(_check_cluster, client, address),
        )
    finally:
        with suppress(OSError):  # the scheduler may have ended already
            client.close()


def _suppress_cluster_logs() -> None:
    """Suppress the log messages of `distributed`, because a lost cluster is reported as a one-line error."""
    # The package sets the level of each of these loggers separately, so setting the level of the root logger would have
    # no effect.
    for name in ("distributed", "distributed.client", "tornado", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _check_cluster(client: "Client", address: str) -> None:
    """Raise InputError if the scheduler at `address` no longer answers, or if no lost worker is restarted in time."""
    try:
        if client.scheduler is None:  # the client has given up reconnecting
            raise ConnectionError
        client.wait_for_workers(1, timeout=_WITHOUT_WORKERS_SECONDS)
    except (OSError, RuntimeError) as error:
        bound = "the address of a scheduler that still answers and has workers"
        hint = "start the scheduler again and repeat the command; all finished points are stored"
        raise validation_error("--scheduler", address, "", bound, hint) from error


def _connect(address: str) -> "Client":
    """Return a client connected to the scheduler at `address`; raises InputError if no scheduler answers there."""
    from distributed import Client  # imported here, because the package is an optional dependency
    from distributed.comm import connect

    async def connect_once() -> None:
        connection = await connect(address, timeout=_CONNECT_SECONDS)
        await connection.close()

    try:
        # A bare connection is tested first, because closing a client without a scheduler blocks for half a minute.
        asyncio.run(connect_once())
        return Client(address, timeout=_ANSWER_SECONDS, set_as_default=False)
    except (OSError, ValueError, RuntimeError, MemoryError) as error:  # MemoryError if another program answers
        hint = "start a scheduler with dask scheduler, and check the address"
        raise validation_error("--scheduler", address, "", "the address of a scheduler that answers", hint) from error


def _check_worker_code(client: "Client", address: str) -> None:
    """Raise InputError if the cluster has no workers, or if a worker runs different code from this machine.

    Different code could give different numbers, which must not be mixed in one study.
    """
    try:
        digests: dict[str, str] = client.run(code_digest)  # keyed by the address of the worker
    except ImportError as error:
        msg = "--scheduler: twintip is not installed on a worker; install the version of this machine there"
        raise InputError(msg) from error
    if not digests:
        raise validation_error(
            "--scheduler", address, "", "a scheduler with workers", "start workers with: dask worker ADDRESS"
        )
    for worker, digest in digests.items():
        if digest != code_digest():
            msg = f"--scheduler: worker {worker} runs different code from this machine; install the same version there"
            raise InputError(msg)
