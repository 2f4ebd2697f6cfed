"""A Dask cluster that somebody started: the very same tasks as in a pool of processes."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from cad.quantity import InputError, fault
from pipeline.storage.cache import code_digest
from pipeline.study.workers.engine import Engine

_SECONDS = 15  # to reach the scheduler


def _shut(executor: Executor) -> None:
    """Let go of what is still out; Dask's executor cancels it when nobody waits."""
    executor.shutdown(wait=False)


@contextmanager
def cluster_engine(address: str) -> Iterator[Engine]:
    """Give the workers of the Dask scheduler at an address, for instance tcp://127.0.0.1:8786.

    Raises InputError, in one line, where the package is missing, the scheduler does not answer, it has no workers, or
    their code is not this one.
    """
    try:
        from distributed import Client
        from distributed.client import FutureCancelledError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        remedy = "install it with: pip install 'twintip[cluster]'"
        raise fault("--scheduler", address, "", "used with the package distributed", remedy) from error
    try:
        client = Client(address, timeout=_SECONDS, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        remedy = "start it with dask scheduler, and check the address"
        raise fault("--scheduler", address, "", "the address of a scheduler that answers", remedy) from error
    try:
        digests = client.run(code_digest)
        if not digests:
            raise fault("--scheduler", address, "", "one with workers", "start some with: dask worker ADDRESS")
        others = [place for place, digest in digests.items() if digest != code_digest()]
        if others:
            msg = f"--scheduler: worker {others[0]} has other code than this machine; install the same version there"
            raise InputError(msg)
        threads = sum(client.nthreads().values())
        yield Engine(open=client.get_executor, workers=threads, lost=(KilledWorker, FutureCancelledError), close=_shut)
    finally:
        client.close()
