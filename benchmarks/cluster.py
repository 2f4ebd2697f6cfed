"""The scheduler and the store of a study under the load of a thousand workers, simulated on this machine.

`python -m benchmarks.cluster [--workers 10 100 1000] [--seconds 10] [--points 2000]` prints a row for each number of
workers. `run_study` solves the study on a Dask scheduler; everything but its points is real. Each worker is a Dask
worker of one thread, some hundred of them in a process. A point sleeps for 0.7 to 1.5 times `--seconds`, and returns
stored numbers.
"""

import argparse
import asyncio
import json
import logging
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import patch

import psutil

from benchmarks.harness import ROOT
from benchmarks.usage import ONE_THREAD
from pipeline.study import execute
from pipeline.study.points import Point
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study, read_study
from pipeline.study.tasks import PointResult
from pipeline.study.workers import cluster_engine

WORKERS_A_PROCESS = 250
START_S = 300.0  # until the scheduler must have an address
SHORTEST, LONGEST = 0.7, 1.5  # of the seconds of a point
_GOLDEN = 0.6180339887498949  # multiples of it modulo 1 spread evenly: durations without a generator
STUDY = """
base = "paper"
samples = {points}
seed = 7
wanted = ["springs.K_l_N_per_m", "springs.K_h_N_per_m", "verdicts.P_max.value", "verdicts.NL.value", "passed"]
[vary]
"targets.P_max" = {{ from = 3, to = 8 }}
"tips.side_mm" = {{ from = 0.8, to = 1.6 }}
"""
VALUES = (118.31415926535, 2044.2718281828, 4.9876543210987, 0.0499871234567, True)
"""What each point returns for what is wanted."""


@dataclass(frozen=True)
class StoredPoints:
    """Returns stored results of points after a sleep, where a worker would solve them for so many seconds each."""

    seconds: float

    def __call__(self, study: Study, _: Path | None, points: Sequence[Point]) -> tuple[PointResult, ...]:
        """Return the results, as `solve_points` does."""
        results = []
        for point in points:
            fraction = point.number * _GOLDEN % 1.0
            time.sleep(self.seconds * (SHORTEST + (LONGEST - SHORTEST) * fraction))
            values = dict(zip(study.wanted, VALUES, strict=True))
            results.append(PointResult(**vars(point), status="done", values=values, seconds=self.seconds))
        return tuple(results)


@dataclass(frozen=True, kw_only=True)
class Load:
    """What so many workers made of a study: points a second, and CPU milliseconds a point of each part.

    `store_wall` [ms] is the time that a point's commit takes, `memory` [MiB] that of scheduler and client at the end.
    """

    workers: int
    points: int
    rate: float
    scheduler: float
    client: float
    store: float
    store_wall: float
    memory: tuple[float, float]

    @property
    def row(self) -> str:
        """Return one row of the table."""
        cells = (
            f"{self.workers}",
            f"{self.points}",
            f"{self.rate:.0f}",
            f"{self.scheduler:.2f}",
            f"{self.client:.2f}",
            f"{self.store:.2f}",
            f"{self.store_wall:.2f}",
            f"{self.memory[0]:.0f}",
            f"{self.memory[1]:.0f}",
        )
        return f"| {' | '.join(cells)} |"


HEADER = """\
| workers | points | points/s | scheduler, CPU ms a point | client | of it the store | commit, wall ms \
| scheduler, MiB | client, MiB |
|---|---|---|---|---|---|---|---|---|"""


@dataclass
class _Watch:
    """Notes when points are stored, and what the store takes."""

    times: list[float] = field(default_factory=list)
    cpu: float = 0.0
    wall: float = 0.0

    def put(self, store: StudyStore, results: Iterable[PointResult]) -> None:
        """Put results into a store."""
        cpu = time.thread_time()
        wall = time.perf_counter()
        _PUT(store, results)
        self.cpu += time.thread_time() - cpu
        self.wall += time.perf_counter() - wall

    def progress(self, _solved: int, _count: int) -> None:
        """Note that a point is stored."""
        self.times.append(time.perf_counter())


_PUT = StudyStore.put


def measured_load(workers: int, seconds: float, points: int) -> Load:
    """Return how a study of so many points does on so many workers, each point of so many seconds."""
    with tempfile.TemporaryDirectory() as name, _cluster(workers, Path(name)) as (address, scheduler):
        path = Path(name) / "cluster.toml"
        path.write_text(STUDY.format(points=points), encoding="utf-8")
        study = read_study(path)
        watch = _Watch()
        put = patch.object(StudyStore, "put", lambda store, results: watch.put(store, results))
        # one point a task, as those that are run whole
        size = patch.object(execute, "_task_size", lambda _: 1)
        solve = patch.object(execute, "solve_points", StoredPoints(seconds))
        with cluster_engine(address) as engine, put, size, solve:
            if engine.workers != workers:
                msg = f"{engine.workers} of {workers} workers came"
                raise RuntimeError(msg)
            before = sum(scheduler.cpu_times()[:2])
            client_before = time.process_time()
            execute.run_study(study, Path(name) / "out", engine, watch.progress)
            client = time.process_time() - client_before
            used = sum(scheduler.cpu_times()[:2]) - before
            memory = (scheduler.memory_info().rss / 2**20, psutil.Process().memory_info().rss / 2**20)
    return Load(
        workers=workers,
        points=points,
        rate=_sustained(watch.times),
        scheduler=1e3 * used / points,
        client=1e3 * client / points,
        store=1e3 * watch.cpu / points,
        store_wall=1e3 * watch.wall / points,
        memory=memory,
    )


def _sustained(times: Sequence[float]) -> float:
    """Return the points a second between the first and the last quarter of the times at which they were stored [s]."""
    first = len(times) // 4
    last = 3 * len(times) // 4
    return (last - first) / (times[last] - times[first])


@contextmanager
def _cluster(workers: int, folder: Path) -> Iterator[tuple[str, psutil.Process]]:
    """Give the address and the process of a scheduler with so many workers."""
    patience = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "300s"}  # two cores start what a thousand would
    environment = {**os.environ, **ONE_THREAD, **patience, "DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "error"}
    started = []

    def start(*words: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, *words],
            cwd=ROOT,
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            stdin=subprocess.PIPE,
        )
        started.append(process)
        return process

    try:
        file = folder / "scheduler.json"
        words = ("-m", "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard", "--host", "127.0.0.1")
        scheduler = start(*words, "--scheduler-file", str(file))
        deadline = time.monotonic() + START_S
        while not file.is_file():
            if time.monotonic() > deadline:
                raise TimeoutError
            time.sleep(0.1)
        address = str(json.loads(file.read_text(encoding="utf-8"))["address"])
        for first in range(0, workers, WORKERS_A_PROCESS):
            count = min(WORKERS_A_PROCESS, workers - first)
            start("-m", "benchmarks.cluster", "--serve", address, str(count), str(first))
        for process in started[1:]:
            assert process.stdout is not None
            process.stdout.readline()  # once all of its workers have registered
        yield address, psutil.Process(scheduler.pid)
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
            for stream in (process.stdout, process.stdin):
                assert stream is not None
                stream.close()


async def _serve(address: str, count: int, first: int) -> None:
    """Be so many workers of one thread each, for ever."""
    from distributed import Worker

    with tempfile.TemporaryDirectory() as name:
        workers = []
        for number in range(first, first + count):
            workers.append(
                Worker(
                    address,
                    nthreads=1,
                    name=number,
                    memory_limit=0,
                    dashboard=False,
                    local_directory=name,
                    host="127.0.0.1",
                )
            )
        for begin in range(0, count, 25):
            await asyncio.gather(*workers[begin : begin + 25])
        print("ready", flush=True)
        await asyncio.Event().wait()


def main() -> None:
    """Measure each number of workers and print the table."""
    parser = argparse.ArgumentParser(description="The scheduler and the store under simulated workers.")
    parser.add_argument("--workers", type=int, nargs="+", default=[10, 100, 1000])
    parser.add_argument("--seconds", type=float, default=10.0, help="of a point, 0 to return at once")
    parser.add_argument("--points", type=int, default=2000)
    parser.add_argument("--serve", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        address, count, first = asked.serve
        asyncio.run(_serve(address, int(count), int(first)))
        return
    print(HEADER)
    for workers in asked.workers:
        print(measured_load(workers, asked.seconds, asked.points).row, flush=True)


if __name__ == "__main__":
    from benchmarks.cluster import main as imported  # workers find its functions by this name, not in __main__

    imported()
