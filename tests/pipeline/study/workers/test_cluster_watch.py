"""A cluster that can answer no more is refused in words; one that may start anew is waited for."""

from typing import Any

import pytest

from cad.quantity import InputError
from pipeline.study.workers import cluster


class Scheduler:
    """What a client of Dask asks a scheduler, with answers of this test."""

    def __init__(self, answers: list[Any]) -> None:
        self.answers = iter(answers)
        self.scheduler = self
        self.ncores = None

    def sync(self, _question: object, *, callback_timeout: float) -> Any:  # noqa: ARG002 - as a client names it
        answer = next(self.answers)
        if isinstance(answer, Exception):
            raise answer
        return answer


@pytest.mark.parametrize("error", [OSError(), ConnectionError(), RuntimeError()])
def test_scheduler_that_closed_is_gone(error: Exception) -> None:
    watch = cluster._Watch(Scheduler([{"tcp://x:1": 1}, error]), "tcp://x:2")
    watch.check()
    with pytest.raises(InputError, match=r"tcp://x:2.*it is gone; all points that ended are kept"):
        watch.check()


def test_busy_scheduler_is_asked_three_times() -> None:
    slow, workers = TimeoutError(), {"tcp://x:1": 1}
    watch = cluster._Watch(Scheduler([slow, slow, workers, slow, slow, slow]), "tcp://x:2")
    watch.check()
    with pytest.raises(InputError, match="it is gone"):
        watch.check()


def test_client_that_gave_up_has_no_scheduler() -> None:
    client = Scheduler([])
    client.scheduler = None
    with pytest.raises(InputError, match="it is gone"):
        cluster._Watch(client, "tcp://x:2").check()


def test_workers_may_come_back_within_two_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(cluster.time, "monotonic", lambda: now[0])
    workers = {"tcp://x:1": 1}
    watch = cluster._Watch(Scheduler([{}, {}, workers, {}, {}, {}]), "tcp://x:2")
    for seconds in (1000.0, 1119.0, 1200.0, 1400.0, 1519.0):
        now[0] = seconds
        watch.check()
    now[0] = 1521.0
    with pytest.raises(InputError, match="it has had none for 120 s"):
        watch.check()


def test_workers_that_never_say_their_code_are_refused() -> None:
    with pytest.raises(InputError, match="one whose workers answer within 120 s"):
        cluster._refuse_other_code(Scheduler([TimeoutError()]), "tcp://x:2")
