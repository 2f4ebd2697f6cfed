"""Which verdicts a run gives, whose numbers they are, and where the paper's own springs stand beside."""

import dataclasses

import pytest
from stand_ins import CONTACT, LENGTHS, draw_sensor, result_of, springs_of

from pipeline.response.scene_press import press_scene, scene_of
from pipeline.verdicts.sensor_rules import RULES, paper_verdicts, tip_pressure
from sensor.design.parameters import PAPER_SPRINGS, Design, Targets
from sensor.verdict import verdict_rows

ALWAYS = ["P_max", "NL", "K_l", "K_h", "P_displacement_independent", "P_monotonic", "printable.low", "printable.high"]


def test_every_verdict_that_needs_no_solid_has_a_rule():
    """A study may ask for those that have a level."""
    ruled = [name for name, _ in RULES]
    asked = {name for row in verdict_rows() if row.level is not None for name in row.names}
    assert set(ruled) == asked
    assert [name for name in ruled if ruled.count(name) > 1] == ["bruise"] * 2  # of readings, or of the hardest press


def test_every_run_has_the_same_verdicts_then_those_on_its_solid_and_judges_each_spring_by_its_own_numbers():
    """The stand-ins are as stiff as their targets, and their leaves have the lengths of the reference."""
    verdicts = result_of().verdicts
    assert [verdict.name for verdict in verdicts] == [*ALWAYS, "geometry.valid"]
    assert [verdict.name for verdict in result_of(made=False).verdicts] == [*ALWAYS, "geometry.made"]
    values = {verdict.name: verdict.value for verdict in verdicts}
    targets = [1e3 * K for K in springs_of(Design()).stiffnesses.stiffnesses]
    assert [values["K_l"], values["K_h"]] == pytest.approx(targets, rel=1e-12)
    assert (values["printable.low"], values["printable.high"]) == LENGTHS


@pytest.mark.parametrize(("solved", "added"), [(0.03, 0.03), (float("nan"), 0.0)])
def test_error_of_the_pressure_is_that_of_the_worst_spring_and_of_the_contact(solved, added):
    """A spring's relative error moves its force by the spring's share (1/K) / (1/K + 1/K_m) of the compliance."""
    design, springs = Design(), springs_of(Design())
    press = press_scene(scene_of(design), CONTACT, springs.C)
    hardest = press.at_largest_E
    known = dataclasses.replace(
        press, at_largest_E=dataclasses.replace(hardest, F_error=hardest.F_error * 0.0 + solved)
    )
    pressure = tip_pressure(draw_sensor(design, springs), known)
    K_m = 3.5 * CONTACT.K_m_over_E()
    shares = [K_m / (K_m + spring.stiffness) * spring.K_error for spring in springs.springs.values()]
    assert pressure.relative == pytest.approx(max(shares) + added, rel=1e-9)
    assert pressure.unit == "MPa"


def test_papers_springs_are_judged_by_the_papers_targets_whatever_the_design_asks():
    design = Design(targets=Targets(P_max=7.0, NL=0.03))
    paper = paper_verdicts(draw_sensor(design))
    assert paper == result_of().paper
    assert {verdict.name: verdict.limit for verdict in paper[:2]} == {"P_max": 5.0, "NL": 0.05}
    low, high = PAPER_SPRINGS.stiffnesses  # exactly as published: the error of P is that of the contact
    K_m = 3.5 * CONTACT.K_m_over_E()
    slope = K_m / (K_m + low) - K_m / (K_m + high)  # d ln P / d ln K_m
    assert paper[0].error == pytest.approx(paper[0].value * slope * CONTACT.difference_error, rel=1e-3)
