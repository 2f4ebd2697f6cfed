"""Ctrl-C and SIGTERM: a command ends at once by KeyboardInterrupt, and what must not be cut in two is done first.

A signal can arrive at any line of Python. Where its exception would leave something behind, `uninterrupted` holds it.
"""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
_REPEAT_S = 1.0  # after which the exception is raised again: some libraries take it for their own


class InterruptedCommand(KeyboardInterrupt):
    """The end of this process by a signal.

    It is a class of its own for one reason. A plain KeyboardInterrupt that leaves `exec` is remembered by Python, which
    then ends itself by Ctrl-C instead of with our exit code.
    """


class _Ending:
    """What the signals of this process have asked for so far."""

    by: int | None = None  # number of the first signal
    depth = 0  # of the blocks that hold signals
    waiting = False  # says that an exception is due where these blocks end


def end_by_signals() -> None:
    """Let Ctrl-C and SIGTERM end this process by KeyboardInterrupt, without a word from Python itself."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # a shell's background job leaves Ctrl-C to the shell
            signal.signal(number, _end)
    signal.signal(signal.SIGALRM, _end_again)
    for hook in ("excepthook", "unraisablehook"):  # where no code of ours can catch it, Python would print it
        setattr(sys, hook, _without_interrupts(getattr(sys, hook)))


def ended_by() -> int | None:
    """Return the number of the signal that ends this process, None where none has arrived."""
    return _Ending.by


def ignore_signals() -> None:
    """Hear no signal any more: the process comes to its own end, with its own exit code."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number in (*SIGNALS, signal.SIGALRM):
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold the signals that arrive inside the block until it ends."""
    before = _Ending.depth
    try:
        _Ending.depth = before + 1
        yield
    finally:
        _Ending.depth = before
        _end_if_asked()


@contextmanager
def interruptible() -> Iterator[None]:
    """Let signals end this block, which every block of `uninterrupted` around it can clear up after."""
    before = _Ending.depth
    try:
        _Ending.depth = 0
        _end_if_asked()
        yield
    finally:
        _Ending.depth = before


@contextmanager
def signals_for_this_thread() -> Iterator[None]:
    """Let threads and processes that are started inside the block inherit that they get no signal.

    A terminal sends Ctrl-C to workers too, which would print tracebacks. A thread would hand a signal to gmsh. That
    puts its own handlers in the place of ours while `mesh.session` blocks signals in the main thread.
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
    """Raise the exception of a signal again where it is neither held nor on its way through the `finally` blocks."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return
        error = error.__context__
    _Ending.waiting = True
    _end_if_asked()


def _without_interrupts(hook: Callable[..., object]) -> Callable[..., None]:
    """Return one of the hooks of `sys` that prints no error once a signal has arrived."""

    def quiet_hook(*details: object) -> None:
        if _Ending.by is None:
            hook(*details)

    return quiet_hook
