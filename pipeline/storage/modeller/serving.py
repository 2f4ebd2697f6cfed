"""The process that models: it reads tasks, answers each in their order, and ends with whoever started it."""

import ctypes
import gc
import os
import pickle
import select
import signal
import socket
from contextlib import suppress

from pipeline.failures import FAILURES, sendable, with_trace
from pipeline.storage.modeller.answer import timed

_PR_SET_PDEATHSIG = 1  # prctl(2)


def serve(descriptor: int, parent: int) -> None:
    """Answer tasks from a socket until its other end closes.

    The end of the parent, the number of a process or 0 for none, ends this process too, even in the midst of a task.
    """
    if parent:
        _end_with(parent)
    from pipeline.storage.modeller.tasks import TASKS, get_ready

    link = socket.socket(fileno=descriptor)
    if not select.select([link], [], [], 0.0)[0]:  # nobody waits yet
        get_ready()
    gc.freeze()  # the kernel stays: the garbage collector need not look through it again
    stream = link.makefile("rwb")
    with suppress(EOFError, OSError):
        while True:
            task, given = pickle.load(stream)
            answer: tuple[bool, object]
            try:
                answer = True, timed(TASKS[task], given)
            except FAILURES as error:
                answer = False, sendable(with_trace(error))
            pickle.dump(answer, stream)
            stream.flush()


def _end_with(parent: int) -> None:
    """Let the system kill this process when its parent ends, however that ends; Linux knows the call."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
