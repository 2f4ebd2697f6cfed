"""Work in another process: on one thread, with its errors, beyond the end of a worker, and here where there is none."""

import os
import signal
from concurrent.futures import BrokenExecutor
from multiprocessing import resource_tracker

import pytest
from refusal import refusal

from pipeline.storage import workers
from pipeline.storage.workers import cad_worker, close_workers, open_workers, submit
from sensor.quantity import InputError


@pytest.fixture
def executor():
    opened = open_workers(1)
    yield opened
    close_workers(opened)


def refuse(field):
    msg = "a tip"
    raise InputError(msg, field=field, value=3.0, bound="less than 2")


def test_without_proc_there_is_one_core_and_no_worker(monkeypatch, tmp_path):
    monkeypatch.setattr(workers, "_PROC", tmp_path / "absent")
    assert workers.available_cores() == 1
    with workers.cad_worker() as executor:
        assert executor is None
    assert refusal(workers.open_workers, 1).field == "/proc"


def test_work_runs_elsewhere_on_one_thread_and_its_errors_come_back_whole(executor):
    assert submit(executor, os.getpid).result() != os.getpid()
    assert submit(executor, os.getenv, "OMP_NUM_THREADS").result() == "1"
    refused = refusal(submit(executor, refuse, "tips.side_mm").result)
    assert (refused.field, refused.value, refused.bound) == ("tips.side_mm", 3.0, "less than 2")
    assert submit(executor, abs, -3).result() == 3


def test_worker_never_hears_ctrl_c(monkeypatch):
    """Nor the first one of a process, which is started with Python's own tracker of semaphores."""
    tracker = resource_tracker._resource_tracker
    for name in ("_fd", "_pid"):
        monkeypatch.setattr(tracker, name, None)
    executor = open_workers(1)
    process = executor.submit(os.getpid)
    (pid,) = executor._processes
    os.kill(pid, signal.SIGINT)  # it is loading
    assert process.result() == pid
    executor.submit(os.kill, pid, signal.SIGINT).result()
    assert submit(executor, abs, -3).result() == 3
    close_workers(executor)
    os.close(tracker._fd)
    os.waitpid(tracker._pid, 0)


def test_worker_that_is_killed_is_one_error_and_the_next_executor_works(executor):
    process = submit(executor, os.getpid).result()
    with pytest.raises(BrokenExecutor):
        submit(executor, os.kill, process, signal.SIGKILL).result()
    another = open_workers(1)
    assert submit(another, abs, -4).result() == 4
    close_workers(another)


def test_one_core_or_no_wish_for_a_worker_does_the_work_here(monkeypatch):
    with cad_worker(wanted=False) as executor:
        assert submit(executor, os.getpid).result() == os.getpid()
    monkeypatch.setattr(workers, "available_cores", lambda: 1)
    with cad_worker() as executor:
        assert submit(executor, os.getpid).result() == os.getpid()
