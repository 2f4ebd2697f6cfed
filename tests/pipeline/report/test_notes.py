"""Notes beside the verdicts: each with its number, the paper's only for its own scene."""

import dataclasses
import math
import re

import numpy as np
import pytest
from stand_ins import CONTACT, relaxing_result, result_of, sensor_of

from pipeline.options import load_design, preset_names
from pipeline.reading.analysis import ModulusReading, Readings
from pipeline.reading.poses import Placement
from pipeline.reading.uncertainty import UncertaintySources
from pipeline.report.notes import notes
from pipeline.report.verdict_table import WIDTH
from sensor.design.fruit import USUAL_MODULI, Fruit
from sensor.design.parameters import Design
from sensor.design.reading import Reading
from sensor.design.tips import Press, Tips
from sensor.quantity import Estimate
from sensor.theory.free_fruit import table_share
from sensor.theory.two_spring_law import force_ratio


def note(result, start):
    (line,) = (line for line in notes(result) if line.startswith(start))
    return line


def test_fruit_stiffness_pressure_and_depth_are_given():
    result = result_of()
    assert f"K_m/E = {CONTACT.K_m_over_E():.5g} mm" in note(result, "Size the springs")
    force = result.press.table.F[-1, -1].max()
    assert f" {force:.2g} MPa" in note(result, "Set fruit.bruise")  # on a face of 1 mm^2
    assert note(result_of(Design(press=Press(travel_mm=0.3))), "Calibrate at").startswith("Calibrate at 0.3 tip widths")


@pytest.mark.parametrize(
    ("fruit", "key", "E"),
    [
        ({"E_max_MPa": 3500.0}, "fruit.E_max_MPa", "3500"),
        ({"E_MPa": (0.5, 800.0)}, "fruit.E_MPa", "800"),
        ({"E_MPa": (0.0005, 3.5)}, "fruit.E_MPa", "0.0005"),
    ],
)
def test_a_modulus_in_another_unit_is_the_first_note(fruit, key, E):
    first = notes(result_of(Design(fruit=Fruit(**fruit))))[0]
    assert {key, f"{E}:"} <= set(first.split())


@pytest.mark.parametrize("name", preset_names())
def test_presets_have_usual_moduli(name):
    fruit = load_design(name).fruit
    assert all(map(USUAL_MODULI.hold, (fruit.E_max_MPa, *fruit.E_MPa)))


def test_large_strain_is_told_by_what_it_makes_of_the_force_of_a_tip():
    """The factors of log neo-Hooke, Hencky and foam at nu 0.3 and 0.6 sides, in the table of flat tips."""
    line = note(result_of(), "Calibrate at")
    assert re.findall(r"[+-][0-9.]+", line) == [f"{100.0 * (factor - 1.0):+.2g}" for factor in (1.0029, 0.9522, 1.1305)]


@pytest.mark.parametrize(
    "design", [Design(press=Press(travel_mm=2.0)), Design(tips=Tips(shape="sphere", socket="pin"))]
)
def test_press_that_the_table_does_not_hold_is_told_without_it(design):
    depth = design.press.travel_mm / design.tips.side_mm
    assert numbers_of(note(result_of(design), "Check the deepest")) == [depth]


def test_relaxation_that_is_not_known_is_told_by_the_flesh_of_an_orange():
    """P of two springs on fruit that keeps 42 % of each modulus."""
    result = result_of()
    springs = result.springs.stiffnesses
    K_m = CONTACT.K_m_over_E() * np.array(result.design.fruit.E_MPa)
    changes = [100.0 * (force_ratio(springs, 0.42 * each) / force_ratio(springs, each) - 1.0) for each in K_m.tolist()]
    assert f"P moves by {max(changes):.2g} to {min(changes):.2g} %" in note(result, "Read soon")


def test_calibration_note_is_three_times_the_relative_error_of_a_leaf():
    """K goes with the cube of the thickness: 0.05 mm on 0.8 and 1.2 mm."""
    percent = [float(text) for text in re.findall(r"by (\d+) %", note(result_of(), "Calibrate each"))]
    assert percent == pytest.approx([100.0 * 3.0 * 0.05 / t for t in (0.8, 1.2)], abs=0.51)  # whole per cent


def test_what_moves_a_reading_most_comes_first():
    """Of a pair on a block: bruises, then an orange's 58 %, the leaves' 19 %, the laws' 13 % and the rest."""
    opened = ("Set fruit.bruise", "Read soon", "Calibrate each", "Calibrate at")
    for line, start in zip(notes(result_of()), opened, strict=False):
        assert line.startswith(start)


def test_each_is_one_sentence_that_fits_a_line():
    for result in (result_of(), read_result(moduli=(read_at(0.1),), heights=0.5, flesh=0.031), relaxing_result()):
        for line in notes(result):
            assert re.fullmatch(r"[A-Z][^.]*(\.\S[^.]*)*\.", line), line
            assert len(line) <= WIDTH - len("- "), line


def numbers_of(line):
    """Return the numbers of a note."""
    return [float(text) for text in re.findall(r"[-+]?\d+\.?\d*(?:e-?\d+)?", line)]


def rounded(*values, digits=2):
    """Return numbers as notes write them."""
    return [float(f"{value:.{digits}g}") for value in values]


def read_result(**changes):
    """Return a result whose readings have the changed numbers."""
    design = Design(reading=Reading())
    readings = Readings(method="rise", touch=Estimate(0.4, 0.01), **changes)
    return dataclasses.replace(result_of(), pressed=sensor_of(design), readings=readings)


def test_notes_of_a_reading():
    """The slope of ln(1 - nu^2) is 2 nu / (1 - nu^2); 0.05 mm of contrast times 100 % are five times the slope."""
    result = read_result(heights=0.5, flesh=0.031)
    fruit = result.design.fruit
    assert rounded(2.5)[0] in numbers_of(note(result, "Press smooth skin"))
    assert numbers_of(note(result, "Allow")) == rounded(3.1)
    moved = 100.0 * 2.0 * fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)
    assert numbers_of(note(result, "Set fruit.poisson")) == rounded(fruit.poisson, fruit.poisson_spread, moved)
    quiet = notes(read_result())
    assert not [
        line for line in quiet if line.startswith(("Press smooth", "Allow", "Keep the noise", "Calibrate better"))
    ]


def read_at(limit):
    """Return a reading of limited uncertainty [1]: 12 % by the channels, and as many per cent by noise as there are."""
    sources = UncertaintySources(
        contributions={"noise_percent": 0.005, "gain": 0.12}, stiffness_slope=1.0, noise_slope=0.01
    )
    placement = Placement()
    none = Estimate(0.0, 0.0)
    return ModulusReading(E=1.5, bias=none, worst=placement, reach=none, sources=sources, uncertainty_limit=limit)


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


def test_weight():
    """Springs that sag by 0.02 and 0.005 mm."""
    result = result_of()
    stiffness = result.springs.fitted.stiffness
    weight = 9.80665e-6 * result.springs.process.density_g_per_cm3  # [N/mm^3]
    sagging = dataclasses.replace(stiffness, weight_sag=(0.02 / weight, 0.005 / weight))
    fitted = dataclasses.replace(result.springs.fitted, stiffness=sagging)
    springs = dataclasses.replace(result.springs, fitted=fitted)
    heavy = dataclasses.replace(result, pressed=dataclasses.replace(result.pressed, springs=springs))
    assert numbers_of(note(heavy, "Zero the forces"))[0] == pytest.approx(0.015)


def test_free_fruit():
    """A small ball rolls away and a large one until its moment is met, by the forces of the press of the block.

    The moment over 2 R times all force is the friction that holds it.
    """
    result = result_of()
    low, high = result.press.at_largest_E.F[-1, -1]
    series = [1.0 / (1.0 / K + 1.0 / (3.5 * CONTACT.K_m_over_E())) for K in result.springs.stiffnesses.stiffnesses]
    for radius in (35.0, 200.0):
        fruit = Fruit(shape="sphere", radius_mm=radius, thickness_mm=1.9 * radius)
        sensor = dataclasses.replace(result.pressed, design=Design(fruit=fruit))
        told = numbers_of(note(dataclasses.replace(result, pressed=sensor), "Hold the fruit"))
        at_table = 100.0 * table_share(float(low + high), 0.6, 3.5, fruit.poisson, radius)
        moment = 4.0 * (high - low)
        turn = math.degrees(moment / (low + high - 16.0 * sum(series) / radius) / radius)
        friction = moment / (2.0 * radius * (high + low))
        assert told == rounded(at_table, *([turn] if radius > 100.0 else []), friction)
