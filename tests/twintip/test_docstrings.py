"""The docstring of each public name has an example that runs, and that of a function names its parameters."""

import doctest
import inspect
import re
import shutil
from pathlib import Path

import pytest
from stand_ins import result_of

import twintip
from pipeline import main_job
from pipeline.report.outputs import write_outputs
from sensor.quantity import STANDARD_GRAVITY

ROOT = Path(__file__).parents[2]
FUNCTIONS = [name for name in twintip.__all__ if inspect.isfunction(getattr(twintip, name))]
SLOW = {"modulus", "CompressionResult"}  # a fruit is solved
SLOW |= {"process_engine", "run_study", "StudySummary"}  # processes are started
STUDY = """
base = "paper"
how = "grid"
wanted = ["springs.K_l_N_per_m"]
[vary]
"targets.P_max" = [4, 5, 6, 7]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Work in a folder with the files that examples name: a run of a pair, a press, weights, a test and a study."""
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "outputs" / "mine"
    out.mkdir(parents=True)
    write_outputs(result_of(), out)
    page = (ROOT / "docs" / "read-a-fruit.md").read_text(encoding="utf-8")
    table = re.search(r"^    t_s,x_mm,F_l_N,F_h_N\n(?:    .+\n)+", page, flags=re.MULTILINE)
    assert table is not None
    (tmp_path / "press.csv").write_text(re.sub(r"^    ", "", table[0], flags=re.MULTILINE), encoding="utf-8")
    rows = ["tip,weight_g,deflection_mm"]
    for tip, K in (("low", 1.0), ("high", 22.0)):
        rows += [f"{tip},{grams},{1e-3 * STANDARD_GRAVITY * grams / K}" for grams in (0, 20, 50, 100)]
    (tmp_path / "weights.csv").write_text("\n".join(rows), encoding="utf-8")
    (tmp_path / "springs.toml").write_text(STUDY, encoding="utf-8")
    shutil.copy(ROOT / "docs" / "examples" / "fruit-1.csv", tmp_path)


def complaints(name):
    """Return what differs from the docstring where the examples of a name are run, and how many there are."""
    example = doctest.DocTestParser().get_doctest(
        inspect.getdoc(getattr(twintip, name)) or "", {"twintip": twintip, "Path": Path}, name, None, None
    )
    told = []
    doctest.DocTestRunner(verbose=False).run(example, out=told.append)
    return told, len(example.examples)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_docstring_names_every_parameter(name):
    function = getattr(twintip, name)
    _, _, section = (inspect.getdoc(function) or "").partition("Parameters\n----------\n")
    named = re.findall(r"^(\w+) : ", section.partition("\n\nExamples\n")[0], flags=re.MULTILINE)
    assert named == list(inspect.signature(function).parameters)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in twintip.__all__]
)
@pytest.mark.usefixtures("folder", "without_page")
def test_example_of_a_docstring_runs(name, monkeypatch):
    """On stand-ins of a solved sensor: what is solved is tested elsewhere."""
    monkeypatch.setattr(main_job, "evaluated", lambda _: result_of())
    told, count = complaints(name)
    assert count
    assert told == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run", "evaluate", "assembly"])
@pytest.mark.usefixtures("folder")
def test_example_of_a_docstring_runs_where_all_is_solved(name):
    assert complaints(name)[0] == []


def test_wrong_number_in_an_example_is_told(monkeypatch):
    text = twintip.force_ratio.__doc__
    monkeypatch.setattr(twintip.force_ratio, "__doc__", text.replace("2.927", "2.928"))
    assert complaints("force_ratio")[0] != []
