"""No number and no name is cut, however narrow the terminal; limits carry their sign in the letters that it has."""

import dataclasses
import io
import re

import pytest
from stand_ins import GOOD, print_everything, print_summary, result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.verdict import Verdict
from pipeline.report.verdict_table import print_verdicts
from pipeline.verdicts.hints import with_hints

BRUISED = Design(fruit=Fruit(bruise_limit_MPa=0.29))


@pytest.fixture(scope="module")
def failing():
    result = result_of(BRUISED)
    verdicts = with_hints(result.verdicts, result.design, result.springs, result.options)
    return dataclasses.replace(result, verdicts=verdicts)


def words(text):
    """Return the words of a text without what draws tables and the marks between words."""
    return [word for word in re.sub(r"[^\w.%+-]+", " ", text).replace("- ", " ").split() if word.strip("-+.")]


@pytest.mark.parametrize("columns", [40, 60, 80, 132])
@pytest.mark.parametrize("show", [print_summary, print_everything])
def test_no_name_and_no_number_is_cut(columns, show, failing, monkeypatch, capsys):
    """In a pipe with COLUMNS set: every line fits, no ellipsis, every verdict whole with its value."""
    monkeypatch.setenv("COLUMNS", str(columns))
    show(failing)
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= columns
    assert "…" not in out
    told = words(out)
    for verdict in failing.verdicts:
        if show is print_everything or verdict.name in ("P_max", "NL", "K_l", "K_h", "bruise"):
            assert verdict.name in told
            assert verdict.value is None or f"{verdict.value:.5g}" in told


def test_limit_has_its_sign(failing, monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    print_summary(failing)
    rows = {line.split("│")[1].strip(): line for line in capsys.readouterr().out.splitlines() if "│" in line}
    assert "≤ 0.29" in rows["bruise"]
    assert "│ 5 " in rows["P_max"]


@pytest.mark.parametrize(("passed", "value", "said"), [(False, 0.02, True), (False, 0.06, False), (True, 0.02, False)])
def test_table_says_why_a_reading_fails_whose_value_keeps_the_limit(passed, value, said, monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    given = {"unit": "1", "limit": 0.05, "tolerance": 0.0, "reference": "3 of 68 poses have no reading"}
    print_verdicts("", [Verdict(name="reading.bias", value=value, passed=passed, **given)])
    row = next(line for line in capsys.readouterr().out.splitlines() if "≤ 0.05" in line)
    assert ("failed: some poses have no reading" in row) is said


def test_output_in_ascii_has_words_for_signs(failing, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr("sys.stdout", stream)
    print_summary(failing)
    stream.flush()
    text = stream.buffer.getvalue().decode("ascii")
    assert "at most 0.29" in text
    assert "+- error" in text


def test_remedy_ends_the_line_and_is_told_once(capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    wrong = dataclasses.replace(GOOD, name="P_max", passed=False, reference="why", remedy="passes with [x]")
    print_verdicts("", [wrong, dataclasses.replace(wrong, name="NL")])
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2:] == ["failed P_max: why; remedy: passes with [x]", "failed NL: why; remedy: as for P_max"]
