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

MOST_PROCESSES = 1024
_ATTEMPTS = 2  # retries, one at a time, of an item whose worker was lost, because it may be the cause
_IN_FLIGHT = 4  # items per worker: enough that none waits, few enough that a million need no memory
_CHECK_SECONDS = 5.0  # time without an answer, after which the engine is checked
_CONNECT_SECONDS = 4  # time for a scheduler to accept a connection
_ANSWER_SECONDS = 15  # time for a scheduler to answer
_WITHOUT_WORKERS_SECONDS = 120  # time in which a lost worker may be restarted


@dataclass(kw_only=True)
class Engine:
    """Workers that persist between studies: functions to open and close their executor, and errors of a lost worker.

    `check` raises InputError if no answer can arrive any more, because all workers are permanently lost.
    """

    open: Callable[[], Executor]
    close: Callable[[Executor], None]
    workers: int
    lost: tuple[type[Exception], ...]
    check: Callable[[], None] = lambda: None
    _executor: Executor | None = field(default=None, init=False)

    def submit(self, work: Callable[[Item], Result], item: Item) -> Future[Result]:
        """Return the future of work on an item; an executor that has lost a worker is opened again."""
        try:
            return self._opened().submit(work, item)
        except self.lost:  # an executor that has lost a worker accepts no more work
            self.check()
            self.end()
            return self._opened().submit(work, item)

    def _opened(self) -> Executor:
        if self._executor is None:
            self._executor = self.open()
        return self._executor

    def end(self) -> None:
        """Close the executor immediately; the next item opens another one."""
        executor, self._executor = self._executor, None
        if executor is not None:
            self.close(executor)


def completed_items(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item], if_lost: Callable[[Item], Result]
) -> Generator[tuple[Item, Result]]:
    """Yield each item with its result, in the order of completion.

    An item whose worker was lost is retried at the end, one at a time. If it fails again, `if_lost` gives its result.
    Raises InputError if the engine has no workers any more.
    """
    in_doubt: list[Item] = []
    yield from _completed(engine, work, items, engine.workers * _IN_FLIGHT, in_doubt)
    for _ in range(_ATTEMPTS):
        if in_doubt:
            engine.check()
            alone = in_doubt
            in_doubt = []
            yield from _completed(engine, work, alone, 1, in_doubt)
    for item in in_doubt:
        yield item, if_lost(item)


def _completed(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item], in_flight: int, lost: list[Item]
) -> Generator[tuple[Item, Result]]:
    """Yield each item with its result, and append to `lost` the items of lost workers; limit the items in flight."""
    waiting = iter(items)
    running: dict[Future[Result], Item] = {}
    # finished futures add themselves, because polling all of them costs more than a task
    ended: SimpleQueue[Future[Result]] = SimpleQueue()
    try:
        while True:
            for item in islice(waiting, in_flight - len(running)):
                future = engine.submit(work, item)
                running[future] = item
                future.add_done_callback(ended.put)
            if not running:
                return
            try:
                future = ended.get(timeout=_CHECK_SECONDS)
            except Empty:
                engine.check()
                continue
            item = running.pop(future)
            try:
                result = future.result()
            except engine.lost:
                lost.append(item)
            else:
                yield item, result
    finally:
        if running:  # nobody waits for these any more
            engine.end()


def chosen_engine(processes: int | None, scheduler: str | None) -> AbstractContextManager[Engine]:
    """Return the cluster of a scheduler if one is named, else processes on this machine; raises InputError for both."""
    if processes is not None and scheduler is not None:
        hint = "leave it out: the cluster has its own workers"
        raise validation_error("--processes", processes, "", "left out if --scheduler is given", hint)
    return process_engine(processes) if scheduler is None else cluster_engine(scheduler)


@contextmanager
def process_engine(processes: int | None = None) -> Iterator[Engine]:
    """Start the processes that solve the points of a study, for a `with` statement.

    Each process has one thread. All of them end with the statement.

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
    if not 1 <= count <= MOST_PROCESSES:
        bound = f"at least 1 and at most {MOST_PROCESSES}"
        raise validation_error("--processes", count, "", bound, "leave it out for all cores")
    engine = Engine(open=lambda: open_workers(count), close=close_workers, workers=count, lost=(BrokenExecutor,))
    try:
        yield engine
    finally:
        engine.end()


@contextmanager
def cluster_engine(address: str) -> Iterator[Engine]:
    """Yield an engine of the workers of a Dask scheduler at an address, for instance tcp://127.0.0.1:8786.

    Raises InputError if the package is missing, the scheduler does not answer or has no workers, or their code differs.
    """
    try:
        from distributed.client import ClosedClientError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        hint = "install it with: pip install 'twintip[cluster]'"
        raise validation_error(
            "--scheduler", address, "", "used where the package distributed is installed", hint
        ) from error
    # we report a lost cluster in one line; distributed sets a level for each of these loggers
    for name in ("distributed", "distributed.client", "tornado", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    client = _connected(address)

    def check() -> None:
        try:
            if client.scheduler is None:  # the client has given up
                raise ConnectionError
            client.wait_for_workers(1, timeout=_WITHOUT_WORKERS_SECONDS)
        except (OSError, RuntimeError) as error:
            bound = "the address of a scheduler that still answers and has workers"
            hint = "all points that ended are kept; start the scheduler again and repeat the command"
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


def _connected(address: str) -> "Client":
    """Return a client of a scheduler; raises InputError if none answers."""
    from distributed import Client
    from distributed.comm import connect

    async def greet() -> None:
        connection = await connect(address, timeout=_CONNECT_SECONDS)
        await connection.close()

    try:
        asyncio.run(greet())  # a client without a scheduler would block for half a minute at its end
        return Client(address, timeout=_ANSWER_SECONDS, set_as_default=False)
    except (OSError, ValueError, RuntimeError, MemoryError) as error:  # MemoryError: something else answered
        hint = "start it with dask scheduler, and check the address"
        raise validation_error("--scheduler", address, "", "the address of a scheduler that answers", hint) from error


def _refuse_other_code(client: "Client", address: str) -> None:
    """Raise InputError if a cluster has no workers, or a worker with other code."""
    try:
        digests: dict[str, str] = client.run(code_digest)
    except ImportError as error:
        msg = "--scheduler: a worker has no twintip; install the version of this machine there"
        raise InputError(msg) from error
    if not digests:
        raise validation_error("--scheduler", address, "", "one with workers", "start some with: dask worker ADDRESS")
    for worker, digest in digests.items():
        if digest != code_digest():
            msg = f"--scheduler: worker {worker} has other code than this machine; install the same version there"
            raise InputError(msg)
