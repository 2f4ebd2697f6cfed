"""The same points to the bit from one process, from two, from a cluster, and after workers and runs were killed.

Every study here runs in a process of its own with a deadline, so that one that waits for ever fails its test.
"""

import os
import pty
import signal
import sqlite3
import threading
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

DEADLINE_S = 600.0
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


@pytest.fixture(scope="module")
def whole(engine: Engine, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return the table of the study, solved in this process."""
    folder = tmp_path_factory.mktemp("whole")
    path = folder / "springs.toml"
    path.write_text(TEXT, encoding="utf-8")
    assert run_study(read_study(path), folder / "out", engine).done == 8
    return table(path, folder / "out")


def solved(start: Start, study_path: Path, folder: Path, *flags: str) -> bytes:
    """Return the table of a study that a process has solved to its end."""
    code, _, complaint = start(*words_of(study_path, folder, *flags)).ended()
    assert code == 0, complaint
    assert stored_count(folder) == 8
    return table(study_path, folder)


def test_killed_and_interrupted_runs_go_on_to_the_same_table(
    start: Start, written: Write, whole: bytes, tmp_path: Path
) -> None:
    path, wanted = written(TEXT), [130, -signal.SIGKILL]
    for attempt in range(10):  # a study that ends by itself before the signal comes is tried anew
        folder, codes = tmp_path / f"killed-{attempt}", []
        for number in (signal.SIGINT, signal.SIGKILL):
            before = stored_count(folder)
            run = start(*words_of(path, folder, "--processes", "2"))
            run.wait_for(lambda before=before, folder=folder: stored_count(folder) > before)
            workers = run.workers()
            run.process.send_signal(number)
            codes.append(run.ended()[0])
            run.wait_for_end_of(workers)
        if codes == wanted:
            break
    assert codes == wanted
    assert solved(start, path, folder, "--processes", "2") == whole


@pytest.mark.parametrize("begun", [0, 1])
def test_ctrl_c_of_a_terminal_is_one_line_and_gives_the_cursor_back(
    start: Start, written: Write, tmp_path: Path, begun: int
) -> None:
    """The terminal sends it to the workers too: here while the first one starts, and when some have solved."""
    terminal, other = pty.openpty()
    shown: list[bytes] = []
    reader = threading.Thread(target=read_to_the_end, args=(terminal, shown), daemon=True)
    folder = tmp_path / "out"
    run = start(*words_of(written(TEXT), folder, "--processes", "2"), stderr=other, TERM="xterm-256color")
    os.close(other)
    reader.start()
    run.wait_for(lambda: run.workers() and stored_count(folder) >= begun)
    os.killpg(run.process.pid, signal.SIGINT)
    code, _, _ = run.ended()
    reader.join(DEADLINE_S)
    text = b"".join(shown).decode()
    assert "Traceback" not in text
    assert text.count("\x1b[?25l") == text.count("\x1b[?25h")  # hidden, shown
    assert (code, text.count("pipeline: interrupted")) == (130, 1)


def read_to_the_end(terminal: int, shown: list[bytes]) -> None:
    """Read what a terminal shows until nobody writes to it any more."""
    with suppress(OSError):
        while some := os.read(terminal, 65536):
            shown.append(some)
    os.close(terminal)


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
    code, _, complaint = run.ended()
    assert code == 0, complaint
    assert lost
    assert table(path, killed) == whole


SMALL_DISK = """
import resource
import sys

from pipeline.cli import main

if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))  # no file of this process grows beyond it
    sys.exit(main(sys.argv[1:]))
"""


def test_full_disk_is_one_line_and_the_study_goes_on_when_there_is_room(start: Start, tmp_path: Path) -> None:
    path, script, folder = tmp_path / "many.toml", tmp_path / "small_disk.py", tmp_path / "out"
    path.write_text(TEXT.replace("samples = 8", "samples = 2000").replace('"tips.side_mm"', '"targets.NL"'), "utf-8")
    path.write_text(path.read_text("utf-8").replace("from = 0.9, to = 1.1", "from = 0.04, to = 0.06"), "utf-8")
    script.write_text(SMALL_DISK, encoding="utf-8")
    small = start(script, *words_of(path, folder, "--processes", "1")[2:], PYTHONPATH=str(Path(__file__).parents[4]))
    code, _, complaint = small.ended()
    assert code == 2
    assert complaint.count("\n") == 1
    assert "all points before this one are kept" in complaint
    kept = stored_count(folder)
    assert 0 < kept < 2000
    code, printed, complaint = start(*words_of(path, folder, "--processes", "1")).ended()
    assert (code, complaint) == (0, "")
    assert "2000 points: 2000 done" in printed
    assert f"{2000 - kept} solved in" in printed


def test_cluster_agrees_to_the_bit_and_a_lost_one_is_one_line(
    start: Start, written: Write, whole: bytes, dask_cluster: tuple[Any, str], tmp_path: Path
) -> None:
    path, folder, (cluster, address) = written(TEXT), tmp_path / "lost", dask_cluster
    assert address.startswith("tcp://127.0.0.1:")
    run = start(*words_of(path, tmp_path / "dask", "--scheduler", address))
    run.wait_for(lambda: stored_count(tmp_path / "dask") >= 1)
    os.kill(cluster.workers()[0], signal.SIGKILL)  # its nanny starts another
    code, _, complaint = run.ended()
    assert (code, complaint) == (0, "")
    assert table(path, tmp_path / "dask") == whole
    run = start(*words_of(path, folder, "--scheduler", address))
    run.wait_for(lambda: stored_count(folder) >= 1)
    cluster.clear()
    code, _, complaint = run.ended()
    assert code == 2
    assert complaint.count("\n") == 1
    assert f"{address}': must be the address of a scheduler that answers, and it is gone" in complaint
    assert 1 <= stored_count(folder) < 8
    assert solved(start, path, folder, "--processes", "1") == whole


POOL = """
from pipeline.study.workers.pool import ProcessPool, WorkerLostError

HALF_AN_ANSWER = '''
import os, signal
from multiprocessing.connection import Connection
def send_half(self, data, write=os.write):
    write(self.fileno(), bytes(data)[: len(data) // 2])
    os.kill(os.getpid(), signal.SIGKILL)
Connection._send = send_half
'''
DEAF = '''
import signal
signal.signal(signal.SIGTERM, signal.SIG_IGN)
while True:
    pass
'''
ODD = '''
class Odd(ValueError):
    def __init__(self, one, two):
        super().__init__(one)
import builtins
builtins.Odd, Odd.__module__ = Odd, "builtins"
raise Odd(1, 2)
'''
if __name__ == "__main__":
    pool = ProcessPool(2)
    try:
        pool.submit(exec, HALF_AN_ANSWER).result()
    except WorkerLostError:
        print("lost")
    try:
        pool.submit(int, "two").result()
    except ValueError:
        print("raised")
    print(pool.submit(abs, -3).result())
    for call in (eval, "lambda: 0"), (exec, "from json import JSONDecodeError as E; raise E('x', 'y', 0)"), (exec, ODD):
        try:
            pool.submit(*call).result()
        except RuntimeError as error:
            print(type(error).__name__)
        except ValueError:
            print("raised")
    print(pool.submit(abs, -4).result())
    pool.submit(exec, DEAF)
    pool.shutdown(wait=True)
    print("ended")
"""


def test_pool_outlives_half_an_answer_odd_answers_and_a_worker_deaf_to_signals(start: Start, tmp_path: Path) -> None:
    script = tmp_path / "pool.py"
    script.write_text(POOL, encoding="utf-8")
    code, printed, complaint = start(script, PYTHONPATH=str(Path(__file__).parents[4])).ended()
    assert (code, complaint) == (0, "")
    assert printed.split() == ["lost", "raised", "3", "RuntimeError", "raised", "RuntimeError", "4", "ended"]


def test_unreachable_scheduler_is_one_line(written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    assert main(["study", str(written(TEXT)), "--out", str(tmp_path / "none"), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
