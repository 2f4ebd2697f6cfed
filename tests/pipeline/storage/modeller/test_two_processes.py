"""A run in two processes writes what it writes in one; its own has no kernel, and starts no other for kept solids."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from cad.design.parameters import Design
from pipeline.storage.modeller.modeller import Modeller
from pipeline.study.levels import solved

ROOT = Path(__file__).parents[4]
MOST_SECONDS = 600
OF_THE_KERNEL = ("cadquery", "OCP", "trimesh", "ezdxf", "lib3mf")
WITH_SECONDS = {"report.json", "report.html"}
SCRIPT = """
import os, subprocess, sys
os.sched_getaffinity = lambda _: set(range({cores}))
started, popen = [], subprocess.Popen
class Counted(popen):
    def __init__(self, words, *given, **named):
        started.append("serve(" in str(words))
        super().__init__(words, *given, **named)
subprocess.Popen = Counted
from pathlib import Path
from pipeline import RunOptions, load_design, run
run(load_design("paper"), RunOptions(out=Path({out!r}), tolerance=0.1, fields={fields}))
print(sum(started), *sorted(set({packages!r}) & set(sys.modules)))
"""


def script(place: Path, name: str, *, cores: int, fields: bool = False) -> list[str]:
    """Run a user's script without a guard; return how many processes that model it started, and what it imported."""
    out = str(place / name)
    program = SCRIPT.format(cores=cores, out=out, fields=fields, packages=OF_THE_KERNEL)
    (place / "script.py").write_text(program, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "script.py"],
        cwd=place,
        env={**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(place / f"cache-{cores}")},
        capture_output=True,
        check=True,
        timeout=MOST_SECONDS,
        text=True,
    )
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.slow
def test_two_processes_write_what_one_writes_and_kept_solids_need_one_alone(tmp_path):
    count, *imported = script(tmp_path, "two", cores=2)
    assert (count, imported) == ("1", [])
    count, *imported = script(tmp_path, "one", cores=1)
    assert count == "0"
    assert "cadquery" in imported
    files = {name: {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()} for name in ("one", "two")}
    assert files["one"].keys() == files["two"].keys()
    assert {name for name in files["one"] if files["one"][name] != files["two"][name]} <= WITH_SECONDS
    assert script(tmp_path, "two", cores=2, fields=True) == ["0"]


def test_point_of_a_study_starts_no_process(monkeypatch, tmp_path):
    asked = []

    def run(_design, _options, *, modeller):
        asked.append(type(modeller))
        return SimpleNamespace(passed=True)

    monkeypatch.setattr(solved, "run", run)
    monkeypatch.setattr(solved, "report_mapping", lambda _: {})
    solved.whole_report(Design(), 0.1, tmp_path)
    assert asked == [Modeller]
