"""Progress of a command on stderr: a bar on a terminal, else a line after 5 s and then at growing intervals."""

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from pipeline.storage.interrupts import signals_for_this_thread

if TYPE_CHECKING:
    from rich.console import RenderableType  # commands without a terminal do not need it

FIRST_LINE_S = 5.0
"""Seconds of work until the first line if stderr is no terminal."""
_LONGEST_PAUSE_S = 60.0  # longest time between two lines; the second line comes at twice the time of the first
_FRAMES_PER_S = 5
_BAR_WIDTH = 20  # [characters]
_MINUTE_S, _HOUR_S = 60.0, 3600.0
_FEW = 2  # number of minutes or hours below which the smaller unit is shown


class Work:
    """The work of a command: a call begins a piece of work, and `count` sets its finished parts."""

    def __init__(self, name: str) -> None:
        """Begin a piece of work with a name."""
        self._start = time.monotonic()
        self._name = name
        self._counted_from: tuple[int, float] | None = None  # finished parts when the count began, and its time
        self.ended = self.parts = 0

    def __call__(self, name: str) -> None:
        """Begin the next piece of work."""
        self._name = name
        self._counted_from = None
        self.ended = self.parts = 0

    def count(self, ended: int, parts: int) -> None:
        """Set the number of finished parts of this piece of work, and their total."""
        if self._counted_from is None:
            self._counted_from = ended, time.monotonic()
        self.ended, self.parts = ended, parts

    @property
    def elapsed(self) -> float:
        """Return the seconds since the command began to work."""
        return time.monotonic() - self._start

    @property
    def remaining(self) -> float | None:
        """Return the seconds for the remaining parts at the current pace; None if no part has finished."""
        if self._counted_from is None:
            return None
        before, since = self._counted_from
        if self.ended <= before:
            return None
        return (time.monotonic() - since) / (self.ended - before) * (self.parts - self.ended)

    def __str__(self) -> str:
        """Return elapsed time, finished parts, remaining time, and the name of the work as text."""
        pieces = [duration(self.elapsed)]
        if self.parts:
            pieces.append(f"{self.ended} of {self.parts}")
        if self.remaining is not None:
            pieces.append(f"about {duration(self.remaining)} left")
        return f"{', '.join(pieces)}: {self._name}"


def duration(seconds: float) -> str:
    """Return a time as text in whole seconds or minutes, or in hours."""
    if seconds < _FEW * _MINUTE_S:
        return f"{seconds:.0f} s"
    if seconds < _FEW * _HOUR_S:
        return f"{seconds / _MINUTE_S:.0f} min"
    return f"{seconds / _HOUR_S:.1f} h"


@contextmanager
def showing_progress(name: str) -> Iterator[Work]:
    """Show progress on stderr until the block ends; the block updates the yielded work."""
    work = Work(name)
    with _progress_bar(work) if _is_capable_terminal() else _progress_lines(work):
        yield work


def _is_capable_terminal() -> bool:
    """Return whether stderr is a terminal that can erase a line; those of notebooks and editors cannot."""
    # set in child processes of a notebook's kernel
    is_bare = os.environ.get("TERM") in ("dumb", "unknown") or "JPY_PARENT_PID" in os.environ
    return sys.stderr.isatty() and not is_bare


@contextmanager
def _progress_bar(work: Work) -> Iterator[None]:
    """Draw a line at the bottom of the terminal, with a bar if parts are counted; it vanishes when the block ends."""
    from rich.console import Console
    from rich.live import Live
    from rich.progress_bar import ProgressBar
    from rich.spinner import Spinner
    from rich.table import Table
    from rich.text import Text

    spinner = Spinner("dots")

    def frame() -> "RenderableType":
        line = Table.grid(padding=(0, 1))
        bar = ProgressBar(total=work.parts, completed=work.ended, width=_BAR_WIDTH) if work.parts else spinner
        line.add_row(bar, Text(str(work), no_wrap=True, overflow="ellipsis"))
        return line

    live = Live(get_renderable=frame, console=Console(stderr=True), transient=True, refresh_per_second=_FRAMES_PER_S)
    try:
        with signals_for_this_thread():  # it starts a thread that draws
            live.start(refresh=True)
        yield
    finally:
        live.stop()


@contextmanager
def _progress_lines(work: Work) -> Iterator[None]:
    """Print a line after 5 s, 10 s, 20 s and 40 s of work, and then each minute."""
    has_ended = threading.Event()

    def tell() -> None:
        due = FIRST_LINE_S
        while not has_ended.wait(due - work.elapsed):
            with suppress(OSError, ValueError):  # nobody reads it, or it is closed
                print(f"pipeline: {work}", file=sys.stderr, flush=True)
            due += min(due, _LONGEST_PAUSE_S)

    thread = threading.Thread(target=tell, daemon=True)
    try:
        with signals_for_this_thread():
            thread.start()
        yield
    finally:
        has_ended.set()
        thread.join()
