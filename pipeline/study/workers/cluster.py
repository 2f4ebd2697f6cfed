"""A Dask cluster that somebody started: the very same tasks as in a pool of processes."""

import logging
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from cad.quantity import InputError, validation_error
from pipeline.storage.cache import code_digest
from pipeline.study.workers.engine import Engine

if TYPE_CHECKING:
    from distributed import Client

_ANSWER_S = 15  # for the scheduler to answer
_QUESTIONS = 3  # before a scheduler that is busy counts as gone
_CODE_S = 120  # for all workers to say which code they have
_WITHOUT_WORKERS_S = 120.0  # a worker that was lost may be started again in that time
# Loggers of Dask and of what it runs on: that a cluster is lost is said here, in one line.
_TALKERS = ("distributed", "distributed.client", "tornado", "tornado.application", "asyncio")
_RESUME = "all points that ended are kept; start it again, then the same command goes on"


@contextmanager
def cluster_engine(address: str) -> Iterator[Engine]:
    """Give the workers of the Dask scheduler at an address, for instance tcp://127.0.0.1:8786.

    Raises InputError, in one line, where the package is missing, the scheduler does not answer, it has no workers, or
    their code is not this one.
    """
    try:
        from distributed import Client
        from distributed.client import ClosedClientError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        remedy = "install it with: pip install 'twintip[cluster]'"
        raise validation_error("--scheduler", address, "", "used with the package distributed", remedy) from error
    for name in _TALKERS:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=_ANSWER_S, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        remedy = "start it with dask scheduler, and check the address"
        raise validation_error("--scheduler", address, "", "the address of a scheduler that answers", remedy) from error
    try:
        _refuse_other_code(client, address)
        yield Engine(
            open=lambda: client.get_executor(pure=False),  # the same task, given again, is a new one
            workers=sum(client.nthreads().values()),
            lost=(KilledWorker, CancelledError, ClosedClientError),
            close=_shut,
            check=_Watch(client, address).check,
        )
    finally:
        with suppress(OSError):  # a scheduler that is gone needs no farewell
            client.close()


def _refuse_other_code(client: "Client", address: str) -> None:
    async def digests_of_workers() -> dict[str, str]:
        found: dict[str, str] = await client.run(code_digest)
        return found

    try:
        digests = client.sync(digests_of_workers, callback_timeout=_CODE_S)
    except ImportError as error:
        msg = "--scheduler: a worker has no twintip; install the version of this machine there"
        raise InputError(msg) from error
    except TimeoutError as error:
        bound = f"one whose workers answer within {_CODE_S} s"
        raise validation_error(
            "--scheduler", address, "", bound, "end the workers that hang, then start new ones"
        ) from error
    if not digests:
        raise validation_error("--scheduler", address, "", "one with workers", "start some with: dask worker ADDRESS")
    others = [place for place, digest in digests.items() if digest != code_digest()]
    if others:
        msg = f"--scheduler: worker {others[0]} has other code than this machine; install the same version there"
        raise InputError(msg)


def _shut(executor: Executor) -> None:
    """Let go of what is still out; Dask's executor cancels it when nobody waits, if its scheduler is still there."""
    with suppress(OSError, RuntimeError):
        executor.shutdown(wait=False)


class _Watch:
    """Whether a cluster can still answer: Dask itself waits for ever for a scheduler that closed, and for workers."""

    def __init__(self, client: "Client", address: str) -> None:
        self._client = client
        self._address = address
        self._without_since: float | None = None

    def check(self) -> None:
        """Raise InputError where the scheduler is gone, or has been without workers for two minutes."""
        if self._workers():
            self._without_since = None
            return
        now = time.monotonic()
        if self._without_since is None:
            self._without_since = now
        if now - self._without_since > _WITHOUT_WORKERS_S:
            bound = f"one with workers, and it has had none for {_WITHOUT_WORKERS_S:.0f} s"
            raise validation_error("--scheduler", self._address, "", bound, _RESUME)

    def _workers(self) -> int:
        """Return how many workers there are; a scheduler that is slow to answer is asked again."""
        for _ in range(_QUESTIONS):
            with suppress(TimeoutError):
                return self._answer()
        raise self._gone()

    def _answer(self) -> int:
        scheduler = self._client.scheduler
        if scheduler is None:  # the client has given up already
            raise self._gone()
        try:
            return len(self._client.sync(scheduler.ncores, callback_timeout=_ANSWER_S))
        except TimeoutError:
            raise
        except (OSError, RuntimeError) as error:
            raise self._gone() from error

    def _gone(self) -> InputError:
        bound = "the address of a scheduler that answers, and it is gone"
        return validation_error("--scheduler", self._address, "", bound, _RESUME)
