"""Seconds of stages: a stage entered twice adds up, one that fails counts too, and the total holds all."""

from contextlib import suppress

from pipeline.storage import stopwatch
from pipeline.storage.stopwatch import WORK, Stopwatch


def test_seconds_of_a_stage_inside_another_one_count_to_the_inner_one(monkeypatch):
    """Each stage is the sum of the clock's steps that end in it: no second counts twice, also if a stage fails."""
    now = 0.0

    def works(seconds):
        nonlocal now
        now += seconds

    monkeypatch.setattr(stopwatch.time, "perf_counter", lambda: now)
    monkeypatch.setattr(stopwatch.time, "process_time", lambda: 0.5 * now)
    told = []
    timed = Stopwatch(told.append)
    works(1.0)  # in no stage
    with suppress(ZeroDivisionError), timed.stage("verdicts"):
        works(2.0)
        with timed.stage("response"):
            works(4.0)
            with timed.stage("contact"):
                works(8.0)
            works(16.0004)
        works(32.0)
        _ = 1 / 0
    with timed.stage("response"):
        works(64.0)
    seconds = timed.seconds()
    assert seconds.wall == {"verdicts": 34.0, "response": 84.0, "contact": 8.0, "total": 127.0}
    assert seconds.cpu == {"verdicts": 17.0, "response": 42.0, "contact": 4.0, "total": 63.5}
    assert told[0] == f"verdicts: {WORK['verdicts']}"
    begun = len(told)
    with timed.stage("response"):
        assert len(told) == begun  # the same stage goes on
