"""A command ends as it should, or in one line, wherever it runs and whenever it is killed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from deadline import DEADLINE_S
from programs import ended
from progress_lines import without_progress

from pipeline.storage.folder import unchanged_report

ROOT = Path(__file__).parents[2]
PROGRAM = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from twintip.__main__ import main; sys.exit(main())"
LIST = "design --list-processes --json"

ODD = {"PYTHONIOENCODING": "ascii", "LC_ALL": "C", "HOME": "", "XDG_CACHE_HOME": "", "COLUMNS": 5000 * "9"}
PLACES = [
    ("no input, no letters, no home, no width", "design --list-processes", ODD, "true", "<&-", 0),
    ("stdout closed", LIST, {}, "true", ">&-", 0),
    ("stderr closed", "check nowhere.step", {}, "true", "2>&-", 2),
    *(("stdout full", words, {}, "true", ">/dev/full", 2) for words in (LIST, "-h", "explain")),
    ("no width", "explain", {"COLUMNS": "-1"}, "true", "", 0),
    ("no date", "run", {"SOURCE_DATE_EPOCH": "tomorrow"}, "true", "", 2),
    ("removed folder", "run", {}, "mkdir gone && cd gone && rmdir ../gone", "", 2),
]


@pytest.mark.parametrize(("words", "variables", "before", "streams", "expected"), [place[1:] for place in PLACES])
def test_command_ends_with_its_code_and_at_most_one_line(words, variables, before, streams, expected, tmp_path):
    line = f'{before}; exec "{sys.executable}" -c "$0" {words} {streams}'
    done = ended("/bin/bash", "-c", line, PROGRAM, cwd=tmp_path, **variables)
    assert done.returncode == expected, done.stderr
    assert done.stderr.count("\n") == (1 if expected == 2 and "2>" not in streams else 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), pytest.param(signal.SIGKILL, -9, marks=pytest.mark.study)]
)
def test_killed_run_leaves_nothing_and_the_next_run_is_whole(number, code, tmp_path):
    command = [sys.executable, "-m", "twintip", "run", "--tol", "0.1", "--out", str(tmp_path / "out")]
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    environment = {**os.environ, **cache}
    first = subprocess.Popen(
        [*command, "--nl", "0.06"], cwd=ROOT, env=environment, stderr=subprocess.PIPE, encoding="utf-8"
    )
    while not (tmp_path / ".out.twintip").exists():
        assert first.poll() is None
        time.sleep(0.05)
    first.send_signal(number)
    _, complaint = first.communicate(timeout=DEADLINE_S)
    assert first.returncode == code
    if number != signal.SIGKILL:
        assert without_progress(complaint) == "pipeline: interrupted\n"
        assert {path.name for path in tmp_path.iterdir()} <= {"cache"}
    assert not (tmp_path / "out").exists()
    assert ended(*command, **cache).returncode == 1  # so coarse a tolerance leaves verdicts undecided
    assert json.loads(unchanged_report(tmp_path / "out"))["design"]["targets"]["NL"] == 0.05
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "out"]
