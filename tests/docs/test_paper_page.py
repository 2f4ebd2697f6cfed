"""The paper in docs/presets.md: its commands run, and numbers beside a key are those that report.json has there.

Every equation, table and figure of the paper is named in the section.
"""

import json
import re
import shutil
from pathlib import Path

import pytest

from pipeline.report.keys import value_at
from pipeline.report.report import read_report
from twintip.cli import main

ROOT = Path(__file__).parents[2]
PRESETS = (ROOT / "docs" / "presets.md").read_text(encoding="utf-8")
SECTION = PRESETS.partition("\n## The paper, line by line\n")[2].partition("\n## ")[0]
COMMAND = re.compile(r"(?:^    |`)pipeline (\w+ [^`\n]+)", flags=re.MULTILINE)
ROW = re.compile(r"^\|[^|]+\|[^|]+\| ([\d.]+) \| `([\w.]+)` \|$", flags=re.MULTILINE)
ONE_STEP = 0.51  # of the last digit that is shown


@pytest.fixture
def examples(tmp_path, monkeypatch):
    """Return an empty current folder with the examples of the documents."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    return tmp_path


def exit_codes(*names):
    """Run the commands of the section, or those of some names; return their exit codes."""
    shown = [command for command in COMMAND.findall(SECTION) if not names or command.startswith(names)]
    return {command: main(command.split()) for command in shown}


@pytest.mark.slow
def test_runs_make_the_numbers(examples, capsys):
    codes = exit_codes("run", "read")
    assert [command for command, code in codes.items() if code != 0] == [next(iter(codes))]
    readings = [command for command in codes if command.startswith("read")]
    assert readings
    for command in readings:
        capsys.readouterr()
        main([*command.split(), "--json"])
        assert json.loads(capsys.readouterr().out)["E_MPa"] == pytest.approx(3.0, rel=1e-4)
    sized_by_hayes, _, for_the_contact = SECTION.partition("### Sized for the true contact")
    rows = 0
    for text, folder in ((sized_by_hayes, "hayes"), (for_the_contact, "paper")):
        report = read_report(examples / "outputs" / folder)
        for shown, key in ROW.findall(text):
            rows += 1
            digits = len(shown.partition(".")[2])
            assert value_at(report, key) == pytest.approx(float(shown), abs=ONE_STEP * 10.0**-digits), key
    assert rows == 17
