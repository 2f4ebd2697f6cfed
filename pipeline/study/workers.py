"""Where the points of a study are solved: processes of this machine, or a Dask cluster that somebody started."""

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
_ATTEMPTS = 2  # alone, for an item that was out when a worker was lost: it may be what ended the worker
_IN_FLIGHT = 4  # items a worker: enough that none waits, few enough that a million need no memory
_CHECK_SECONDS = 5.0  # without an answer, after which the engine is asked whether one can still come
_CONNECT_SECONDS = 4  # for a scheduler to take a connection
_ANSWER_SECONDS = 15  # for a scheduler to answer
_WITHOUT_WORKERS_SECONDS = 120  # a worker that was lost may be started again in that time


@dataclass(kw_only=True)
class Engine:
    """Workers that stay between studies: how to open and close their executor, and which errors mean that one was lost.

    `check` raises InputError where no answer can come any more, as all workers are gone for good.
    """

    open: Callable[[], Executor]
    close: Callable[[Executor], None]
    workers: int
    lost: tuple[type[Exception], ...]
    check: Callable[[], None] = lambda: None
    _executor: Executor | None = field(default=None, init=False)

    def submit(self, work: Callable[[Item], Result], item: Item) -> Future[Result]:
        """Return the future of a piece of work on an item; an executor that has lost a worker is opened again."""
        try:
            return self._opened().submit(work, item)
        except self.lost:  # an executor that has lost a worker takes no more
            self.check()
            self.end()
            return self._opened().submit(work, item)

    def _opened(self) -> Executor:
        if self._executor is None:
            self._executor = self.open()
        return self._executor

    def end(self) -> None:
        """Close the executor, whatever its workers are at; the next item opens another one."""
        executor, self._executor = self._executor, None
        if executor is not None:
            self.close(executor)


def completed_items(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item], if_lost: Callable[[Item], Result]
) -> Generator[tuple[Item, Result]]:
    """Yield each item with what a piece of work makes of it, in the order in which they end.

    An item that was out when a worker was lost is tried again in the end, alone. Where that worker is lost too,
    `if_lost` says what becomes of it. Raises InputError where the engine has no workers any more.
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
    """Yield each item with its result, and add to `lost` those whose worker was lost; only so many are out at once."""
    waiting = iter(items)
    running: dict[Future[Result], Item] = {}
    ended: SimpleQueue[Future[Result]] = SimpleQueue()  # each adds itself: to ask all that run costs more than a task
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
    """Return the cluster of a scheduler where one is named, else processes on this machine; refuses both at once."""
    if processes is not None and scheduler is not None:
        raise validation_error(
            "--processes", processes, "", "left out beside --scheduler", "leave it out: the cluster has its own workers"
        )
    return process_engine(processes) if scheduler is None else cluster_engine(scheduler)


@contextmanager
def process_engine(processes: int | None = None) -> Iterator[Engine]:
    """Give processes of this machine, one for each core if no number is given; each computes on one thread.

    Raises InputError for a number that is none.

    Parameters
    ----------
    processes : int, optional
        How many; as many as there are cores by default.

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
    """Give the workers of the Dask scheduler at an address, for instance tcp://127.0.0.1:8786.

    Raises InputError where the package is missing, the scheduler does not answer, it has no workers, or their code is
    not this one.
    """
    try:
        from distributed.client import ClosedClientError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        hint = "install it with: pip install 'twintip[cluster]'"
        raise validation_error(
            "--scheduler", address, "", "used where the package distributed is installed", hint
        ) from error
    # that a cluster is lost is said by us, in one line; distributed gives each of these a level of its own
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
            hint = "all points that ended are kept; start it again, then the same command goes on"
            raise validation_error("--scheduler", address, "", bound, hint) from error

    def close(executor: Executor) -> None:
        with suppress(OSError, RuntimeError):  # a scheduler that is gone needs no farewell
            executor.shutdown(wait=False)

    try:
        _refuse_other_code(client, address)
        yield Engine(
            open=lambda: client.get_executor(pure=False),  # the same item, given again, is a new task
            close=close,
            workers=sum(client.nthreads().values()),
            lost=(KilledWorker, CancelledError, ClosedClientError),
            check=check,
        )
    finally:
        with suppress(OSError):
            client.close()


def _connected(address: str) -> "Client":
    """Return a client of a scheduler; raises InputError where none answers."""
    from distributed import Client
    from distributed.comm import connect

    async def greet() -> None:
        connection = await connect(address, timeout=_CONNECT_SECONDS)
        await connection.close()

    try:
        asyncio.run(greet())  # a client that finds nobody would wait for half a minute until it ends
        return Client(address, timeout=_ANSWER_SECONDS, set_as_default=False)
    except (OSError, ValueError, RuntimeError, MemoryError) as error:  # MemoryError: something else answered
        hint = "start it with dask scheduler, and check the address"
        raise validation_error("--scheduler", address, "", "the address of a scheduler that answers", hint) from error


def _refuse_other_code(client: "Client", address: str) -> None:
    """Raise InputError where a cluster has no workers, or one whose code is not this one."""
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
