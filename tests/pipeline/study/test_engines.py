"""The same points to the bit from one process, from two, from a cluster, and after workers and runs were killed."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.cli import main
from pipeline.study import process_engine, read_study, run_study
from pipeline.study.execute import StudySummary
from pipeline.study.export import export_table
from pipeline.study.store import STORE, stored_study

pytestmark = pytest.mark.slow

TEXT = """
base = "paper"
samples = 12
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


def solved(study_path: Path, folder: Path, processes: int) -> StudySummary:
    with process_engine(processes) as engine:
        return run_study(read_study(study_path), folder, engine)


def command(study_path: Path, folder: Path, *words: str) -> list[str]:
    return [sys.executable, "-m", "pipeline", "study", str(study_path), "--out", str(folder), *words]


def stored_count(folder: Path) -> int:
    if not (folder / STORE).is_file():
        return 0
    with stored_study(folder) as store:
        try:
            return sum(store.counts().values())
        except sqlite3.OperationalError:  # the table is not made yet
            return 0


def test_one_and_two_processes_and_a_killed_run_agree_to_the_bit(written: Callable[..., Path], tmp_path: Path) -> None:
    path = written(TEXT)
    assert solved(path, tmp_path / "one", 1).done == 12
    assert solved(path, tmp_path / "two", 2).done == 12
    assert table(path, tmp_path / "one") == table(path, tmp_path / "two")
    for kills in (1, 6):
        run = subprocess.Popen(command(path, tmp_path / "killed", "--processes", "1"))
        while stored_count(tmp_path / "killed") < kills and run.poll() is None:
            time.sleep(0.05)
        run.send_signal(signal.SIGKILL)
        run.wait()
    again = solved(path, tmp_path / "killed", 1)
    assert again.done == 12
    assert again.solved < 12
    assert table(path, tmp_path / "killed") == table(path, tmp_path / "one")


def children_of(parent: int) -> list[int]:
    """Return the processes that a process has started."""
    listed = Path(f"/proc/{parent}/task/{parent}/children").read_text(encoding="utf-8").split()
    return [int(number) for number in listed]


def test_killed_worker_is_replaced(written: Callable[..., Path], tmp_path: Path) -> None:
    path = written(TEXT)
    assert solved(path, tmp_path / "one", 1).done == 12
    run = subprocess.Popen(command(path, tmp_path / "killed", "--processes", "2"))
    while stored_count(tmp_path / "killed") < 1 and run.poll() is None:
        time.sleep(0.05)
    workers = [child for child in children_of(run.pid) if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]
    for worker in workers[:1]:
        os.kill(worker, signal.SIGKILL)
    assert run.wait() == 0
    assert table(path, tmp_path / "killed") == table(path, tmp_path / "one")


def test_cluster_of_two_workers_over_tcp_agrees_to_the_bit(
    written: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    path = written(TEXT)
    assert solved(path, tmp_path / "one", 1).done == 12
    program = (
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        "    with LocalCluster(n_workers=2, threads_per_worker=1, protocol='tcp', host='127.0.0.1',\n"
        "                      dashboard_address=None) as cluster:\n"
        "        print(cluster.scheduler_address, flush=True)\n"
        "        input()\n"
    )
    script = tmp_path / "cluster.py"
    script.write_text(program, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3]), "OPENBLAS_NUM_THREADS": "1"}
    cluster = subprocess.Popen(
        [sys.executable, script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    )
    assert cluster.stdin is not None
    assert cluster.stdout is not None
    try:
        address = cluster.stdout.readline().strip()
        assert address.startswith("tcp://127.0.0.1:")
        done = subprocess.run(command(path, tmp_path / "dask", "--scheduler", address), check=False)
        assert done.returncode == 0
    finally:
        cluster.communicate("\n", timeout=60)
    assert table(path, tmp_path / "dask") == table(path, tmp_path / "one")
    assert main(["study", str(path), "--out", str(tmp_path / "none"), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
