"""Seconds of stages: a stage entered twice adds up, one that fails counts too, and the total holds all."""

import pytest

from pipeline.storage import stopwatch
from pipeline.storage.stopwatch import Stopwatch


@pytest.fixture
def clock(monkeypatch):
    """Let every look at a clock find it one second later, wall and processor apart."""
    now = {"wall": 0.0, "cpu": 100.0}

    def look(name):
        now[name] += 1.0
        return now[name]

    monkeypatch.setattr(stopwatch.time, "perf_counter", lambda: look("wall"))
    monkeypatch.setattr(stopwatch.time, "process_time", lambda: look("cpu"))
    return now


@pytest.mark.usefixtures("clock")
def test_stages_add_up_and_the_total_is_all_since_the_start():
    timed = Stopwatch()
    assert timed("contact", lambda a, b: a + b, 1, b=2) == 3
    timed("springs", int)
    timed("contact", int)
    seconds = timed.seconds()
    assert seconds.wall == {"contact": 2.0, "springs": 1.0, "total": 7.0}
    assert seconds.cpu == {"contact": 2.0, "springs": 1.0, "total": 7.0}


@pytest.mark.usefixtures("clock")
def test_stage_that_fails_is_counted():
    timed = Stopwatch()
    with pytest.raises(ZeroDivisionError, match="division by zero"):
        timed("contact", lambda: 1 / 0)
    assert timed.seconds().wall["contact"] == 1.0


def test_seconds_are_to_the_millisecond(monkeypatch):
    looks = iter([0.0, 0.0, 0.1234567, 1.0])
    monkeypatch.setattr(stopwatch.time, "perf_counter", lambda: next(looks))
    timed = Stopwatch()
    timed("contact", int)
    assert timed.seconds().wall == {"contact": 0.123, "total": 1.0}
