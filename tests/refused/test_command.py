"""Command lines that are refused, row by row of command.toml, and that what is not refused reaches its command."""

import importlib
import json
import shlex
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from measured_units import MeasuredDesign
from stand_ins import write_paper
from virtual_compression import VirtualTest

import pipeline
from instrument.compress.force_law import POISSON, hertz_force_law
from twintip.cli import main

GROUPS = tomllib.loads(Path(__file__).with_name("command.toml").read_text(encoding="utf-8"))["group"]
ROWS = [(group, *row) for group in GROUPS for row in group["rows"]]


@pytest.fixture(scope="session")
def paper(tmp_path_factory):
    """Return the output folder of a pair whose contact and springs stand in for solved ones."""
    return write_paper(tmp_path_factory.mktemp("refused"))


@pytest.fixture(scope="session")
def mango():
    """Return the report of mango."""
    return MeasuredDesign("mango", assessed=False).report


@pytest.fixture
def make(request, monkeypatch):
    """Return a function that puts what a row needs in the current folder, by its name."""

    def made(name):
        if name == "paper":
            Path(name).symlink_to(request.getfixturevalue(name))
        elif name == "changed":
            shutil.copytree(request.getfixturevalue("paper"), name)
            report = json.loads(Path(name, "report.json").read_bytes())
            report["verdicts"][0]["value"] *= 1.5
            Path(name, "report.json").write_text(json.dumps(report), encoding="utf-8")
        elif name.endswith(".csv"):
            Path(name).write_text(VirtualTest(E_MPa=2.0, noise_percent=0.2).csv(), encoding="utf-8")
        else:
            report = request.getfixturevalue(name)
            monkeypatch.setattr("twintip.commands.simulate.read_report", lambda _: report)

    return made


@pytest.fixture
def nothing_solves(tmp_path, monkeypatch):
    """Work in an empty folder, and fail where a fruit is solved."""
    monkeypatch.chdir(tmp_path)
    sensor = importlib.import_module("pipeline.sensor")
    monkeypatch.setattr(sensor, "fruit_compliance", lambda *_: pytest.fail("solved"))
    monkeypatch.setattr("instrument.compress.modulus.solve_force_law", law_of_hertz)
    monkeypatch.setattr("pipeline.study.tasks.solve_points", lambda *_: pytest.fail("solved"))


def law_of_hertz(test, *_):
    """Return Hertz's law in the place of a solved one, which needs a minute."""
    law = hertz_force_law(test)
    return replace(law, variants={POISSON: [law]})


def stand(files):
    """Put files and folders in the current folder."""
    for name, text in files.items():
        path = Path(name)
        path.parent.mkdir(exist_ok=True)
        if name.endswith("/"):
            path.mkdir()
        else:
            path.write_text(text, encoding="latin-1")


def files_of(group, named):
    """Return the files of a row: those that it names, or the text of its group with what it replaces."""
    if "text" not in group:
        return named
    text = group["text"]
    for old, new in named.items():
        assert old in text
        text = text.replace(old, new)
    return {"search.toml": text}


def what_stands():
    """Return the names of all that stands in the current folder, with the content of files."""
    paths = sorted(Path().rglob("*"))
    return [(path, path.read_bytes() if path.is_file() else None) for path in paths]


@pytest.mark.usefixtures("nothing_solves")
@pytest.mark.parametrize(
    "row", ROWS, ids=[" ".join([group["command"], words, *dict(*files)]) for group, words, _, *files in ROWS]
)
def test_command_line_is_refused(row, make, monkeypatch, capsys):
    group, words, said, *files = row
    if "needs" in group:
        pytest.importorskip(group["needs"])
        monkeypatch.setattr("pipeline.study.engines._CONNECT_SECONDS", 0.2)  # nobody answers there, however long
    if not group.get("runs", False):
        monkeypatch.setattr(pipeline, "run", lambda *_, **__: pytest.fail("run"))
    for name in group.get("made", ()):
        make(name)
    stand(group.get("stands", {}) | files_of(group, dict(*files)))
    before = what_stands()
    first, *flags = shlex.split(f"{group['command']} {words}")
    assert main([first, *flags]) == 2
    out, err = capsys.readouterr()
    *notes, line = err.splitlines()
    assert out == ""
    begins, _, later = said.partition(" ... ")
    assert line.startswith(f"pipeline: {begins}"), line
    assert later in line, line
    assert notes == [] or group.get("notes", False)
    assert what_stands() == before
