"""Studies in processes that cannot outlive a test."""

import os
import select
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from browser import open_page, opened_browser  # noqa: F401 - fixtures
from deadline import DEADLINE_S
from progress_lines import without_progress


def wait_until(holds):
    """Wait until something holds; raise TimeoutError where it does not in time."""
    deadline = time.monotonic() + DEADLINE_S
    while not holds():
        if time.monotonic() > deadline:
            raise TimeoutError
        time.sleep(0.05)


def is_worker(process):
    """Say whether a process is one that solves points."""
    try:
        command = Path(f"/proc/{process}/cmdline").read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return b"popen_loky_posix" in command or b"spawn_main" in command  # loky's, or Dask's


class Run:
    """A process that a test has started, the first of a group of its own; every wait for it has a deadline."""

    def __init__(self, words, **environment):
        """Start it at the root of the project."""
        self.process = subprocess.Popen(
            words,
            cwd=Path(__file__).parents[3],
            env={**os.environ, **environment},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            start_new_session=True,
        )

    def ended(self):
        """Wait for its end; return its exit code, and what it wrote on stdout and, but for its progress, on stderr."""
        printed, complaint = self.process.communicate(timeout=DEADLINE_S)
        return self.process.returncode, printed, without_progress(complaint)

    def wait_for(self, holds):
        """Wait until something holds or the process has ended, whichever is first."""
        wait_until(lambda: holds() or self.process.poll() is not None)

    def first_line(self):
        """Return the first line of what it prints; raises TimeoutError where none comes."""
        assert self.process.stdout is not None
        if not select.select([self.process.stdout], [], [], DEADLINE_S)[0]:
            raise TimeoutError
        return str(self.process.stdout.readline()).strip()

    def workers(self):
        """Return the processes that it has started to solve points; none where it has ended."""
        found = []
        for thread in Path("/proc").glob(f"{self.process.pid}/task/*/children"):
            with suppress(FileNotFoundError, ProcessLookupError):
                found += [int(child) for child in thread.read_text(encoding="utf-8").split() if is_worker(child)]
        return found

    def clear(self):
        """Kill whatever is left of its group, and wait for its end."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.communicate(timeout=DEADLINE_S)


@pytest.fixture
def start():
    """Start processes by their words; none of them outlives the test."""
    started: list[Run] = []

    def begin(*words, **environment):
        started.append(Run([sys.executable, *map(str, words)], **environment))
        return started[-1]

    try:
        yield begin
    finally:
        for run in started:
            run.clear()


CLUSTER = """
import sys

from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, protocol="tcp", host="127.0.0.1",
                      dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.readline()
"""
"""A scheduler and two workers, for as long as nobody writes to it."""


@pytest.fixture
def dask_cluster(start, tmp_path):
    """Start a Dask cluster of two workers over TCP; return its process and the address of its scheduler."""
    pytest.importorskip("distributed")
    script, cache = tmp_path / "cluster.py", tmp_path / "cluster-cache"
    script.write_text(CLUSTER, encoding="utf-8")
    root = str(Path(__file__).parents[3])
    run = start(script, PYTHONPATH=root, OPENBLAS_NUM_THREADS="1", XDG_CACHE_HOME=str(cache))
    return run, run.first_line()
