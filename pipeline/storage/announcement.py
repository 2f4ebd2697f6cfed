"""What a command is working on: said by whoever works, heard by whoever shows it; nobody need listen."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Listener = Callable[[str], None]
CLEARED = "\r\x1b[K"  # back to the start of the line, and the line wiped
_listeners: list[Listener] = []


def announce(work: str) -> None:
    """Tell the listeners, if there are any, what is worked on from here on."""
    for listener in _listeners:
        listener(work)


def fresh_line() -> str:
    """Return what a line that stays must begin with where somebody listens, and so may have written half a line."""
    return CLEARED if _listeners else ""


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Hand what is announced inside the block to a listener, which must not raise."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)
