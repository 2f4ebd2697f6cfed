"""The run as a function: nothing is written, printed or switched, and its name stays a function."""

import json
import sys
from inspect import isfunction

import pytest
from programs import PYTHON, ROOT, ended

import pipeline

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


@pytest.mark.slow
@pytest.mark.parametrize("cache", ["kept", pytest.param("empty", marks=pytest.mark.study)])
def test_run_without_a_folder_leaves_no_trace(cache, default_run, tmp_path):
    """The same result as that of the command; its files stood in a temporary folder that is gone."""
    for name in ("here", "temporary", "cache"):
        (tmp_path / name).mkdir()
    changes = {"TMPDIR": str(tmp_path / "temporary")}
    if cache == "empty":
        changes["XDG_CACHE_HOME"] = str(tmp_path / "cache")
    done = ended(PYTHON, "-c", PROGRAM, tmp_path / "seen.json", cwd=tmp_path / "here", PYTHONPATH=str(ROOT), **changes)
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
    exec(f"{lines}\nfrom pipeline import run", names)
    assert isfunction(names["run"])
    assert names["run"] is pipeline.run is sys.modules["pipeline.main_job"].run
