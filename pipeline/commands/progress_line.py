"""One line on the terminal that says what a command works on and for how long; gone when the answer comes."""

import shutil
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from pipeline.storage.announcement import CLEARED, announce, listening

_EVERY_S = 0.5


class ProgressLine:
    """A line on stderr that is written anew twice a second; a terminal that refuses it gets no more."""

    def __init__(self) -> None:
        """Start the clock; nothing is written yet."""
        self._started = time.monotonic()
        self._work = ""
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._keep_writing, daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def tell(self, work: str) -> None:
        """Say what is worked on."""
        self._work = work

    def stop(self) -> None:
        """Wipe the line and write no more."""
        self._done.set()
        self._thread.join()
        self._write("")

    def text(self, columns: int) -> str:
        """Return the line for a terminal of some columns, cut where it would wrap."""
        return f"{time.monotonic() - self._started:4.0f} s  {self._work}"[: max(0, columns - 1)]

    def _keep_writing(self) -> None:
        while not self._done.wait(_EVERY_S):
            if not self._write(self.text(shutil.get_terminal_size().columns)):
                return

    def _write(self, text: str) -> bool:
        """Write, and say whether the terminal took it: a line that nobody sees must not end a run."""
        try:
            sys.stderr.write(CLEARED + text)
            sys.stderr.flush()
        except (OSError, ValueError):
            return False
        return True


@contextmanager
def showing_progress(work: str, *, quiet: bool = False) -> Iterator[None]:
    """Show what is announced inside the block, first of all `work`, where stderr is a terminal and not `quiet`."""
    if quiet or not sys.stderr.isatty():
        yield
        return
    line = ProgressLine()
    with listening(line.tell):
        announce(work)
        line.start()
        try:
            yield
        finally:
            line.stop()
