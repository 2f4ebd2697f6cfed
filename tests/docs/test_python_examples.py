"""The examples of docs/python.md run as they stand, and the result has what the page says of it."""

import math
import re
import shutil
from pathlib import Path

import pytest
from example_files import STIFFNESS, write_example_files
from stand_ins import result_of

import twintip
from docs.docstrings import docstring

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
    result = run_example(RUNS)["result"]
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "passed"
    (NL,) = (float(line.split()[1]) for line in printed if line.startswith("NL "))
    assert pytest.approx(0.06, abs=0.001) == NL
    attributes = docstring("SensorResult").sections["Attributes"]
    assert len(attributes) > 5
    assert [each.name for each in attributes if not hasattr(result, each.name)] == []
    assert [path.name for path in (tmp_path / "outputs").iterdir()] == ["mine"]
    assert (tmp_path / "outputs" / "mine" / "report.json").is_file()


def test_cut_takes_its_volume_from_the_housing():
    """The hole of 2 mm goes through the frame alone, which is as deep as the leaves."""
    result = result_of()
    housing = twintip.housing(result)
    drilled = run_example(CUTS, result=result)["drilled"]
    assert drilled.solids().size() == 1
    lost = housing.val().Volume() - drilled.val().Volume()
    # The kernel integrates a part with round faces to 1e-6 of its volume or better.
    assert lost == pytest.approx(math.pi * result.springs.housing.depth, abs=1e-6 * housing.val().Volume())


@pytest.mark.usefixtures("without_page")
def test_press_is_read(tmp_path, monkeypatch, capsys):
    """The press is on a fruit of 1.5 MPa; springs as designed are 11 to 19 % softer than those that pressed it."""
    monkeypatch.chdir(tmp_path)
    write_example_files(tmp_path)
    names = run_example(READS)
    reading = names["reading"]
    assert abs(reading.E / 1.5 - 1.0) < reading.u
    assert capsys.readouterr().out.split()[0] == str(reading.E)
    made = run_example(CALIBRATES, **names)
    assert made["calibration"].unit.K_N_per_m == pytest.approx([1e3 * K for K in STIFFNESS.values()], rel=1e-9)
    assert [reading.flags for reading in made["readings"]] == [()]
    assert "twintip_end" in (tmp_path / "sensor.h").read_text(encoding="utf-8")


@pytest.mark.slow
def test_compression_test_is_evaluated(tmp_path, monkeypatch):
    """The file is a virtual test of 0.7 MPa."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    test = run_example(TESTS)["test"]
    assert abs(test.E_MPa / 0.7 - 1.0) < 0.01 * test.u_percent


def test_formulas_run(capsys):
    run_example(FORMULAS)
    assert float(capsys.readouterr().out.split()[-1]) == pytest.approx(2.0, rel=1e-12)
