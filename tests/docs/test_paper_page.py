"""docs/the-paper.md: its commands run, and each number beside a key is the one that report.json has there."""

import json
import re
import shutil
from pathlib import Path

import pytest

from pipeline.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "the-paper.md").read_text(encoding="utf-8")
COMMAND = re.compile(r"^    pipeline (.+)$", flags=re.MULTILINE)
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


@pytest.mark.slow
def test_commands_make_the_numbers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    codes = [main(command.split()) for command in COMMAND.findall(PAGE)]
    assert codes == [1, 0, 0, 0]
    sized_by_hayes, _, for_the_contact = PAGE.partition("## Sized for the true contact")
    rows = 0
    for text, folder in ((sized_by_hayes, "hayes"), (for_the_contact, "paper")):
        report = json.loads((tmp_path / "outputs" / folder / "report.json").read_text(encoding="utf-8"))
        for shown, key in ROW.findall(text):
            rows += 1
            digits = len(shown.partition(".")[2])
            assert valued(report, key) == pytest.approx(float(shown), abs=ONE_STEP * 10.0**-digits), key
    assert rows == 13
    lines = (tmp_path / "figure-9.csv").read_text(encoding="utf-8").splitlines()
    header = lines[0].split(",")
    of_five_percent = dict(zip(header, lines[2].split(","), strict=True))
    assert float(of_five_percent["verdicts.NL.value"]) == pytest.approx(0.05)
    K_l = float(of_five_percent["springs.K_l_N_per_m"])
    K_m = 4629.24
    assert (K_m / 4.0 - K_l) / (K_m / 2.0 + 3.0 * K_l) == pytest.approx(0.05, rel=1e-4)  # the paper's (12)
