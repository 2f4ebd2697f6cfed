"""The number of a verdict or a symbol is that of the report, with its error bar."""

import json

import pytest
from stand_ins import result_of

from cad.quantity import InputError
from pipeline.report.explain.entries import entry_of
from pipeline.report.explain.number import number_in
from pipeline.report.outputs import write_outputs


@pytest.fixture
def folder(tmp_path):
    write_outputs(result_of(), tmp_path)
    return tmp_path


def report_of(folder):
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


def test_verdict_has_value_error_limit_and_outcome(folder):
    (verdict,) = (one for one in report_of(folder)["verdicts"] if one["name"] == "P_max")
    expected = f"P_max {verdict['value']:.5g} +- {verdict['error']:.2g}, limit 5: passed"
    assert number_in(folder, entry_of("P_max"), "P_max") == expected


def test_both_springs_are_told_by_one_name(folder):
    text = number_in(folder, entry_of("printable.*"), "printable.*")
    assert text.count("printable.") == 2
    assert number_in(folder, entry_of("printable.low"), "printable.low").count("printable.") == 1


def test_symbol_has_its_error_from_its_per_cent(folder):
    """The compliance of the stand-in is 0.766603 with 0.01 %."""
    assert number_in(folder, entry_of("S"), "S") == "0.7666 +- 7.7e-05 1/mm, s11"


def test_name_that_a_design_has_not_says_so(folder):
    assert number_in(folder, entry_of("reading.bias"), "reading.bias") == "not judged in this design"
    assert number_in(folder, entry_of("noise_for_10_percent"), "noise_for_10_percent") == "no number in this report"


def test_folder_without_a_report_is_one_line(tmp_path):
    with pytest.raises(InputError, match=r"must hold a report\.json"):
        number_in(tmp_path, entry_of("NL"), "NL")
