"""The keys of a report by their dotted names: the value at each, and none for a name that no report has."""

import dataclasses

import pytest
from stand_ins import result_of

from cad.parts.housing import Pin
from pipeline.report.keys import report_key, report_keys, value_at
from pipeline.report.of_result import report_of_result

PIN = Pin(side=0.3, is_round=False, protruding_length=1.0, pocket_side=0.4, pocket_depth=0.5)


@pytest.fixture(scope="module")
def report():
    return report_of_result(result_of())


def test_value_at_a_name(report):
    """Verdicts are found by names that have dots, parts of lists by their index."""
    verdicts = {verdict.name: verdict for verdict in report.verdicts}
    for name in ("P_max", "printable.low"):
        assert value_at(report, f"verdicts.{name}.value") == verdicts[name].value
    assert value_at(report, "springs.K_l_N_per_m") == report.springs.K_l_N_per_m
    assert value_at(report, "notes") == report.notes
    assert value_at(report, "response.1.P.-1") == report.response[1].P[-1]
    assert value_at(report, "flexures.high.error_percent") == pytest.approx(100.0 * report.flexures["high"].K_error)
    pinned = dataclasses.replace(report, housing=dataclasses.replace(report.housing, pin=PIN))
    assert [value_at(one, "housing.pin_out") for one in (report, pinned)] == [0.0, PIN.protruding_length]
    assert value_at(report, "housing.back_to_back") is False
    assert value_at({"springs": report.springs}, "springs.K_h_N_per_m") == report.springs.K_h_N_per_m


@pytest.mark.parametrize(
    "name", ["verdicts.none.value", "springs.none", "response.99.P", "response.-99.P", "notes.x", "flexures.mid"]
)
def test_name_without_a_value(name, report):
    with pytest.raises(KeyError):
        value_at(report, name)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("verdicts.printable.low.value", None),
        ("springs.K_l_N_per_m", "N/m"),
        ("response.0.F_l_N", "N"),
        ("flexures.low.error_percent", "%"),
        ("contact.compliance_per_mm", "1/mm"),
        ("housing.pin_out", "mm"),
    ],
)
def test_key_of_a_name(name, unit):
    key = report_key(name)
    assert key.name == name
    assert unit is None or key.unit == unit
    assert report_key("springs.none") is None


def test_every_key_names_a_part_of_a_report_and_those_of_both_springs_are_listed_once():
    names = [key.name for key in report_keys() if "KEY" not in key.name and key.name != "verdicts[]"]
    for spring in ("low", "high"):
        assert all(report_key(name.replace("[]", ".0").replace("SPRING", spring)) for name in names)
        assert not any(spring in name.split(".") for name in names)
    assert len(set(names)) == len(names)
