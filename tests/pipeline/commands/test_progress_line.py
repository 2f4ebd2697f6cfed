"""Progress is one line on a terminal, nothing in a pipe, and never ends the work."""

import io
import sys
import time

import pytest

from pipeline.commands import progress_line as line
from pipeline.commands.progress_line import ProgressLine, showing_progress
from pipeline.storage.announcement import CLEARED, announce, fresh_line, listening
from pipeline.storage.stopwatch import WORK, Stopwatch


class Terminal(io.StringIO):
    """A stream that says it is a terminal, and may be broken."""

    broken = False

    def isatty(self):
        return True

    def write(self, text):
        if self.broken:
            raise OSError
        return super().write(text)


@pytest.fixture
def patched(monkeypatch):
    """Return a function that puts a terminal in the place of stderr; pytest puts its own there before each test."""
    monkeypatch.setattr(line, "_EVERY_S", 0.001)

    def put():
        stream = Terminal()
        monkeypatch.setattr(sys, "stderr", stream)
        return stream

    return put


def wait_for(terminal, words):
    return any(words in terminal.getvalue() or time.sleep(0.001) for _ in range(5000))


def test_stages_are_shown_and_wiped_at_the_end(patched):
    terminal = patched()
    with showing_progress("start"):
        Stopwatch()("springs", lambda: wait_for(terminal, f"springs: {WORK['springs']}"[:40]))
    assert f"springs: {WORK['springs']}"[:40] in terminal.getvalue()
    assert terminal.getvalue().endswith(CLEARED)
    assert "\n" not in terminal.getvalue()


def test_pipe_and_json_stay_quiet(patched, monkeypatch, capsys):
    terminal = patched()
    with showing_progress("start", quiet=True):
        announce("work")
    assert terminal.getvalue() == ""
    monkeypatch.undo()
    with showing_progress("start"):
        announce("work")
    assert capsys.readouterr().err == ""


def test_terminal_that_refuses_does_not_end_the_work(patched):
    terminal = patched()
    with showing_progress("start"):
        terminal.broken = True
        announce("work")
    assert fresh_line() == ""


def test_failure_of_the_work_is_the_works_own(patched):
    terminal = patched()

    def fail():
        msg = "of the work"
        raise ValueError(msg)

    with pytest.raises(ValueError, match="of the work"), showing_progress("start"):
        fail()
    assert terminal.getvalue().endswith(CLEARED)


@pytest.mark.parametrize("columns", [1, 20, 80])
def test_line_never_wraps(columns):
    shown = ProgressLine()
    shown.tell("x" * 200)
    assert len(shown.text(columns)) <= columns - 1


def test_who_listens_hears_and_a_line_that_stays_begins_afresh():
    heard = []
    with listening(heard.append):
        announce("a")
        assert fresh_line() == CLEARED
    announce("b")
    assert heard == ["a"]
