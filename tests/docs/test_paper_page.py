"""The paper in docs/presets.md: its commands run, and numbers beside a key are those that report.json has there.

Every equation, table and figure of the paper is named in the section.
"""

import json
import re
import shutil
from pathlib import Path

import pytest

from twintip.cli import main

ROOT = Path(__file__).parents[2]
PRESETS = (ROOT / "docs" / "presets.md").read_text(encoding="utf-8")
SECTION = PRESETS.partition("\n## The paper, line by line\n")[2].partition("\n## ")[0]
COMMAND = re.compile(r"(?:^    |`)pipeline (\w+ [^`\n]+)", flags=re.MULTILINE)
ROW = re.compile(r"^\|[^|]+\|[^|]+\| ([\d.]+) \| `([\w.]+)` \|$", flags=re.MULTILINE)
ONE_STEP = 0.51  # of the last digit that is shown


def valued(report, key):
    """Return the number that a dotted key has in a report; a verdict goes by its name."""
    for word in key.split("."):
        if isinstance(report, list):
            by_name = {row.get("name"): row for row in report if isinstance(row, dict)}
            report = by_name[word] if word in by_name else report[int(word)]
        else:
            assert isinstance(report, dict)
            report = report[word]
    assert isinstance(report, int | float)
    return float(report)


def numbers_of(left, right):
    """Return the numbers that the section names between two texts, singly or from one to another."""
    numbers = set()
    span = rf"{left}(\d+){right}(?: to {left}(\d+){right})?"
    for first, last in re.findall(span, SECTION):
        numbers |= set(range(int(first), int(last or first) + 1))
    return numbers


def test_every_equation_table_and_figure_of_the_paper_is_in_the_section():
    assert numbers_of(r"\(", r"\)") == set(range(1, 13))
    assert numbers_of(r"Fig\. ", "") == set(range(1, 12))
    assert "Table I" in SECTION


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
        report = json.loads((examples / "outputs" / folder / "report.json").read_text(encoding="utf-8"))
        for shown, key in ROW.findall(text):
            rows += 1
            digits = len(shown.partition(".")[2])
            assert valued(report, key) == pytest.approx(float(shown), abs=ONE_STEP * 10.0**-digits), key
    assert rows == 17


@pytest.mark.study
def test_study_makes_figure_9(examples):
    codes = exit_codes()
    assert [command for command, code in codes.items() if code != 0] == [next(iter(codes))]
    lines = (examples / "figure-9.csv").read_text(encoding="utf-8").splitlines()
    header = lines[0].split(",")
    of_five_percent = dict(zip(header, lines[2].split(","), strict=True))
    assert float(of_five_percent["verdicts.NL.value"]) == pytest.approx(0.05)
    K_l = float(of_five_percent["springs.K_l_N_per_m"])
    K_m = 4629.24
    assert (K_m / 4.0 - K_l) / (K_m / 2.0 + 3.0 * K_l) == pytest.approx(0.05, rel=1e-4)  # the paper's (12)
