"""Notes beside the verdicts: each with its number, the paper's only for its own scene."""

import re

import numpy as np
import pytest
from stand_ins import CONTACT, result_of

from pipeline.report.notes import notes
from sensor.design.parameters import Design
from sensor.design.tips import Press, Tips
from sensor.theory.two_spring_law import force_ratio


def note(result, start):
    (line,) = (line for line in notes(result) if line.startswith(start))
    return line


def test_fruit_stiffness_pressure_and_depth_are_given():
    result = result_of()
    assert f"K_m/E = {CONTACT.K_m_over_E():.5g} mm" in note(result, "the targets hold")
    force = result.press.table.F[-1, -1].max()
    assert f" {force:.2g} MPa" in note(result, "bruise")  # on a face of 1 mm^2
    assert note(result_of(Design(press=Press(travel_mm=0.3))), "press").startswith("press: 0.3 tip sides")


def test_large_strain_is_told_by_what_it_makes_of_the_force_of_a_tip():
    """The factors of log neo-Hooke, Hencky and foam at nu 0.3 and 0.6 sides, in the table of flat tips."""
    line = note(result_of(), "press")
    assert re.findall(r"[+-][0-9.]+", line) == [f"{100.0 * (factor - 1.0):+.2g}" for factor in (1.0029, 0.9522, 1.1305)]


@pytest.mark.parametrize(
    "design", [Design(press=Press(travel_mm=2.0)), Design(tips=Tips(shape="sphere", socket="pin"))]
)
def test_press_that_the_table_does_not_hold_is_told_without_it(design):
    assert "down to 0.6 sides" in note(result_of(design), "press")


def test_relaxation_that_is_not_known_is_told_by_the_flesh_of_an_orange():
    """P of two springs on fruit that keeps 42 % of each modulus."""
    result = result_of()
    springs = result.springs.stiffnesses
    K_m = CONTACT.K_m_over_E() * np.array(result.design.fruit.E_MPa)
    changes = [100.0 * (force_ratio(springs, 0.42 * each) / force_ratio(springs, each) - 1.0) for each in K_m.tolist()]
    assert f"P moves by {max(changes):.2g} to {min(changes):.2g} %" in note(result, "relaxation")


def test_calibration_note_is_three_times_the_relative_error_of_a_leaf():
    """K goes with the cube of the thickness: 0.05 mm on 0.8 and 1.2 mm."""
    percent = [float(text) for text in re.findall(r"by (\d+) %", note(result_of(), "calibrate"))]
    assert percent == pytest.approx([100.0 * 3.0 * 0.05 / t for t in (0.8, 1.2)], abs=0.51)  # whole per cent
