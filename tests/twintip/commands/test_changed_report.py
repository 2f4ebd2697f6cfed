"""A report.json that somebody changed is believed by no command that tells or draws its numbers."""

import json
from pathlib import Path

import pytest

from twintip.cli import main

COMMANDS = [
    "explain NL --out out",
    "explain NL --out out --json",
    "view out",
    "view out --html page.html",
    "view out --png pictures",
    "read out --forces 0.1,0.3",
]


@pytest.mark.parametrize("words", COMMANDS)
@pytest.mark.usefixtures("stand_in_run")
def test_changed_report_is_refused_and_nothing_is_written(words, capsys):
    for folder in ("out", "whole"):
        assert main(["run", "--out", folder]) == 0
    path = Path("out/report.json")
    report = json.loads(path.read_bytes())
    report["verdicts"][0]["value"] *= 1.5
    path.write_text(json.dumps(report), encoding="utf-8")
    capsys.readouterr()
    assert main(words.split()) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "digest" in err
    assert sorted(each.name for each in Path().iterdir()) == ["out", "whole"]
