"""Threads that call the public functions at once get the answers of one after the other."""

import threading
from concurrent.futures import ThreadPoolExecutor, wait

import pytest
from deadline import DEADLINE_S

import twintip
from mesh.housing.sweep import mesh_of_counts
from sensor.turns import in_turn
from solve.halfspace.punch import square_punch

SETTINGS = ({"targets.NL": 0.0771}, {"targets.NL": 0.0872})


def answers(settings, folder, monkeypatch):
    """Return verdicts and stiffnesses of one design, or of several in threads of their own, solved anew."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    mesh_of_counts.cache_clear()
    square_punch.cache_clear()
    together = threading.Barrier(len(settings))

    def look(changes):
        together.wait()
        result = twintip.run(twintip.load_design("paper", changes), twintip.RunOptions(look=True, tolerance=0.02))
        return result.springs.stiffnesses, [
            (verdict.name, verdict.value, verdict.passed) for verdict in result.verdicts
        ]

    with ThreadPoolExecutor(len(settings)) as threads:
        return list(threads.map(look, settings))


def test_two_runs_at_once_have_the_answers_of_one_after_the_other(tmp_path, monkeypatch):
    alone = [answers([one], tmp_path / str(i), monkeypatch)[0] for i, one in enumerate(SETTINGS)]
    assert answers(SETTINGS, tmp_path / "both", monkeypatch) == alone


@pytest.mark.parametrize(
    "name",
    [
        *("run", "evaluate", "housing", "cover", "mount", "assembly"),
        *("read_press", "calibrate", "c_header", "micropython", "modulus", "run_study"),
    ],
)
def test_what_computes_takes_turns(name):
    """By the lock of `in_turn`: while another thread is inside, a call of any of them waits."""
    entered = threading.Event()
    leave = threading.Event()

    @in_turn()
    def hold():
        entered.set()
        leave.wait(DEADLINE_S)

    function = getattr(twintip, name)  # is imported
    with ThreadPoolExecutor(2) as threads:
        threads.submit(hold)
        assert entered.wait(DEADLINE_S)
        call = threads.submit(function, nonsense=True)
        ended, _ = wait([call], timeout=0.02)
        leave.set()
        with pytest.raises(TypeError):
            call.result()
    assert not ended
