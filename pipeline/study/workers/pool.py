"""Processes of this machine that solve tasks, each at a pipe of its own: one that is killed harms no other."""

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from cad.quantity import validation_error
from pipeline.failures import FAILURES, sendable

Found = TypeVar("Found")

_CONTEXT = multiprocessing.get_context("spawn")  # a fork would copy the threads of libraries half-way


class WorkerLostError(RuntimeError):
    """A process ended before it answered."""


class ProcessPool(Executor):
    """An executor whose processes may be killed at any moment.

    The processes of `concurrent.futures.ProcessPoolExecutor` share one pipe for their answers: where one is killed
    half-way through an answer, the reader waits for the rest for ever. Here the end of a process ends its own pipe.
    """

    def __init__(self, processes: int) -> None:
        """Make room for some processes; each is started when there is something to do for it."""
        self._processes = processes
        self._threads = ThreadPoolExecutor(processes)
        self._idle: SimpleQueue[_Worker] = SimpleQueue()
        self._alive: set[_Worker] = set()
        self._shut = threading.Event()

    def submit(self, fn: Callable[..., Found], /, *args: object, **kwargs: object) -> Future[Found]:
        """Return the future of a call in one of the processes; it raises WorkerLostError where the process ends."""
        return self._threads.submit(self._answer, (fn, args, kwargs))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all processes, whatever they are at."""
        self._shut.set()
        self._threads.shutdown(wait=False, cancel_futures=cancel_futures)
        for worker in tuple(self._alive):
            worker.kill()
        self._threads.shutdown(wait=wait)

    def _answer(self, call: tuple[object, ...]) -> Any:  # noqa: ANN401 - what the call gives, which crossed a pipe
        """Return what a call gives; a thread waits here for each process that works."""
        worker, answered = self._worker(), False
        try:
            succeeded, found = worker.ask(call)
            answered = True
        except (EOFError, OSError) as error:
            raise WorkerLostError from error
        finally:
            if answered:
                self._idle.put(worker)
            else:
                self._alive.discard(worker)
                worker.kill()
        if not succeeded:
            raise found
        return found

    def _worker(self) -> "_Worker":
        with suppress(Empty):
            return self._idle.get_nowait()
        try:
            worker = _Worker()
        except OSError as error:
            bound = f"few enough for this machine to start ({error.strerror})"
            raise validation_error("--processes", self._processes, "", bound, "give a smaller number") from error
        self._alive.add(worker)
        if self._shut.is_set():  # too late to be killed with the others
            worker.kill()
        return worker


class _Worker:
    """A process and the parent's end of its pipe."""

    def __init__(self) -> None:
        self._pipe, other = _CONTEXT.Pipe()
        self._process = _CONTEXT.Process(target=_serve, args=(other,), daemon=True)
        resource_tracker.ensure_running()  # first, as it lets Ctrl-C through again once it has started
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # from its first moment the process has it
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            other.close()  # the pipe ends with the process only where nobody else holds its other end

    def ask(self, call: tuple[object, ...]) -> tuple[bool, Any]:
        """Return whether a call succeeded in the process, and what it returned or raised.

        Raises EOFError or OSError where the process ends.
        """
        self._pipe.send(call)
        succeeded, found = self._pipe.recv()
        return succeeded, found

    def kill(self) -> None:
        """End the process, whatever it does and whichever signals it ignores."""
        self._process.kill()
        self._process.join()


def _serve(pipe: Connection) -> None:
    """Answer calls until the parent ends; Ctrl-C is left to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            function, positional, named = pipe.recv()
            try:
                answer = True, function(*positional, **named)
            except FAILURES as error:
                answer = False, sendable(error)
            try:
                pipe.send(answer)
            except (pickle.PickleError, TypeError, AttributeError) as error:  # raised before a byte is written
                pipe.send((False, RuntimeError(repr(error))))


def _end_with_parent() -> None:
    """End with the parent, however it ends, in the middle of a solve too."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
