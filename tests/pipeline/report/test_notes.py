"""Notes beside the verdicts: each with its number, the paper's only for its own scene."""

import dataclasses
import re

import pytest
from stand_ins import CONTACT, result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Press
from cad.theory.deep_press import DeepPress
from cad.theory.two_spring_law import Springs, force_ratio, nonlinearity
from pipeline.report.notes import notes


def note(result, start):
    (line,) = (line for line in notes(result) if line.startswith(start))
    return line


def test_paper_s_springs_are_noted_with_what_they_reach():
    K_m = 3.5 * CONTACT.K_m_over_E()
    springs = Springs(K_l=0.753, K_h=17.3)
    P_max, NL = force_ratio(springs, K_m), 100.0 * nonlinearity(springs, K_m, "mid-range")
    line = f"the paper's own springs reach P_max {P_max:.3f} and NL {NL:.2f} % under this contact (targets 5 and 5 %)"
    assert line in notes(result_of())


@pytest.mark.parametrize("fruit", [Fruit(height_mm=20.0), Fruit(poisson=0.45)])
def test_another_fruit_has_no_note_on_the_papers_springs(fruit):
    assert [line for line in notes(result_of(Design(fruit=fruit))) if "own springs reach" in line] == []


def test_fruit_stiffness_pressure_and_depth_are_given():
    result = result_of()
    assert note(result, "the targets hold").startswith(
        f"the targets hold for this fruit and these tips, K_m/E = {CONTACT.K_m_over_E():.5g} mm"
    )
    force = result.press.table.F[-1, -1].max()
    assert note(result, "bruise") == f"bruise: mean pressure {force:.2g} MPa at the largest E and full travel"
    deep = result_of(Design(press=Press(travel_mm=0.3)))
    assert note(deep, "press").startswith("press: 0.3 tip sides at most")


def test_large_strain_is_told_with_what_it_would_change():
    """By the two springs with the factors of one tip: P at the softest flesh, E by the linear law."""
    linear, large = (result_of(Design(press=Press(strain=strain))) for strain in ("linear", "large"))
    springs = linear.springs.as_pair.stiffnesses
    press = DeepPress(springs=springs, side=1.0, poisson=0.3)
    K_m = 0.5 * linear.contact.K_m_over_E()
    drift, bias = 100.0 * press.drift(K_m, (0.06, 0.6)), 100.0 * press.bias(K_m, 0.6)
    line = note(linear, "press")
    assert (
        f"at 0.5 MPa P changes by {drift:+.2g} % over the travel and the linear law reads E {bias:+.2g} % off" in line
    )
    assert "large strain is left out" in line
    assert "calibrate at the same depth on a body of known E" in line
    assert "large strain is solved" in note(large, "press")


def test_press_deeper_than_was_solved_is_told_so():
    assert "large strain was solved for flat tips down to 0.6 sides" in note(
        result_of(Design(press=Press(travel_mm=2.0))), "press"
    )


def test_deep_press_at_large_strain_is_not_told_to_be_of_small_strain():
    line = note(result_of(Design(press=Press(travel_mm=1.2, strain="large"))), "press")
    assert "large strain is solved" in line
    assert "small strain is assumed" not in line


def test_calibration_note_is_three_times_the_relative_error_of_a_leaf():
    """K goes with the cube of the thickness: 0.05 mm on 0.8 and 1.2 mm."""
    words = r"calibrate each printed unit: leaves 0\.05 mm off move K_l by (\d+) % and K_h by (\d+) %"
    percent = [float(text) for text in re.fullmatch(words, note(result_of(), "calibrate")).groups()]
    assert percent == pytest.approx([100.0 * 3.0 * 0.05 / t for t in (0.8, 1.2)], abs=0.51)  # whole per cent


def test_scene_that_is_not_level_says_what_a_level_sensor_has():
    result = result_of()
    beyond = dataclasses.replace(result, press=dataclasses.replace(result.press, level=False))
    assert "a level sensor with flat sharp tips on flat fruit has P_max 5 and NL 5 %" in note(beyond, "P_max, NL")
    assert [line for line in notes(result) if line.startswith("P_max, NL")] == []


def test_weight_is_said_with_its_attitude():
    assert "solved for the attitude 'side'" in note(result_of(), "weight: with the tips down")


def test_whole_fruit_on_a_table_is_told_to_be_held():
    ball = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=65.0)
    forces = result_of().press.at_largest_E.F[-1, -1]
    friction = 4.0 * (forces[1] - forces[0]) / (2.0 * 35.0 * forces.sum())
    result = dataclasses.replace(result_of(), design=dataclasses.replace(Design(), fruit=ball))
    line = note(result, "a whole fruit is solved as held")
    assert f"friction of at least {friction:.2g} holds it" in line
    assert "rolls away" in line
    assert [line for line in notes(result_of()) if line.startswith("a whole fruit")] == []


def test_file_that_is_left_out_is_noted_last():
    left_out = dataclasses.replace(result_of(), left_out="fruit.vtu is left out: too steep")
    assert notes(left_out)[-1] == "fruit.vtu is left out: too steep"
