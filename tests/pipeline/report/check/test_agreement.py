"""A report that somebody changed disagrees with itself, whether its digest was made to fit again or not."""

import copy
import json
import random

import pytest
from stand_ins import result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design, GivenSprings, Print, Targets
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from pipeline.report.check.agreement import report_verdicts
from pipeline.report.mapping import report_mapping
from pipeline.report.stored import report_of
from pipeline.report.verdict_rule import outcome_of
from pipeline.storage.seal import sealed_mapping

SEED = 20190701
DESIGNS = {
    "paper": Design(),
    "largest nonlinearity": Design(targets=Targets(P_max=4.0, NL=0.08, NL_definition="largest")),
    "given springs": Design(springs=GivenSprings(K_l_N_per_m=880.0, K_h_N_per_m=20100.0)),
    "off the middle": Design(tips=Tips(offset_mm=3.0)),
    "gauges": Design(print=Print(gauges="foil")),
    "bruise limit": Design(fruit=Fruit(bruise_limit_MPa=0.01)),
    "tilted": Design(press=Press(tilt_deg=0.5)),
    "sphere": Design(fruit=Fruit(shape="sphere", radius_mm=35.0), tips=Tips(spacing_mm=6.0)),
}
NOT_LEVEL = ("tilted", "sphere")
"""Their forces are solved anew in every result."""


def plain(result) -> dict:
    return json.loads(json.dumps(report_mapping(result)))


def disagreeing(report, tmp_path) -> dict[str, str]:
    """Return the reference of every verdict on a report that did not pass, by its name."""
    stored = report_of(tmp_path, report)
    verdicts = report_verdicts(report, stored.design, stored.housing)
    return {verdict.name: verdict.reference for verdict in verdicts if verdict.passed is not True}


@pytest.fixture(scope="module")
def report():
    return plain(result_of())


@pytest.mark.parametrize(
    ("name", "made"),
    [
        *((name, True) for name in DESIGNS),
        *(pytest.param(name, False, marks=pytest.mark.slow if name in NOT_LEVEL else ()) for name in DESIGNS),
    ],
)
def test_report_of_a_run_agrees_with_itself(name, made, tmp_path):
    assert disagreeing(plain(result_of(DESIGNS[name], made=made)), tmp_path) == {}


def scaled(*path, by):
    def change(report):
        holder = report
        for key in path[:-1]:
            holder = holder[key]
        holder[path[-1]] = json.loads(json.dumps(holder[path[-1]]), parse_float=lambda text: float(text) * by)

    return change


def of_verdict(name, **changes):
    def change(report):
        next(verdict for verdict in report["verdicts"] if verdict["name"] == name).update(changes)

    return change


def without_verdict(name):
    def change(report):
        report["verdicts"] = [verdict for verdict in report["verdicts"] if verdict["name"] != name]

    return change


def together(*changes):
    def change(report):
        for one in changes:
            one(report)

    return change


NAMES = ("P_max", "NL", "K_l", "K_h", "P_displacement_independent", "P_monotonic", "printable.low", "printable.high")
TAMPERED = {
    **{f"{name} flipped": of_verdict(name, passed=False) for name in (*NAMES, "geometry.valid")},
    **{f"{name} left out": without_verdict(name) for name in NAMES},
    **{
        f"{name} undecided": of_verdict(name, passed=None)
        for name in ("P_displacement_independent", "P_monotonic", "geometry.valid")
    },
    **{f"value of {name}": of_verdict(name, value=1.02) for name in ("P_max", "NL", "K_l", "K_h")},
    **{f"error of {name}": of_verdict(name, error=1e-9) for name in ("P_max", "NL", "K_l", "K_h")},
    **{f"tolerance of {name}": of_verdict(name, tolerance=0.5) for name in ("P_max", "NL", "K_l", "K_h")},
    "target of P_max": of_verdict("P_max", limit=5.1),
    "a stiffness doubled": scaled("flexures", "low", "stiffness_N_per_m", by=2.0),
    "a stiffness and its verdict doubled": together(
        scaled("flexures", "low", "stiffness_N_per_m", by=2.0),
        of_verdict("K_l", value=2.0 * 905.72),
    ),
    "the high stiffness 1 % up": scaled("flexures", "high", "stiffness_N_per_m", by=1.01),
    "a compliance times 1.5": scaled("contact", "compliance_per_mm", by=1.5),
    "one element of the compliance": scaled("contact", "compliance_per_mm", 0, 1, by=1.5),
    "compliance and its K_m/E": together(
        scaled("contact", "compliance_per_mm", by=1.5), scaled("contact", "K_m_over_E_mm", by=1 / 1.5)
    ),
    "compliance and every K_m": together(
        scaled("contact", "compliance_per_mm", by=1.5),
        scaled("contact", "K_m_over_E_mm", by=1 / 1.5),
        scaled("springs", "K_m_over_E_mm", by=1 / 1.5),
        scaled("springs", "K_m_max_N_per_m", by=1 / 1.5),
    ),
    "targets": scaled("design", "targets", by=1.1),
    "E_max": scaled("design", "fruit", "E_max_MPa", by=0.9),
    "sizing K_l": scaled("springs", "K_l_N_per_m", by=1.1),
    "sizing K_h": scaled("springs", "K_h_N_per_m", by=1.1),
    "K_m_max": scaled("springs", "K_m_max_N_per_m", by=1.1),
    "forces of one row": scaled("response", 2, "F_l_N", by=0.9),
    "all of one row": together(scaled("response", 2, "F_l_N", by=0.9), scaled("response", 2, "F_h_N", by=0.9)),
    "P of one row": scaled("response", 0, "P", by=1.5),
    "moduli of the rows": scaled("response", 1, "E_MPa", by=1.5),
    "travels of a row": scaled("response", 1, "x_mm", by=1.5),
    "deflections": scaled("deflections_mm", by=0.5),
    "modulus of the material": scaled("material", "E_MPa", by=2.0),
    "safety factor": scaled("flexures", "low", "safety_factor", by=2.0),
    "root strain and safety factor": together(
        scaled("flexures", "low", "root_strain", by=10.0), scaled("flexures", "low", "safety_factor", by=0.1)
    ),
    "leaf of the flexure": scaled("flexures", "low", "dimensions_mm", "thickness", by=1.1),
    "error of the contact": scaled("contact", "error_percent", by=0.01),
    "error of a stiffness": scaled("flexures", "high", "error_percent", by=0.01),
    "a verdict on the paper's springs": lambda report: report["paper"]["verdicts"][0].update(passed=True),
    "a number of the paper's springs": lambda report: report["paper"]["verdicts"][0].update(value=5.0),
}


@pytest.mark.parametrize("name", TAMPERED)
def test_changed_report_is_found_with_and_without_a_digest_that_fits(name, report, tmp_path):
    changed = copy.deepcopy(report)
    TAMPERED[name](changed)
    assert changed != report
    assert "report.digest" in disagreeing(changed, tmp_path)
    found = disagreeing(sealed_mapping(changed), tmp_path)
    assert "report.digest" not in found
    assert found.keys() & {"report.numbers", "report.verdicts"}


def numbers_in(data, path=()):
    """Yield the path of every number in nested data."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from numbers_in(value, (*path, key))
    if isinstance(data, float):
        yield path


def test_any_changed_number_is_found_by_the_digest(report, tmp_path):
    """60 numbers drawn by seed, each changed in its last digits."""
    drawn = random.Random(SEED).sample([*numbers_in(report)], 60)
    for path in drawn:
        changed = copy.deepcopy(report)
        scaled(*path, by=1.0 + 1e-9)(changed)
        if changed != report:  # 0 stays 0
            try:
                assert "report.digest" in disagreeing(changed, tmp_path), path
            except InputError:
                continue  # no housing has this number: refused before it is judged


@pytest.mark.parametrize(
    ("passed", "changes"),
    [
        (True, {"value": 1.0, "limit": 1.0, "tolerance": 0.0}),
        (False, {"value": 2.0, "limit": 1.0, "tolerance": 0.0}),
        (True, {"name": "geometry.stops_low", "value": 2.0, "limit": 1.0, "tolerance": 0.0}),
        (False, {"name": "geometry.stops_low", "value": 0.9, "limit": 1.0, "tolerance": 0.05}),
        (True, {"name": "geometry.plates", "value": 0.4, "limit": 0.3, "tolerance": 0.001}),
        (False, {"name": "geometry.plates", "value": 0.1, "limit": 0.3, "tolerance": 0.001}),
        (True, {"name": "geometry.tip_face", "value": 2.0, "limit": 2.7, "tolerance": 0.0, "error": 0.0}),
        (False, {"name": "geometry.tip_face", "value": 3.0, "limit": 2.7, "tolerance": 0.0, "error": 0.0}),
        (False, {"name": "bruise", "value": 2.0, "limit": 1.0, "tolerance": 0.0, "error": 0.1}),
        (None, {"name": "bruise", "value": 2.0, "limit": 1.0, "tolerance": 0.0, "error": 1.5}),
        (True, {"name": "sideways.low", "value": 4.0, "limit": 3.0, "tolerance": 0.0, "error": 0.1}),
        (False, {"name": "P_monotonic", "value": -0.1, "limit": "greater than 0", "tolerance": None}),
        (False, {"name": "P_max", "value": 5.2, "limit": 5.0, "tolerance": 0.01, "error": 0.01, "relative": True}),
    ],
)
def test_outcome_follows_from_the_rule_of_the_name(passed, changes):
    good = next(verdict for verdict in result_of().verdicts if verdict.name == "geometry.valid")
    verdict = type(good)(**{**vars(good), **changes})
    assert passed in outcome_of(verdict)
    assert (not passed) not in outcome_of(verdict)
