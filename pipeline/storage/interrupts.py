"""Handling of Ctrl-C and SIGTERM: they end a command immediately by KeyboardInterrupt.

A signal can arrive at any line of Python code. `uninterrupted` delays its exception in blocks that would otherwise
leave files or processes behind.
"""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
_REPEAT_S = 1.0  # period after which the exception is raised again, because some libraries catch it [s]


class InterruptedCommand(KeyboardInterrupt):
    """The exception that ends this process after a signal.

    A plain KeyboardInterrupt is not enough. If one leaves `exec`, Python later ends the process as if by Ctrl-C,
    without the exit code of this program. Python does not do so for a subclass.
    """


class _SignalState:
    """The state of the signals in this process."""

    signal_number: int | None = None  # number of the first signal that arrived
    depth = 0  # number of nested blocks that delay the exception
    is_pending = False  # whether the exception must be raised at the end of these blocks


def end_by_signals() -> None:
    """Let Ctrl-C and SIGTERM end this process by InterruptedCommand, without a traceback from Python.

    This replaces the handlers of both signals and of SIGALRM, and two hooks of `sys` that print exceptions.
    """
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # background jobs of a shell ignore Ctrl-C
            signal.signal(number, _handle_signal)
    signal.signal(signal.SIGALRM, _raise_again)
    for hook in ("excepthook", "unraisablehook"):  # these would print exceptions that this program cannot catch
        setattr(sys, hook, _silence_after_signal(getattr(sys, hook)))


def ending_signal() -> int | None:
    """Return the number of the signal that is ending this process, or None if no signal has arrived."""
    return _SignalState.signal_number


def ignore_signals() -> None:
    """Ignore further signals, so that the process can finish and return its own exit code."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number in (*SIGNALS, signal.SIGALRM):
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay the exception of a signal that arrives during the block until the end of the block."""
    outer_depth = _SignalState.depth
    try:
        _SignalState.depth = outer_depth + 1
        yield
    finally:
        _SignalState.depth = outer_depth
        _raise_if_pending()


@contextmanager
def interruptible() -> Iterator[None]:
    """Let signals end this block immediately, although it is inside a block of `uninterrupted`.

    Long work belongs in such a block. The enclosing blocks of `uninterrupted` then clean up without interruption.
    """
    outer_depth = _SignalState.depth
    try:
        _SignalState.depth = 0
        _raise_if_pending()  # a signal that was delayed until now ends the block at once
        yield
    finally:
        _SignalState.depth = outer_depth


@contextmanager
def signals_for_this_thread() -> Iterator[None]:
    """Mask signals while threads or processes are started, so that only this thread receives signals.

    The new threads and processes inherit the mask. Without the mask, worker processes would print tracebacks, because a
    terminal sends Ctrl-C to them too. A new thread would also receive signals while gmsh has its own handler for them,
    because `mesh.session` masks them only in the main thread.
    """
    with uninterrupted():
        previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _raise_if_pending() -> None:
    """Raise the exception of a signal if it is pending and no block delays it."""
    if _SignalState.is_pending and _SignalState.depth == 0:
        _SignalState.is_pending = False
        raise InterruptedCommand


def _handle_signal(number: int, _: FrameType | None) -> None:
    """Record the first signal, start the timer that repeats its exception, and raise the exception."""
    _SignalState.signal_number = _SignalState.signal_number or number
    signal.setitimer(signal.ITIMER_REAL, _REPEAT_S, _REPEAT_S)
    _SignalState.is_pending = True
    _raise_if_pending()


def _raise_again(*_: object) -> None:
    """Raise the exception of a signal again, unless it is delayed or already being handled."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return
        error = error.__context__
    _SignalState.is_pending = True
    _raise_if_pending()


def _silence_after_signal(hook: Callable[..., object]) -> Callable[..., None]:
    """Return a hook of `sys` that prints errors only before a signal arrives."""

    def quiet_hook(*details: object) -> None:
        if _SignalState.signal_number is None:
            hook(*details)

    return quiet_hook
