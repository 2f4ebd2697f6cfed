"""`pipeline explain` lists names, explains one, and refuses an unknown one in a line."""

import json

import pytest

from pipeline.cli import main
from pipeline.report.explain.entries import entries


def test_names_are_listed(capsys):
    assert main(["explain"]) == 0
    out = capsys.readouterr().out
    assert [entry.name for entry in entries() if f"{entry.name}: " not in out] == []


def test_one_name_has_meaning_formula_source_and_number(capsys):
    assert main(["explain", "K_m"]) == 0
    out = capsys.readouterr().out
    for words in (
        "K_m: Stiffness of the fruit",
        "formula: K_m = E",
        "source: docs/theory.md",
        "the default design: 4629",
    ):
        assert words in out
    assert main(["explain", "K_m", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "K_m"


def test_unknown_name_is_wrong_input(capsys):
    assert main(["explain", "NLL"]) == 2
    assert capsys.readouterr().err.startswith("pipeline: NAME = 'NLL': must be a verdict or a symbol; did you mean NL?")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--out", "paper"], "--out = 'paper': must be left out without a NAME; "),
        (["foo"], "NAME = 'foo': must be a verdict or a symbol; `pipeline explain` lists them all"),
        ([""], "NAME = '': must be a verdict or a symbol; `pipeline explain` lists them all"),
    ],
)
def test_words_that_would_be_dropped_or_are_near_nothing_are_wrong_input(words, said, capsys):
    assert main(["explain", *words]) == 2
    assert capsys.readouterr().err.startswith(f"pipeline: {said}")
