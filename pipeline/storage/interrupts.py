"""Ctrl-C and SIGTERM: a command ends at once by KeyboardInterrupt, except in blocks that must be completed.

A signal can arrive at any line of Python. `uninterrupted` holds it where its exception would leave something behind.
"""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
_REPEAT_S = 1.0  # period after which the exception is raised again; some libraries take it for their own


class InterruptedCommand(KeyboardInterrupt):
    """The end of this process by a signal.

    It is a class of its own for one reason: Python remembers a plain KeyboardInterrupt that leaves `exec`, and then
    ends itself by Ctrl-C instead of with our exit code.
    """


class _Ending:
    """The state of the signals in this process."""

    by: int | None = None  # number of the first signal
    depth = 0  # number of nested blocks that hold signals
    waiting = False  # whether an exception is due at the end of these blocks


def end_by_signals() -> None:
    """Let Ctrl-C and SIGTERM end this process by KeyboardInterrupt, without output from Python itself."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # a background job of a shell leaves Ctrl-C to the shell
            signal.signal(number, _end)
    signal.signal(signal.SIGALRM, _end_again)
    for hook in ("excepthook", "unraisablehook"):  # Python would print an exception that no code of ours can catch
        setattr(sys, hook, _without_interrupts(getattr(sys, hook)))


def ended_by() -> int | None:
    """Return the number of the signal that ends this process, or None."""
    return _Ending.by


def ignore_signals() -> None:
    """Ignore further signals, so that the process ends by itself with its own exit code."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number in (*SIGNALS, signal.SIGALRM):
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold signals that arrive inside the block until it ends."""
    before = _Ending.depth
    try:
        _Ending.depth = before + 1
        yield
    finally:
        _Ending.depth = before
        _end_if_asked()


@contextmanager
def interruptible() -> Iterator[None]:
    """Let signals end this block; the blocks of `uninterrupted` around it can clean up afterwards."""
    before = _Ending.depth
    try:
        _Ending.depth = 0
        _end_if_asked()
        yield
    finally:
        _Ending.depth = before


@contextmanager
def signals_for_this_thread() -> Iterator[None]:
    """Let threads and processes that are started inside the block inherit blocked signals.

    A terminal sends Ctrl-C to workers too, which would print tracebacks. A thread would pass a signal to gmsh, which
    installs its own handlers while `mesh.session` blocks signals in the main thread.
    """
    with uninterrupted():
        try:
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)


def _end_if_asked() -> None:
    if _Ending.waiting and _Ending.depth == 0:
        _Ending.waiting = False
        raise InterruptedCommand


def _end(number: int, _: FrameType | None) -> None:
    _Ending.by = _Ending.by or number
    signal.setitimer(signal.ITIMER_REAL, _REPEAT_S, _REPEAT_S)
    _Ending.waiting = True
    _end_if_asked()


def _end_again(*_: object) -> None:
    """Raise the exception of a signal again unless it is held or already on its way through `finally` blocks."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return
        error = error.__context__
    _Ending.waiting = True
    _end_if_asked()


def _without_interrupts(hook: Callable[..., object]) -> Callable[..., None]:
    """Return a hook of `sys` that prints no error once a signal has arrived."""

    def quiet_hook(*details: object) -> None:
        if _Ending.by is None:
            hook(*details)

    return quiet_hook
