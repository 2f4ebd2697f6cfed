"""The same points to the bit from one process, from two, from a cluster, and after workers and runs were killed.

Every study here runs in a process of its own with a deadline, so that one that waits for ever fails its test.
"""

import os
import signal
import sqlite3
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from pipeline.cli import main
from pipeline.study import read_study, run_study
from pipeline.study.export import export_table
from pipeline.study.store import STORE, stored_study
from pipeline.study.workers.engine import Engine

pytestmark = pytest.mark.slow

Write = Callable[..., Path]
Start = Callable[..., Any]

TEXT = """
base = "paper"
samples = 8
seed = 5
wanted = ["springs.K_l_N_per_m", "contact.K_m_over_E_mm", "verdicts.P_max.value"]
[vary]
"targets.P_max" = { from = 3, to = 8 }
"tips.side_mm" = { from = 0.9, to = 1.1 }
"""


def table(study_path: Path, folder: Path) -> bytes:
    target = folder.parent / f"{folder.name}.csv"
    with stored_study(folder) as store:
        export_table(store, read_study(study_path), target)
    return target.read_bytes()


def words_of(study_path: Path, folder: Path, *flags: str) -> tuple[str | Path, ...]:
    return "-m", "pipeline", "study", study_path, "--out", folder, *flags


def stored_count(folder: Path) -> int:
    if not (folder / STORE).is_file():
        return 0
    with stored_study(folder) as store:
        try:
            return sum(store.counts().values())
        except sqlite3.OperationalError:  # the table is not made yet
            return 0


@pytest.fixture
def whole(written: Write, engine: Engine, tmp_path: Path) -> bytes:
    """Return the table of the study, solved in this process."""
    path = written(TEXT)
    assert run_study(read_study(path), tmp_path / "whole", engine).done == 8
    return table(path, tmp_path / "whole")


def solved(start: Start, study_path: Path, folder: Path, *flags: str) -> bytes:
    """Return the table of a study that a process has solved to its end."""
    code, complaint = start(*words_of(study_path, folder, *flags)).ended()
    assert code == 0, complaint
    assert stored_count(folder) == 8
    return table(study_path, folder)


def test_two_processes_and_a_killed_run_agree_to_the_bit(
    start: Start, written: Write, whole: bytes, tmp_path: Path
) -> None:
    path, killed = written(TEXT), tmp_path / "killed"
    assert solved(start, path, tmp_path / "two", "--processes", "2") == whole
    for kills in (1, 4):
        run = start(*words_of(path, killed, "--processes", "1"))
        run.wait_for(lambda kills=kills: stored_count(killed) >= kills)
        run.kill()
    assert solved(start, path, killed, "--processes", "1") == whole


def test_killed_workers_are_replaced(start: Start, written: Write, whole: bytes, tmp_path: Path) -> None:
    path, killed = written(TEXT), tmp_path / "killed"
    run = start(*words_of(path, killed, "--processes", "2"))
    lost = []
    for stored in (0, 2):  # while workers start, and while they solve
        run.wait_for(lambda stored=stored: run.workers() and stored_count(killed) >= stored)
        for worker in run.workers()[:1]:
            with suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)
                lost.append(worker)
    code, complaint = run.ended()
    assert code == 0, complaint
    assert lost
    assert table(path, killed) == whole


CLUSTER = """
import sys

from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, protocol="tcp", host="127.0.0.1",
                      dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.readline()
"""


def test_cluster_of_two_workers_over_tcp_agrees_to_the_bit(
    start: Start, written: Write, whole: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    path, script = written(TEXT), tmp_path / "cluster.py"
    script.write_text(CLUSTER, encoding="utf-8")
    cluster = start(script, PYTHONPATH=str(Path(__file__).parents[3]), OPENBLAS_NUM_THREADS="1")
    address = cluster.line()
    assert address.startswith("tcp://127.0.0.1:")
    assert solved(start, path, tmp_path / "dask", "--scheduler", address) == whole
    assert main(["study", str(path), "--out", str(tmp_path / "none"), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
