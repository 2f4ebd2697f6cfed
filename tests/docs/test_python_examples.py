"""The examples of docs/python.md run as they stand, and the result has what the page says of it."""

import re
import shutil
from pathlib import Path

import pytest
from example_files import STIFFNESS, write_example_files
from stand_ins import result_of

import twintip

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
RUNS, CUTS, READS, CALIBRATES, TESTS, FORMULAS = re.findall(r"(?ms)^```python\n(.+?)^```", PAGE)


def run_example(text, **names):
    """Run an example behind those that made its names; return all names."""
    names = {"twintip": twintip, **names}
    exec(compile(text, "docs/python.md", "exec"), names)
    return names


@pytest.mark.slow
@pytest.mark.usefixtures("without_page")
def test_example_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_example(RUNS)
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "passed"
    (NL,) = (float(line.split()[1]) for line in printed if line.startswith("NL "))
    assert pytest.approx(0.06, abs=0.001) == NL
    assert [path.name for path in (tmp_path / "outputs").iterdir()] == ["mine"]
    assert (tmp_path / "outputs" / "mine" / "report.json").is_file()


@pytest.mark.usefixtures("without_page")
def test_quick_examples_run(tmp_path, monkeypatch, capsys):
    """The press is on a fruit of 1.5 MPa; springs as designed are 11 to 19 % softer than those that pressed it."""
    monkeypatch.chdir(tmp_path)
    write_example_files(tmp_path)
    names = {"result": result_of()}
    for text in (CUTS, READS, CALIBRATES):
        names = run_example(text, **names)
    assert names["drilled"].solids().size() == 1
    assert abs(names["reading"].E / 1.5 - 1.0) < names["reading"].u
    assert names["calibration"].unit.K_N_per_m == pytest.approx([1e3 * K for K in STIFFNESS.values()], rel=1e-9)
    assert "twintip_end" in (tmp_path / "sensor.h").read_text(encoding="utf-8")
    run_example(FORMULAS)
    assert float(capsys.readouterr().out.split()[-1]) == pytest.approx(2.0, rel=1e-12)


@pytest.mark.slow
def test_compression_test_is_evaluated(tmp_path, monkeypatch):
    """The file is a virtual test of 0.7 MPa."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    test = run_example(TESTS)["test"]
    assert abs(test.E_MPa / 0.7 - 1.0) < 0.01 * test.u_percent
