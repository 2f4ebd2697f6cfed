"""Signals while outputs are written: the first one ends the run, and none tears a folder apart that is being moved."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_listening: list["_Signals"] = []


class Interrupted(KeyboardInterrupt):
    """A run that a signal ended; `exit_code` is what the shell expects."""

    def __init__(self, number: int) -> None:
        """Keep the code of the signal."""
        super().__init__(signal.Signals(number).name)
        self.exit_code = 128 + number


class _Signals:
    """The first signal raises; further ones, and those while outputs are moved or removed, wait for the end."""

    def __init__(self) -> None:
        self.held = False
        self.waiting = 0

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        if self.held:
            self.waiting = number
        else:
            self.held = True
            raise Interrupted(number)


def hold() -> None:
    """Let signals wait from here to the end of `interruptible`, where there is one."""
    for signals in _listening:
        signals.held = True


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise Interrupted at the first signal inside the block; for the command line, whose process it owns.

    A signal that is ignored already stays so: nohup and shells in the background count on it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    signals = _Signals()
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    taken = {number: handler for number, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    _listening.append(signals)
    try:
        for number in taken:
            signal.signal(number, signals)
        yield
    finally:
        for number, handler in taken.items():
            signal.signal(number, handler)
        _listening.remove(signals)
    if signals.waiting:
        raise Interrupted(signals.waiting)
