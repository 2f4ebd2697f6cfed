"""Notes beside the verdicts: each with its number, the paper's only for its own scene."""

import dataclasses
import re

import numpy as np
import pytest
from stand_ins import CONTACT, draw_sensor, relaxing_result, result_of, solved, springs_of

from pipeline.reading.analysis import ModulusAccuracy, ReadingAccuracy
from pipeline.reading.poses import Placement
from pipeline.reading.reading_over_time import decrease_at_twice_the_time
from pipeline.reading.reading_records import UnevenFruit
from pipeline.reading.uncertainty import UncertaintySources
from pipeline.report.notes import notes
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import Estimate
from sensor.theory.free_fruit import table_indentation_fraction
from sensor.theory.two_spring_law import force_ratio


def on_the_press_of_the_block(design, springs=None):
    """Return the result of a design whose press is that of the default one, which is linear."""
    result = result_of()
    pressed = draw_sensor(design, springs)
    errors = solved(pressed, readings=None, press=result.press, reached=result.reached).errors
    return dataclasses.replace(result, pressed=pressed, errors=errors)


def note(result, start):
    (line,) = (line for line in notes(result) if line.startswith(start))
    return line


def test_fruit_stiffness_and_pressure_are_given():
    result = result_of()
    assert f"K_m/E = {CONTACT.K_m_over_E():.5g} mm" in note(result, "Size the springs")
    force = result.press.table.F[-1, -1].max()
    assert f" {force:.2g} MPa" in note(result, "Bruising")  # on a face of 1 mm^2


@pytest.mark.parametrize(
    ("fruit", "key", "E"),
    [
        ({"E_MPa": (0.5, 800.0)}, "fruit.E_MPa", "800"),
        ({"E_MPa": (0.0005, 3.5)}, "fruit.E_MPa", "0.0005"),
    ],
)
def test_a_modulus_in_another_unit_is_the_first_note(fruit, key, E):
    first = notes(result_of(Design(fruit=Fruit(**fruit))))[0]
    assert {key, f"{E}:"} <= set(first.split())


ROUND = Tips(shape="sphere", socket="pin")
BALL = Fruit(shape="sphere", radius_mm=200.0, thickness_mm=380.0)


@pytest.mark.parametrize(
    ("design", "advice", "effect", "number"),
    [
        (Design(), "Calibrate each printed unit", "modulus", "K_l"),
        (Design(), "Calibrate at full travel", "law of the flesh", "NL"),
        (Design(fruit=BALL, tips=ROUND), "Check the deepest press", "law of the flesh", "NL"),
        (Design(), "Cut off the elephant's foot", "elephant's foot", "K_l"),
        (Design(), "Hold the sensor steady", "pose", "P_max"),
        (Design(press=PressMotion(attitude="up")), "Zero the tips on a flat plate in the attitude of the press (up)",
         "tip height", "P_max"),
        (Design(), "Set fruit.poisson", "Poisson's ratio", "NL"),
        (Design(fruit=BALL), "Hold the fruit", "free fruit", "P_max"),
    ],
)  # fmt: skip
def test_advice_on_a_cause_is_given_once_with_what_it_moves_most(design, advice, effect, number):
    """Its cause, number and size are those of the error table."""
    result = result_of(design) if design.fruit.shape == "block" else on_the_press_of_the_block(design)
    line = note(result, advice)
    budget = getattr(result.errors.budgets, number)
    (part,) = (part for part in (*budget.model, *budget.inputs) if part.effect == effect)
    percent = float(f"{abs(100.0 * part.size):.2g}")
    assert line.endswith(f": {part.reason} moves {number} by {percent:g} %.")
    for other in ("K_l", "K_h", "P_max", "NL"):
        budget = getattr(result.errors.budgets, other)
        same = [abs(each.size) for each in (*budget.model, *budget.inputs) if each.advice == part.advice]
        assert max(same, default=0.0) <= abs(part.size)


@pytest.mark.parametrize(("name", "left", "told"), [(None, 0.42, "an orange"), ("pear", 0.45, "a pear")])
def test_relaxation_that_is_not_known_is_told_by_the_table_of_fruits(name, left, told):
    """P of two springs on fruit that keeps a share of each modulus; of a fruit without a name as an orange does."""
    result = result_of(Design(fruit=Fruit(name=name)))
    springs = result.springs.stiffnesses
    K_m = CONTACT.K_m_over_E() * np.array(result.design.fruit.E_MPa)
    changes = [100.0 * (force_ratio(springs, left * each) / force_ratio(springs, each) - 1.0) for each in K_m.tolist()]
    said = note(result, "Read soon")
    assert f"{told} relaxes to {100 * left:g} %" in said
    assert f"P moves by {max(changes):.2g} to {min(changes):.2g} %" in said


def test_what_moves_a_reading_most_comes_first():
    """Of a pair on a block: bruises, an orange's 58 %, a tilt's 27 %, the 20 % of E, the 17 % of laws and the rest."""
    told = notes(result_of())
    opened = ("Bruising", "Read soon", "Hold the sensor", "Calibrate each", "Calibrate at")
    for line, start in zip(told, opened, strict=False):
        assert line.startswith(start)
    sizes = [numbers_of(line)[-1] for line in told if re.search(" moves (K_l|K_h|P_max|NL) ", line)]
    assert sizes == sorted(sizes, reverse=True)


def test_weight_of_a_sensor_that_is_held_sideways():
    """Its advice is that on the step between the tips, and the larger one of both is told: tips off by 0.2 mm."""
    design = Design()
    springs = springs_of(design)
    weight = 9.80665e-6 * springs.process.density_g_per_cm3  # [N/mm^3]
    sagging = dataclasses.replace(springs.fitted.stiffness, weight_sag=(0.22 / weight, 0.02 / weight))
    heavy = dataclasses.replace(springs, fitted=dataclasses.replace(springs.fitted, stiffness=sagging))
    result = on_the_press_of_the_block(design, heavy)
    assert "(tips 0.2 mm off level) moves P_max by" in note(result, "Zero the tips")
    read = dataclasses.replace(result, readings=ReadingAccuracy(method="rise", touch=Estimate(0.4, 0.01)))
    assert numbers_of(note(read, "Hold the sensor in the attitude of its design")) == [0.2, design.press.travel_mm]
    far = dataclasses.replace(design, press=dataclasses.replace(design.press, travel_mm=2.1))  # 0.2 is under a tenth
    read = dataclasses.replace(read, pressed=dataclasses.replace(read.pressed, design=far))
    assert numbers_of(note(read, "Tare in any attitude"))[0] == pytest.approx(0.2)


def numbers_of(line):
    """Return the numbers of a note."""
    return [float(text) for text in re.findall(r"[-+]?\d+\.?\d*(?:e-?\d+)?", line)]


def rounded(*values, digits=2):
    """Return numbers as notes write them."""
    return [float(f"{value:.{digits}g}") for value in values]


def read_result(**changes):
    """Return a result whose readings have the changed numbers, and whose P has no errors."""
    result = result_of()
    pressed = draw_sensor(Design(reading=ReadingRequirements()))
    readings = ReadingAccuracy(method="rise", touch=Estimate(0.4, 0.01), **changes)
    budgets = dataclasses.replace(result.errors.budgets, P_max=None, NL=None)
    errors = dataclasses.replace(result.errors, budgets=budgets)
    return dataclasses.replace(result, pressed=pressed, readings=readings, errors=errors)


def test_notes_of_a_reading():
    """The slope of ln(1 - nu^2) is 2 nu / (1 - nu^2); what holds 95 % is two standard deviations."""
    result = read_result(moduli=(read_at(0.1),), flesh=0.031)
    fruit = result.design.fruit
    assert numbers_of(note(result, "Press 3 places")) == [3.0, 26.0, 15.0, 95.0]
    assert numbers_of(note(result, "Allow")) == rounded(3.1)
    assert numbers_of(note(result, "Press always")) == rounded(100.0 * decrease_at_twice_the_time(result.pressed))
    moved = 100.0 * 2.0 * fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)
    assert numbers_of(note(result, "Set fruit.poisson")) == rounded(fruit.poisson, fruit.poisson_spread, moved)
    quiet = notes(read_result())
    assert not [line for line in quiet if line.startswith(("Press 3", "Allow", "Keep the noise", "Calibrate better"))]


def read_at(limit):
    """Return a reading of limited uncertainty [1]: 12 % by the channels, and as many per cent by noise as there are."""
    sources = UncertaintySources(
        contributions={"noise_percent": 0.005, "gain": 0.12}, stiffness_slope=1.0, noise_slope=0.01
    )
    placement = Placement()
    none = Estimate(0.0, 0.0)
    uneven = UnevenFruit(skin_percent=5.0, flesh_percent=12.0, one_press_percent=13.0, presses=3.0, presses_percent=7.5)
    return ModulusAccuracy(
        E=1.5, bias=none, worst=placement, reach=none, sources=sources, uncertainty_limit=limit, uneven=uneven
    )


def test_noise_is_told_by_the_limit_of_the_design():
    """12 % by the channels and 9 % by noise are 15 %; a limit of 10 % is passed without noise, which the note says.

    The limit is told as what holds 95 %, twice the standard uncertainty of the design file.
    """
    assert numbers_of(note(read_result(moduli=(read_at(0.15),)), "Keep the noise")) == [9.0, 30.0, 95.0]
    assert numbers_of(note(read_result(moduli=(read_at(0.1),)), "Calibrate better")) == [20.0, 95.0]


def test_relaxation_that_is_known():
    """It is told by what is left of the modulus at the reading."""
    result = relaxing_result()
    over_time = result.over_time
    left = over_time.apparent[:, over_time.at] / over_time.E
    told = numbers_of(note(result, "Read by"))
    assert told == rounded(over_time.t[over_time.at], left.min(), left.max(), digits=3)
    assert max(told[1:]) < 1.0


def test_depth_that_is_no_whole_number_of_layers_is_told_with_what_it_moves():
    """29 layers of 0.35 mm are 10.15 mm, where the leaves are 10 mm deep; those of 0.2 mm fit."""
    result = result_of()
    springs = result.springs
    thick = dataclasses.replace(springs, process=dataclasses.replace(springs.process, layer_mm=0.35))
    layered = dataclasses.replace(result, pressed=dataclasses.replace(result.pressed, springs=thick))
    assert numbers_of(note(layered, "Calibrate, or choose another layer height")) == [0.35, 10.15, 10.0, 1.5]
    assert not [line for line in notes(result) if "layer height" in line]


def test_table_under_a_whole_fruit():
    result = on_the_press_of_the_block(Design(fruit=BALL))
    force = float(result.press.at_largest_E.F[-1, -1].sum())
    share = table_indentation_fraction(force, 0.6, 3.5, BALL.poisson, 200.0)
    assert numbers_of(note(result, "Support the fruit")) == rounded(100.0 * share)
