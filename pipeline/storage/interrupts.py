"""Ctrl-C and SIGTERM: a command ends at once by KeyboardInterrupt, except in blocks that must be completed.

A signal can arrive at any line of Python. `uninterrupted` delays its exception where that would leave files or
processes behind.
"""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
_REPEAT_S = 1.0  # period after which the exception is raised again, because some libraries catch it [s]


class InterruptedCommand(KeyboardInterrupt):
    """The end of this process due to a signal.

    A plain KeyboardInterrupt will not do: Python remembers one that leaves `exec`, and then ends itself as if by Ctrl-C
    instead of with our exit code.
    """


class _Ending:
    """The state of the signals in this process."""

    signal_number: int | None = None  # number of the first signal
    depth = 0  # number of nested blocks that delay signals
    is_pending = False  # whether an exception is due at the end of these blocks


def end_by_signals() -> None:
    """Let Ctrl-C and SIGTERM end this process by KeyboardInterrupt, without output from Python itself."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # a shell lets its background jobs ignore Ctrl-C
            signal.signal(number, _handle_signal)
    signal.signal(signal.SIGALRM, _raise_again)
    for hook in ("excepthook", "unraisablehook"):  # Python would print an exception that no code of ours can catch
        setattr(sys, hook, _silence_after_signal(getattr(sys, hook)))


def ending_signal() -> int | None:
    """Return the number of the signal that ends this process, or None if no signal has arrived."""
    return _Ending.signal_number


def ignore_signals() -> None:
    """Ignore further signals, so that the process ends by itself with its own exit code."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number in (*SIGNALS, signal.SIGALRM):
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay the exception of a signal that arrives inside the block until the block ends."""
    before = _Ending.depth
    try:
        _Ending.depth = before + 1
        yield
    finally:
        _Ending.depth = before
        _raise_if_pending()


@contextmanager
def interruptible() -> Iterator[None]:
    """Let signals end this block, although it is inside `uninterrupted`, whose blocks can then clean up."""
    before = _Ending.depth
    try:
        _Ending.depth = 0
        _raise_if_pending()
        yield
    finally:
        _Ending.depth = before


@contextmanager
def signals_for_this_thread() -> Iterator[None]:
    """Block signals while threads and processes are started inside the block, because these inherit the blocked state.

    A terminal sends Ctrl-C to worker processes too, which would print tracebacks. A thread would receive a signal for
    which gmsh has a handler of its own, while `mesh.session` blocks signals only in the main thread.
    """
    with uninterrupted():
        try:
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)


def _raise_if_pending() -> None:
    """Raise the exception of a signal if it is due and no block delays it."""
    if _Ending.is_pending and _Ending.depth == 0:
        _Ending.is_pending = False
        raise InterruptedCommand


def _handle_signal(number: int, _: FrameType | None) -> None:
    _Ending.signal_number = _Ending.signal_number or number
    signal.setitimer(signal.ITIMER_REAL, _REPEAT_S, _REPEAT_S)
    _Ending.is_pending = True
    _raise_if_pending()


def _raise_again(*_: object) -> None:
    """Raise the exception of a signal again, unless it is delayed or its `finally` blocks are running already."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return
        error = error.__context__
    _Ending.is_pending = True
    _raise_if_pending()


def _silence_after_signal(hook: Callable[..., object]) -> Callable[..., None]:
    """Return a hook of `sys` that prints errors only until a signal arrives."""

    def quiet_hook(*details: object) -> None:
        if _Ending.signal_number is None:
            hook(*details)

    return quiet_hook
