"""The same points to the bit from one process, from two, from a cluster, and after workers and runs were killed.

Every study here runs in a process of its own with a deadline, so that one that waits for ever fails its test.
"""

import os
import signal
import sqlite3
from concurrent.futures import BrokenExecutor, Executor
from contextlib import suppress

import pytest
from deadline import DEADLINE_S
from refusal import refusal

from pipeline.study import read_study, run_study
from pipeline.study.engines import MAX_PROCESSES, Engine, completed_items, process_engine
from pipeline.study.store import STORE, stored_study
from pipeline.study.study_table import export_table
from sensor.quantity import InputError

POINTS = 8
TEXT = f"""
base = "paper"
samples = {POINTS}
seed = 5
wanted = ["springs.K_l_N_per_m", "contact.K_m_over_E_mm", "verdicts.P_max.value"]
[vary]
"targets.P_max" = {{ from = 3, to = 8 }}
"tips.side_mm" = {{ from = 0.9, to = 1.1 }}
"""


def table(folder):
    target = folder.parent / f"{folder.name}.csv"
    with stored_study(folder) as store:
        export_table(store, target)
    return target.read_bytes()


def words_of(study_path, folder, *flags):
    return "-m", "twintip", "study", study_path, "--out", folder, *flags


def stored_count(folder):
    if not (folder / STORE).is_file():
        return 0
    with stored_study(folder) as store:
        try:
            return sum(store.counts().values())
        except sqlite3.OperationalError:  # the table is not made yet
            return 0


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the table of the study, solved by one process: on one thread, as all workers are."""
    folder = tmp_path_factory.mktemp("whole")
    path = folder / "springs.toml"
    path.write_text(TEXT, encoding="utf-8")
    with process_engine(1) as engine:
        assert run_study(read_study(path), folder / "out", engine).done == POINTS
    return table(folder / "out")


@pytest.mark.parametrize("count", [0, MAX_PROCESSES + 1])
def test_number_of_processes_has_bounds(count):
    with pytest.raises(InputError) as refused, process_engine(count):
        pass
    assert (refused.value.field, refused.value.value) == ("--processes", count)


def test_task_that_kills_its_worker_is_lost_and_no_other():
    with process_engine(2) as engine:
        tasks = [0, 0, 0, signal.SIGKILL, 0, 0, 0]  # signal 0 does nothing
        ended = list(completed_items(engine, signal.raise_signal, tasks, lambda _: "lost"))
    assert ended == [*[(0, None)] * 6, (signal.SIGKILL, "lost")]


@pytest.mark.slow
def test_script_without_a_guard_may_run_a_study(start, written, tmp_path):
    """As in docs/studies.md: stdin has no `if __name__ == "__main__"`."""
    text = f"""
from pathlib import Path
from pipeline.study import process_engine, read_study, run_study
with process_engine(processes=2) as engine:
    print(run_study(read_study(Path({str(written())!r})), Path({str(tmp_path / "out")!r}), engine).done)
"""
    run = start("-")
    run.process.stdin.write(text)
    assert run.ended() == (0, f"{POINTS}\n", "")


@pytest.mark.slow
def test_scheduler_that_nobody_is_leaves_nothing_behind_its_one_line(start, written, tmp_path):
    """A client that is given up before it found one says so half a minute later, with a traceback."""
    pytest.importorskip("distributed")
    run = start(*words_of(written(), tmp_path / "out", "--scheduler", "nonsense"))
    code, _, complaint = run.ended()
    assert (code, complaint.count("\n")) == (2, 1)


def test_workers_that_never_come_back_are_refused():
    class Broken(Executor):
        def submit(self, *_):  # type: ignore[override]
            raise BrokenExecutor

        def shutdown(self, **_):
            """Have nothing to end."""

    def check():
        msg = "gone"
        raise InputError(msg, field="--scheduler")

    lost = Engine(open=Broken, close=Executor.shutdown, workers=1, lost=(BrokenExecutor,), check=check)
    assert refusal(list, completed_items(lost, abs, [1], abs)).field == "--scheduler"


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [*(pytest.param(number, marks=pytest.mark.study) for number in (signal.SIGINT, signal.SIGTERM)), signal.SIGKILL],
)
def test_study_that_is_ended_goes_on_to_the_same_table(start, written, whole, tmp_path, number):
    path = written(TEXT)
    folder = tmp_path / "ended"
    run = start(*words_of(path, folder, "--processes", "2"))
    run.wait_for(lambda: stored_count(folder) >= 1)
    run.process.send_signal(number)
    if number == signal.SIGKILL:  # its workers keep its streams open until they have been idle for a minute
        assert run.process.wait(DEADLINE_S) == -signal.SIGKILL
    else:
        code, _, complaint = run.ended()
        assert code == 128 + number
        assert "Traceback" not in complaint
    code, _, complaint = start(*words_of(path, folder, "--processes", "2")).ended()
    assert (code, complaint) == (0, "")
    assert table(folder) == whole


@pytest.mark.slow
def test_killed_workers_are_replaced(start, written, whole, tmp_path):
    path = written(TEXT)
    folder = tmp_path / "killed"
    run = start(*words_of(path, folder, "--processes", "2"))
    for stored in (0, 2):  # while workers start, and while they solve
        run.wait_for(lambda stored=stored: run.workers() and stored_count(folder) >= stored)
        for worker in run.workers()[:1]:
            with suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)
    code, _, complaint = run.ended()
    assert code == 0, complaint
    assert table(folder) == whole


def assert_same_numbers(one, other):
    """Arrays that a network delivers lie elsewhere in memory, where a kernel may add in another order: round-off."""
    for line, same in zip(one.decode().splitlines(), other.decode().splitlines(), strict=True):
        for cell, number in zip(line.split(","), same.split(","), strict=True):
            try:
                assert float(cell) == pytest.approx(float(number), rel=1e-12)
            except ValueError:
                assert cell == number


@pytest.mark.study
def test_cluster_agrees_and_a_lost_one_is_one_line(start, written, whole, dask_cluster, tmp_path):
    path = written(TEXT)
    folder = tmp_path / "lost"
    cluster, address = dask_cluster
    run = start(*words_of(path, tmp_path / "dask", "--scheduler", address))
    run.wait_for(lambda: stored_count(tmp_path / "dask") >= 1)
    os.kill(cluster.workers()[0], signal.SIGKILL)  # its nanny starts another
    code, _, complaint = run.ended()
    assert (code, complaint) == (0, "")
    assert_same_numbers(table(tmp_path / "dask"), whole)
    run = start(*words_of(path, folder, "--scheduler", address))
    run.wait_for(lambda: stored_count(folder) >= 1)
    cluster.clear()
    code, _, complaint = run.ended()
    assert (code, complaint.count("\n")) == (2, 1)
    assert address in complaint
    assert 1 <= stored_count(folder) < POINTS
