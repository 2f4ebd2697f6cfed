"""Seconds of stages: a stage entered twice adds up, one that fails counts too, and the total holds all."""

import pytest

from pipeline.storage import stopwatch
from pipeline.storage.stopwatch import WORK, Stopwatch


def test_stages_add_up_also_one_that_fails_and_are_told(monkeypatch):
    now = {"wall": 0.0, "cpu": 100.0}

    def look(name):
        now[name] += 1.0004
        return now[name]

    monkeypatch.setattr(stopwatch.time, "perf_counter", lambda: look("wall"))
    monkeypatch.setattr(stopwatch.time, "process_time", lambda: look("cpu"))
    told = []
    timed = Stopwatch(told.append)
    for stage in ("contact", "springs"):
        with timed.stage(stage):
            pass
    with pytest.raises(ZeroDivisionError), timed.stage("contact"):
        _ = 1 / 0
    told_once = len(told)
    seconds = timed.seconds()
    assert seconds.wall == {"contact": 2.001, "springs": 1.0, "total": 7.003}
    assert seconds.cpu == {"contact": 2.001, "springs": 1.0, "total": 7.003}
    assert told == [f"{stage}: {WORK[stage]}" for stage in ("contact", "springs", "contact")]
    with timed.stage("contact"):
        assert len(told) == told_once  # the same stage goes on


def test_seconds_of_a_stage_inside_another_one_count_to_the_inner_one(monkeypatch):
    """Each stage is the sum of the clock's steps that end in it: no second counts twice."""
    now = 0.0

    def works(seconds):
        nonlocal now
        now += seconds

    monkeypatch.setattr(stopwatch.time, "perf_counter", lambda: now)
    monkeypatch.setattr(stopwatch.time, "process_time", lambda: 0.5 * now)
    timed = Stopwatch()
    works(1.0)  # in no stage
    with timed.stage("verdicts"):
        works(2.0)
        with timed.stage("response"):
            works(4.0)
            with timed.stage("contact"):
                works(8.0)
            works(16.0)
        works(32.0)
    with timed.stage("response"):
        works(64.0)
    seconds = timed.seconds()
    assert seconds.wall == {"verdicts": 34.0, "response": 84.0, "contact": 8.0, "total": 127.0}
    assert seconds.cpu == {"verdicts": 17.0, "response": 42.0, "contact": 4.0, "total": 63.5}
