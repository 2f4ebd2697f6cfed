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
    seconds = timed.seconds()
    assert seconds.wall == {"contact": 2.001, "springs": 1.0, "total": 7.003}
    assert seconds.cpu == {"contact": 2.001, "springs": 1.0, "total": 7.003}
    assert told == [f"{stage}: {WORK[stage]}" for stage in ("contact", "springs", "contact")]
