"""Progress of a command on stderr: a bar on a terminal, or a line after 5 s and then at increasing intervals."""

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from pipeline.storage.interrupts import signals_for_this_thread

if TYPE_CHECKING:
    from rich.console import RenderableType  # not imported without a terminal, because rich is slow to load

FIRST_LINE_S = 5.0
"""Time until the first line is printed [s] if stderr is not a terminal."""
_LONGEST_PAUSE_S = 60.0  # longest time between two lines; the second line comes at twice the time of the first
_FRAMES_PER_S = 5
_BAR_WIDTH = 20  # [characters]
_MINUTE_S, _HOUR_S = 60.0, 3600.0
_SMALLER_UNIT_BELOW = 2  # a time below this number of minutes or hours is shown in the smaller unit


class Work:
    """The progress of a command. Calling it begins the next task, and `count` sets the number of finished parts.

    `ended` is the number of finished parts, and `parts` the total number. Both are 0 unless the parts are counted.
    """

    def __init__(self, name: str) -> None:
        """Begin the first task."""
        self._start = time.monotonic()
        self._name = name
        # The number of finished parts at the first call of `count`, and the time of this call [s].
        self._counted_from: tuple[int, float] | None = None
        self.ended = self.parts = 0

    def __call__(self, name: str) -> None:
        """Begin the next task."""
        self._name = name
        self._counted_from = None
        self.ended = self.parts = 0

    def count(self, ended: int, parts: int) -> None:
        """Set the number of finished parts of the current task, and the total number of its parts."""
        if self._counted_from is None:
            self._counted_from = ended, time.monotonic()
        self.ended, self.parts = ended, parts

    @property
    def elapsed(self) -> float:
        """Return the time since the command began its first task [s]."""
        return time.monotonic() - self._start

    @property
    def remaining(self) -> float | None:
        """Return the time for the remaining parts at the average pace until now [s]; None if no part has finished.

        Parts that were finished before the first call of `count` are not part of the average, because they may have
        been stored by an earlier run.
        """
        if self._counted_from is None:
            return None
        first_ended, first_time = self._counted_from
        if self.ended <= first_ended:
            return None
        seconds_per_part = (time.monotonic() - first_time) / (self.ended - first_ended)
        return seconds_per_part * (self.parts - self.ended)

    def __str__(self) -> str:
        """Return the elapsed time, the finished parts, the remaining time, and the name of the task as text."""
        pieces = [duration(self.elapsed)]
        if self.parts:
            pieces.append(f"{self.ended} of {self.parts}")
        if self.remaining is not None:
            pieces.append(f"about {duration(self.remaining)} left")
        return f"{', '.join(pieces)}: {self._name}"


def duration(seconds: float) -> str:
    """Return a time as text, in whole seconds, in whole minutes, or in hours with one decimal."""
    if seconds < _SMALLER_UNIT_BELOW * _MINUTE_S:
        return f"{seconds:.0f} s"
    if seconds < _SMALLER_UNIT_BELOW * _HOUR_S:
        return f"{seconds / _MINUTE_S:.0f} min"
    return f"{seconds / _HOUR_S:.1f} h"


@contextmanager
def showing_progress(name: str) -> Iterator[Work]:
    """Show progress on stderr until the block ends. The block updates the `Work` that is yielded."""
    work = Work(name)
    display = _progress_bar(work) if _is_capable_terminal() else _progress_lines(work)
    with display:
        yield work


def _is_capable_terminal() -> bool:
    """Return whether stderr is a terminal that can erase a line. The terminals of notebooks and editors cannot."""
    # Jupyter sets JPY_PARENT_PID in the child processes of a kernel.
    is_limited = os.environ.get("TERM") in ("dumb", "unknown") or "JPY_PARENT_PID" in os.environ
    return sys.stderr.isatty() and not is_limited


@contextmanager
def _progress_bar(work: Work) -> Iterator[None]:
    """Draw a status line at the bottom of the terminal during the block, and erase it when the block ends.

    The line shows the progress of `work`. It has a bar if the parts of the task are counted, and a spinner if not.
    """
    from rich.console import Console  # rich is slow to load, and not needed without a terminal
    from rich.live import Live
    from rich.progress_bar import ProgressBar
    from rich.spinner import Spinner
    from rich.table import Table
    from rich.text import Text

    spinner = Spinner("dots")

    def status_line() -> "RenderableType":
        """Return the present status line. rich calls this function for each frame."""
        line = Table.grid(padding=(0, 1))
        bar = ProgressBar(total=work.parts, completed=work.ended, width=_BAR_WIDTH) if work.parts else spinner
        line.add_row(bar, Text(str(work), no_wrap=True, overflow="ellipsis"))
        return line

    console = Console(stderr=True)
    live = Live(get_renderable=status_line, console=console, transient=True, refresh_per_second=_FRAMES_PER_S)
    try:
        with signals_for_this_thread():  # rich starts a thread that draws
            live.start(refresh=True)
        yield
    finally:
        live.stop()


@contextmanager
def _progress_lines(work: Work) -> Iterator[None]:
    """During the block, print a line on `work` to stderr after 5 s, 10 s, 20 s and 40 s, and then about once a minute.

    A thread prints the lines, because the block does not return control while it works.
    """
    has_ended = threading.Event()

    def print_lines() -> None:
        """Print the lines until the block has ended."""
        next_line_s = FIRST_LINE_S  # time of the next line since the start of the work
        while not has_ended.wait(next_line_s - work.elapsed):
            with suppress(OSError, ValueError):  # the reader of stderr has ended, or stderr is closed
                print(f"pipeline: {work}", file=sys.stderr, flush=True)
            next_line_s += min(next_line_s, _LONGEST_PAUSE_S)  # the interval doubles up to the longest pause

    thread = threading.Thread(target=print_lines, daemon=True)
    try:
        with signals_for_this_thread():
            thread.start()
        yield
    finally:
        has_ended.set()
        thread.join()
