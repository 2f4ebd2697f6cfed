"""Readings in a report: a verdict, a row or a limit that somebody changed no longer agrees with the rest."""

import copy

import pytest
from square_stand_ins import square_design

from cad.verdict import Verdict
from pipeline.report.check.agreement_of_readings import other_readings

DESIGN = square_design(bias_limit=0.05, uncertainty_limit=0.1, tilt_deg=4.0)
ROWS = [
    {"E_bias_percent": -2.0, "uncertainty_percent": 5.0, "sources": {"noise_percent": 3.0, "gain_percent": 4.0}},
    {"E_bias_percent": 1.0, "uncertainty_percent": 13.0, "sources": {"noise_percent": 5.0, "gain_percent": 12.0}},
]
PRESSURES = [{"pressure_MPa": pressure} for pressure in (0.1, 0.9, 0.2, 0.3)]
REPORT = {"reading": {"moduli": ROWS, "lift_deg": 6.0, "skin_pressure": PRESSURES}}


def verdict(name, value, limit):
    return Verdict(name=name, value=value, unit="1", limit=limit, tolerance=0.0, passed=True, reference="")


VERDICTS = (
    verdict("reading.bias", 0.02, 0.05),
    verdict("reading.uncertainty", 0.13, 0.1),
    verdict("reading.lift", 6.0, 4.0),
    verdict("bruise", 0.9, 1.0),
)


def test_report_that_agrees():
    assert list(other_readings(REPORT, DESIGN, VERDICTS)) == []


@pytest.mark.parametrize(
    ("path", "value", "found"),
    [
        (("moduli", 0, "E_bias_percent"), -3.0, "reading.bias"),
        (("moduli", 1, "sources", "gain_percent"), 1.0, "reading.moduli[1].uncertainty_percent"),
        (("moduli", 0, "uncertainty_percent"), 1.0, "reading.moduli[0].uncertainty_percent"),
        (("lift_deg",), 9.0, "reading.lift"),
        (("skin_pressure", 1, "pressure_MPa"), 0.1, "bruise"),
    ],
)
def test_changed_row_is_found(path, value, found):
    changed = copy.deepcopy(REPORT)
    place = changed["reading"]
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert found in list(other_readings(changed, DESIGN, VERDICTS))


@pytest.mark.parametrize("place", range(4))
def test_changed_limit_and_missing_verdict_are_found(place):
    name = VERDICTS[place].name
    wider = [verdict(one.name, one.value, one.limit + (one.name == name)) for one in VERDICTS]
    assert list(other_readings(REPORT, DESIGN, wider)) == [name]
    assert list(other_readings(REPORT, DESIGN, [one for one in VERDICTS if one.name != name])) == [name]
