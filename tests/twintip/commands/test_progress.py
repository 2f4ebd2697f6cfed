"""Long work says on stderr what it is at: a bar on a terminal, and elsewhere a line after some seconds."""

import io
import math
import re
import sys
import time

import pytest
from progress_lines import without_progress

from twintip.commands import progress
from twintip.commands.progress import Work, showing_progress

DEADLINE_S = 30.0  # a line comes after 0.05 s, and later on a busy machine


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Return a list with the time [s], which a test moves on."""
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_remaining_time_is_that_of_the_other_parts_at_the_pace_so_far(clock):
    work = Work("solving points")
    clock[0] += 30.0  # before the count, as a library takes to load
    work.count(100, 144)  # a study that was begun by another run
    assert work.remaining is None
    clock[0] += 8.0
    work.count(104, 144)
    assert work.remaining == pytest.approx(8.0 / 4 * 40)
    assert str(work) == "38 s, 104 of 144, about 80 s left: solving points"
    work("writes the page")
    assert (work.remaining, str(work)) == (None, "38 s: writes the page")


def test_lines_come_once_work_is_long_and_then_less_often(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with showing_progress("is quick"):
        pass
    assert sys.stderr.getvalue() == ""
    monkeypatch.setattr(progress, "FIRST_LINE_S", 0.05)  # the next lines follow after 0.1, 0.2, 0.4 s ...
    with showing_progress("solves") as work:
        work.count(1, 2)
        while "1 of 2" not in sys.stderr.getvalue() and work.elapsed < DEADLINE_S:
            time.sleep(0.01)
    lines = sys.stderr.getvalue().splitlines(keepends=True)
    # A busy machine may delay a line, but the lines are never more than the time until now allows.
    assert 1 <= len(lines) <= 1 + math.log2(work.elapsed / progress.FIRST_LINE_S)
    assert re.fullmatch(r"(pipeline: \d+ s(, 1 of 2)?: solves\n)+", "".join(lines))
    complaint = "pipeline: --out = 3 s must be a folder.\n"
    assert without_progress("".join([*lines, complaint])) == complaint


@pytest.mark.parametrize(
    ("variable", "value", "frames"), [("TERM", "xterm", True), ("TERM", "dumb", False), ("JPY_PARENT_PID", "1", False)]
)
def test_nothing_is_drawn_where_a_line_cannot_be_erased(monkeypatch, variable, value, frames):
    monkeypatch.delenv("JPY_PARENT_PID", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv(variable, value)
    monkeypatch.setattr(sys, "stderr", Terminal())
    with showing_progress("is quick"):
        pass
    assert bool(sys.stderr.getvalue()) is frames
