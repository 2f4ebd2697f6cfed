"""Every verdict that the program can give is explained, with a source that exists and the number of the report."""

import re
from pathlib import Path

import pytest
from refusal import refusal
from stand_ins import result_of

from pipeline.report.explain.entries import entries, find_entry
from pipeline.report.explain.explained_numbers import explained_value
from pipeline.report.outputs import write_outputs
from pipeline.report.report import read_report
from sensor.words import value_with_bar

ROOT = Path(__file__).parents[4]
NAMED = re.compile(r"\"((?:geometry|printable|sideways|files|report)\.[a-z0-9_]+)\"")
NO_VERDICTS = {"report.json", "report.html", "geometry.tip"}  # files, and the beginning of several names


@pytest.fixture
def folder(tmp_path):
    write_outputs(result_of(), tmp_path)
    return tmp_path


def test_every_verdict_in_the_code_and_in_a_report_has_an_entry(folder):
    sources = [
        path.read_text(encoding="utf-8")
        for room in ("sensor", "cad", "pipeline", "instrument")
        for path in (ROOT / room).rglob("*.py")
    ]
    named = {name for text in sources for name in NAMED.findall(text)} - NO_VERDICTS
    named |= {verdict.name for verdict in read_report(folder).verdicts}
    assert {"P_max", "printable.low", "geometry.tip_face"} <= named
    assert [name for name in named if not find_entry(name).is_verdict] == []


def test_at_most_40_words_are_explained_and_ten_are_enough_for_the_main_job():
    words = [entry for entry in entries() if not entry.is_verdict]
    assert len(words) <= 40
    assert sum(entry.in_main_job for entry in words) == 10


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: entry.name)
def test_source_is_a_page_with_its_heading(entry):
    page, heading = re.match(r"(docs/[\w-]+\.md)(?:#([\w-]+))?", entry.source).groups()
    titles = re.findall(r"^#+ (.+)$", (ROOT / page).read_text(encoding="utf-8"), flags=re.MULTILINE)
    anchors = [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles]
    assert heading is None or heading in anchors
    assert entry.meaning.endswith((".", "?"))


@pytest.mark.parametrize(
    ("word", "near"), [("prntable.low", "printable.low"), ("nl", "NL"), ("safety", "safety_factor")]
)
def test_unknown_name_is_answered_with_the_nearest(word, near):
    caught = refusal(find_entry, word)
    assert (caught.field, caught.value) == ("NAME", word)
    assert f" {near}?" in str(caught)


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("S", "0.766603 ± 0.000077 1/mm, s11"),  # the compliance of the stand-in is 0.766603 with 0.01 %
        ("deflections_mm", "0.50182, 0.10909 mm"),  # a list
        ("contact.compliance_per_mm", "[0.7666, 0.010526], [0.010526, 0.7666] 1/mm"),  # a matrix
        ("tips", "no number in this report"),  # a list of records
        ("noise_for_10_percent", "no number in this report"),
        ("reading.bias", "no verdict in this design"),
    ],
)
def test_symbol_has_the_number_of_the_report(name, number, folder):
    assert explained_value(folder, find_entry(name), name) == number


def test_verdict_has_value_error_limit_and_outcome(folder):
    (verdict,) = (verdict for verdict in read_report(folder).verdicts if verdict.name == "P_max")
    expected = f"P_max {value_with_bar(verdict.value, verdict.error)}, limit 5: passed, {verdict.reference}"
    assert explained_value(folder, find_entry("P_max"), "P_max") == expected
    assert explained_value(folder, find_entry("printable.*"), "printable.*").count("printable.") == 2
