"""The same bytes with one thread and with two: threads change the order of sums, not what is written."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from deadline import DEADLINE_S
from progress_lines import without_progress

ROOT = Path(__file__).parents[2]
WITH_SECONDS = ("report.json", "report.html")


def run(folder, threads):
    """Return the files of a run but STEP and 3MF, whose writers number what they write; with a cache of its own."""
    variables = {"XDG_CACHE_HOME": str(folder / "cache")}
    variables |= {f"{library}_NUM_THREADS": str(threads) for library in ("OMP", "OPENBLAS", "MKL")}
    words = ["run", "--tol", "0.1", "--fields", "--out", str(folder / "out")]
    done = subprocess.run(
        [sys.executable, "-m", "twintip", *words],
        cwd=ROOT,
        env={**os.environ, **variables},
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=DEADLINE_S,
    )
    assert without_progress(done.stderr) == ""
    paths = sorted((folder / "out").iterdir())
    return {path.name: path.read_bytes() for path in paths if path.suffix != ".step"}


@pytest.mark.study
def test_files_do_not_depend_on_the_number_of_threads(tmp_path):
    one, two = (run(tmp_path / str(threads), threads) for threads in (1, 2))
    assert {name for name in one if one[name] != two.get(name)} <= set(WITH_SECONDS)
    assert one.keys() == two.keys()
    outcomes = [
        [(verdict["name"], verdict["passed"]) for verdict in json.loads(files["report.json"])["verdicts"]]
        for files in (one, two)
    ]
    assert outcomes[0] == outcomes[1]
