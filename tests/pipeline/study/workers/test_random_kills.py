"""A study that is killed again and again at random moments ends with the table of one that was left alone."""

import os
import random
import signal
import sqlite3
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from pipeline.study import read_study, run_study
from pipeline.study.export import export_table
from pipeline.study.store import stored_study
from pipeline.study.workers.engine import Engine

pytestmark = pytest.mark.study

SEED = 17
KILLED_RUNS, KILLED_WORKERS = 30, 10
POINTS = 240
TEXT = f"""
base = "paper"
samples = {POINTS}
seed = 5
tol = 0.01
wanted = ["springs.K_l_N_per_m", "contact.K_m_over_E_mm", "verdicts.P_max.value"]
[vary]
"targets.P_max" = {{ from = 3, to = 8 }}
"tips.side_mm" = {{ from = 0.9, to = 1.1 }}
"""


def test_killed_at_forty_random_moments_it_ends_with_the_same_table(
    start: Callable[..., Any], written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    path, folder, whole = written(TEXT), tmp_path / "killed", tmp_path / "whole"
    words = "-m", "pipeline", "study", path, "--out", folder, "--processes", "2"
    draw = random.Random(SEED)
    runs = workers = 0

    def wait_for_a_moment(run: Any) -> None:
        """Wait until some more points are stored, none for a moment of the start, and a random time after that."""
        more, before = draw.randrange(5), stored(folder)
        run.wait_for(lambda: stored(folder) >= before + more)
        time.sleep(draw.uniform(0.0, 0.3 if more else 3.0))

    while runs < KILLED_RUNS:
        run = start(*words)
        wait_for_a_moment(run)
        assert run.process.poll() is None, "the study ended by itself"
        runs += 1
        left = run.workers()
        run.process.kill()
        run.ended()
        run.wait_for_end_of(left)
    run = start(*words)
    while workers < KILLED_WORKERS:
        wait_for_a_moment(run)
        run.wait_for(run.workers)
        assert run.process.poll() is None, "the study ended by itself"
        with suppress(ProcessLookupError):
            os.kill(draw.choice(run.workers()), signal.SIGKILL)
            workers += 1
    code, _, complaint = run.ended()
    assert (code, complaint) == (0, "")
    assert run_study(read_study(path), whole, engine).done == POINTS
    assert table(path, folder) == table(path, whole)


def stored(folder: Path) -> int:
    """Return how many points a study holds; 0 before its tables are made."""
    if not (folder / "study.sqlite").is_file():
        return 0
    with stored_study(folder) as store:
        try:
            return sum(store.counts().values())
        except sqlite3.OperationalError:
            return 0


def table(study_path: Path, folder: Path) -> bytes:
    target = folder.parent / f"{folder.name}.csv"
    with stored_study(folder) as store:
        export_table(store, read_study(study_path), target)
    return target.read_bytes()
