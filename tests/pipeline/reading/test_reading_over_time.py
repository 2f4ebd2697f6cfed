"""Readings over time: the limits of a press that is fast or slow, the published orange, and the planted slow design."""

import dataclasses

import numpy as np
import pytest
from flat_square import square_contact, square_design, square_springs
from refusal import refusal
from stand_ins import CONTACT, draw_sensor, springs_of, with_compliance

from pipeline.options import RunOptions
from pipeline.reading.reading_over_time import reading_over_time, refuse_unsolvable_time
from pipeline.report.parts import RelaxationReport
from pipeline.verdicts.hints import with_hints
from pipeline.verdicts.rules import relaxation_verdict
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion, Tips
from sensor.theory.two_spring_law import force_ratio

ORANGE = ((0.25, 5.0), (0.33, 120.0))  # 42 % are left, as of Tarocco oranges; times as flesh has them


def relaxing(arms=ORANGE, speed=0.6, hold=900.0, **tables):
    return Design(fruit=Fruit(relaxation=arms), press=PressMotion(speed_mm_per_s=speed, hold_s=hold), **tables)


def over_time(design):
    return reading_over_time(draw_sensor(design))


def test_flesh_that_is_not_said_to_relax_costs_nothing():
    assert over_time(Design()) is None


def test_orange_moves_the_ratio_of_the_paper_as_published():
    """At last each fruit is elastic of 0.42 times its modulus; Moresi et al. (2012), doi:10.1007/s11947-011-0528-4."""
    design = relaxing(hold=9000.0)
    found = over_time(design)
    springs = springs_of(design).stiffnesses
    E = np.array(design.fruit.E_MPa)
    early, late = ([force_ratio(springs, K_m) for K_m in share * E * CONTACT.K_m_over_E()] for share in (1.0, 0.42))
    assert found.P[:, -1] == pytest.approx(late, rel=1e-6)
    assert found.apparent[:, -1] == pytest.approx(0.42 * E, rel=1e-6)
    change = np.divide(late, early) - 1.0
    assert [change.max(), change.min()] == pytest.approx([-0.23, -0.42], abs=0.005)


@pytest.mark.parametrize(
    ("flesh", "press", "left", "rel"),
    [
        ((0.5, 1e5), {"hold": 1.0}, 1.0, 2e-5),  # a fast press reads the modulus of the first instant
        ((0.5, 1e-3), {"speed": 0.01, "hold": 10.0}, 0.5, 1e-3),  # a slow one reads what is left of it
    ],
)
def test_fast_and_slow_presses_read_the_limits_of_flesh(flesh, press, left, rel):
    found = over_time(relaxing(arms=(flesh,), **press))
    assert found.apparent[:, found.stop :] == pytest.approx(np.full((7, 13), left) * found.E[:, None], rel=rel)


def test_apparent_modulus_at_the_reading_is_what_the_verdict_compares_with():
    found = over_time(relaxing(arms=((0.4, 2.0),), hold=3.0, reading=ReadingRequirements(at_s=2.2)))
    assert found.t[found.at] == 2.2
    held = found.apparent[:, found.stop :]
    moves = np.abs(held[:, None, :] / held[:, :, None] - 1.0).max(axis=(0, 2))  # over the hold, from each of its times
    assert found.moves.value == pytest.approx(moves[found.at - found.stop], rel=1e-12)
    assert found.steadiest.moves_percent == pytest.approx(100.0 * moves.min(), rel=1e-12)
    assert found.steadiest.at_s == found.t[found.stop + moves.argmin()]


@pytest.mark.parametrize(("arms", "hold", "passed"), [(((0.02, 2.0),), 3.0, True), (ORANGE, 900.0, False)])
def test_flesh_that_relaxes_much_in_the_hold_fails_and_has_a_hint(arms, hold, passed):
    design = relaxing(arms=arms, hold=hold, reading=ReadingRequirements(), springs=Design().springs)
    verdict = relaxation_verdict(design, over_time(design))
    assert (verdict.name, verdict.limit, verdict.passed) == ("reading.relaxation", 0.05, passed)
    (hinted,) = with_hints([verdict], design, springs_of(design), RunOptions())
    assert (hinted.remedy is None) is passed
    assert passed or "reading.at_s" in hinted.remedy


def test_forces_that_tell_no_modulus_in_the_hold_fail_and_are_null_in_the_report():
    """Of flesh of which little is left, long before a slow press stops."""
    design = relaxing(((0.9863522967742812, 0.34328670798457106),), speed=0.01656433777028851, hold=2.61)
    found = over_time(design)
    verdict = relaxation_verdict(design, found)
    assert verdict.passed is False
    assert verdict.value is None
    report = RelaxationReport.from_stage(found)
    assert report.moves_percent is None
    assert [moment.moves_percent for moment in report.moments] == [None]


def test_square_of_whole_faces_reads_less_and_less_while_its_flesh_relaxes():
    square = square_design()
    fruit = dataclasses.replace(square.fruit, relaxation=((0.4, 2.0),))
    press = dataclasses.replace(square.press, speed_mm_per_s=0.5, hold_s=3.0)
    design = dataclasses.replace(square, fruit=fruit, press=press)
    found = reading_over_time(with_compliance(design, square_contact(), square_springs()))
    fallen = found.apparent[:, found.stop :] / found.E[:, None]
    assert (np.diff(fallen, axis=1) < 0.0).all()
    assert 0.6 < fallen.min() < fallen.max() < 1.0


@pytest.mark.parametrize(
    "changes",
    [
        {"press": PressMotion(speed_mm_per_s=0.5, hold_s=1.0, tilt_deg=1.0)},
        {"press": PressMotion(speed_mm_per_s=0.5, hold_s=1.0, roll_deg=1.0)},
        {"fruit": Fruit(shape="sphere", radius_mm=35.0, relaxation=ORANGE)},
        {"tips": Tips(fillet_mm=0.1, socket="pin")},
        {"tips": Tips(shape="dome", dome_radius_mm=2.0)},
    ],
)
def test_scene_that_is_not_solved_over_time_is_refused_by_name(changes):
    assert refusal(refuse_unsolvable_time, dataclasses.replace(relaxing(), **changes)).field == "fruit.relaxation"
