"""The same bytes with one thread and with two: threads change the order of sums, not what is written."""

import json

import pytest
from programs import PYTHON, ended
from progress_lines import without_progress

WITH_SECONDS = ("report.json", "report.html")


def run(folder, threads):
    """Return the files of a run but STEP and 3MF, whose writers number what they write; with a cache of its own."""
    variables = {"XDG_CACHE_HOME": str(folder / "cache")}
    variables |= {f"{library}_NUM_THREADS": str(threads) for library in ("OMP", "OPENBLAS", "MKL")}
    words = ["run", "--tol", "0.1", "--fields", "--out", str(folder / "out")]
    done = ended(PYTHON, "-m", "twintip", *words, **variables)
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
