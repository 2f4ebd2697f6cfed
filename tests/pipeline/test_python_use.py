"""The run as a function: nothing is written, printed or switched, and its name stays a function."""

import json
import os
import subprocess
import sys
from inspect import isfunction
from pathlib import Path

import pytest
from deadline import DEADLINE_S

import pipeline

ROOT = Path(__file__).parents[2]


def python(folder, *words, **changes):
    """Run Python on words as a user does who has the project installed, in a folder of his own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **changes}
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=DEADLINE_S,
    )


PROGRAM = """
import json, os, signal, sys, threading
from concurrent.futures import ThreadPoolExecutor

def switches():
    return {
        "environment": dict(os.environ),
        "signals": [str(signal.getsignal(number)) for number in sorted(signal.valid_signals())],
        "folder": os.getcwd(),
        "hooks": [str(hook) for hook in (sys.excepthook, sys.displayhook, threading.excepthook)],
        "threads": threading.active_count(),
    }

before = switches()
from pipeline import load_design, run
with ThreadPoolExecutor(1) as pool:  # where no signal can be caught
    result = pool.submit(run, load_design("paper")).result()
changed = {key: [before[key], value] for key, value in switches().items() if value != before[key]}
verdicts = [[verdict.name, verdict.value, verdict.passed] for verdict in result.verdicts]
open(sys.argv[1], "w").write(json.dumps({"changed": changed, "verdicts": verdicts, "out": result.options.out}))
"""


@pytest.mark.parametrize("cache", ["kept", pytest.param("empty", marks=pytest.mark.study)])
def test_run_without_a_folder_leaves_no_trace(cache, default_run, tmp_path):
    """The same result as that of the command; its files stood in a temporary folder that is gone."""
    for name in ("here", "temporary", "cache"):
        (tmp_path / name).mkdir()
    changes = {"TMPDIR": str(tmp_path / "temporary")}
    if cache == "empty":
        changes["XDG_CACHE_HOME"] = str(tmp_path / "cache")
    done = python(tmp_path / "here", "-c", PROGRAM, str(tmp_path / "seen.json"), **changes)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert [list((tmp_path / name).iterdir()) for name in ("here", "temporary")] == [[], []]
    expected = [[verdict.name, verdict.value, verdict.passed] for verdict in default_run.result.verdicts]
    seen = json.loads((tmp_path / "seen.json").read_text(encoding="utf-8"))
    assert seen == {"changed": {}, "verdicts": expected, "out": None}


@pytest.mark.parametrize(
    "lines",
    ["import pipeline.main_job", "import twintip.cli\nfrom twintip.commands import run as command"],
)
def test_run_is_the_function(lines):
    """A command has the name `run` too; the package's is the function of the main job."""
    names: dict[str, object] = {}
    exec(lines, names)
    exec("from pipeline import run", names)
    assert isfunction(names["run"])
    assert names["run"] is sys.modules["pipeline.main_job"].run
    assert pipeline.run is names["run"]
