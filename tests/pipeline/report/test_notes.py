"""Notes beside the verdicts: each with its number, the paper's only for its own scene."""

import re

import numpy as np
import pytest
from stand_ins import CONTACT, result_of

from cad.design.parameters import Design
from cad.design.tips import Press
from cad.theory.deep_press import DeepPress
from cad.theory.two_spring_law import force_ratio
from pipeline.report.notes import notes


def note(result, start):
    (line,) = (line for line in notes(result) if line.startswith(start))
    return line


def test_fruit_stiffness_pressure_and_depth_are_given():
    result = result_of()
    assert f"K_m/E = {CONTACT.K_m_over_E():.5g} mm" in note(result, "the targets hold")
    force = result.press.table.F[-1, -1].max()
    assert f" {force:.2g} MPa" in note(result, "bruise")  # on a face of 1 mm^2
    assert note(result_of(Design(press=Press(travel_mm=0.3))), "press").startswith("press: 0.3 tip sides")


def test_large_strain_is_told_with_what_it_would_change():
    """By the two springs with the factors of one tip: P at the softest flesh, E by the linear law."""
    result = result_of()
    press = DeepPress(springs=result.springs.per_spring.stiffnesses, side=1.0, poisson=0.3)
    K_m = 0.5 * result.contact.K_m_over_E()
    line = note(result, "press")
    assert f"{100.0 * press.drift(K_m, (0.06, 0.6)):+.2g} %" in line
    assert f"{100.0 * press.bias(K_m, 0.6):+.2g} %" in line


@pytest.mark.parametrize(
    ("press", "words"),
    [
        (Press(), "is left out"),
        (Press(strain="large"), "large strain is solved"),
        (Press(travel_mm=2.0), "down to 0.6 sides"),
    ],
)
def test_large_strain_is_told_as_it_is_taken(press, words):
    assert words in note(result_of(Design(press=press)), "press")


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
