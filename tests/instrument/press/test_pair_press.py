"""A press of a pair: the line reads through any tilt, the force ratio does not and is told apart."""

import numpy as np
import pytest
from measured_units import MeasuredDesign, read_press, readings_at, stated_and_moved, with_design
from refusal import refusal

from instrument.press.pair_press import single_reading
from instrument.press.presses import refuse_out_of_scale
from instrument.press.seating import seating_of
from sensor.design.reading import ReadingRequirements
from sensor.theory.contrast_rise import read_rise, select_rise


def press(paper, E, tilt=0.0):
    return paper.press(E, np.linspace(0.05, 1.0, 40), tilt_deg=(tilt, 0.0))


def read(sensor, forces):
    """Return what a unit reads of the samples in which both tips touch."""
    return read_press(sensor, forces[forces.min(axis=1) > 0.0])


@pytest.mark.parametrize("E", [0.5, 1.3, 3.5])
def test_level_press_is_exact_by_every_read_out(paper, E):
    forces = press(paper, E)
    reading = read(paper.measuring(), forces)
    assert pytest.approx(E, rel=1e-3) == reading.E
    assert reading.others == {"force_ratio": pytest.approx(E, rel=1e-3)}
    assert reading.flags == ()
    assert pytest.approx(E, rel=1e-3) == single_reading(paper.measuring(), forces[-1]).E


@pytest.mark.parametrize(("E", "tilt"), [(0.5, 0.5), (3.5, 1.0), (0.5, 2.1), (3.5, -3.0)])
def test_line_reads_through_a_tilt_that_the_force_ratio_does_not(paper, E, tilt):
    reading = read(paper.measuring(), press(paper, E, tilt))
    assert pytest.approx(E, rel=0.01) == reading.E
    assert reading.tilt == pytest.approx(abs(tilt), rel=0.02)
    assert reading.direction == (0.0 if tilt > 0.0 else 180.0)
    assert "read_outs_disagree" in reading.flags
    assert ("tilt_beyond_design" in reading.flags) == (reading.tilt > 2.0)
    if "force_ratio" in reading.others:
        assert abs(reading.others["force_ratio"] / E - 1.0) > 0.15


def test_signal_without_a_press_is_told(paper):
    (reading,) = readings_at(paper.measuring(), [0.0, 1.0], np.array([[0.0, 0.0], [0.0, 0.001]]))
    assert (reading.E, reading.flags) == (None, ("lift_off",))


@pytest.mark.parametrize("tip", [0, 1])
@pytest.mark.parametrize("field", ["K_percent", "gain_percent"])
def test_springs_and_gains_move_the_reading_as_is_said(field, tip, paper):
    """Of a press, and of one sample."""
    forces = press(paper, 1.3)
    for tell in (read, lambda unit, rows: single_reading(unit, rows[-1])):
        stated, moved = stated_and_moved(paper.measuring(), forces, tell, field, tip)
        assert stated == pytest.approx(moved, rel=0.02)


def test_force_beyond_zero_or_the_scale_is_refused_at_its_tip(paper):
    """Eight deviations of noise below zero, twice the least force of a touch, and twenty full scales are allowed."""
    sensor = paper.measuring()
    lowest, highest = -8.0 * sensor.noises, 20.0 * np.array(sensor.report.read_out.full_scale_N)
    refuse_out_of_scale(sensor, [lowest[0], highest[1]], "{}".format)
    for forces, name in (([1.01 * lowest[0], 0.1], "low"), ([0.1, 1.01 * highest[1]], "high")):
        assert refusal(refuse_out_of_scale, sensor, forces, ("low", "high").__getitem__).field == name
        told = refusal(readings_at, sensor, [0.0], np.array([forces]))
        assert told.field == f"press.csv, line 2, column 'F_{name[0]}_N'"


def test_tilt_that_a_design_allows_is_in_the_uncertainty_of_one_reading(paper):
    """A tilt anywhere up to a bound has the bound over the root of three as deviation; its slope by the solver."""
    forces = press(paper, 1.0)[-1]
    level, tilted = (single_reading(paper.measuring(), row).E for row in (forces, press(paper, 1.0, 0.01)[-1]))
    per_degree = abs(tilted / level - 1.0) / 0.01
    u = []
    for tilt in (1.0, 2.0):
        asked = ReadingRequirements(tilt_deg=tilt, off_centre_mm=0.0, radius_spread=0.0)
        u.append(single_reading(with_design(paper.measuring(), reading=asked), forces).u)
    assert np.sqrt(u[1] ** 2 - u[0] ** 2) == pytest.approx(2.0 * per_degree, rel=0.02)  # 4 - 1 degrees^2 over 3


@pytest.fixture(scope="module")
def curved():
    """Return the pair on a round fruit, whose skin both tips meet with an edge first."""
    return MeasuredDesign("paper-on-mango", assessed=False)


def test_samples_before_flat_tips_are_seated_do_not_count(curved):
    """By the contact solver: the whole press is read some per cent too firm, its seated part is not."""
    sensor = curved.measuring()
    forces = curved.press(0.5, np.linspace(0.02, 1.0, 40), tilt_deg=(1.0, 0.0))
    seated = read(sensor, forces)
    assert pytest.approx(0.5, rel=1e-3) == seated.E
    found = read_rise(sensor.rise_law, select_rise(forces, 2, sensor.least_forces), sensor.noises)
    assert found.E > 1.05 * 0.5
    assert found.samples > seated.samples >= 10


def test_a_load_seats_tips_and_none_seats_them_beyond_the_last(curved, paper, mango):
    """Pressed in by the side times the lean: Johnson's 5.2 by hand, the lean of a level tip that of the skin."""
    seating = seating_of(curved.measuring())
    tips = curved.design.tips
    lean = 0.05 / tips.spacing_mm + 0.5 * tips.spacing_mm / curved.design.fruit.radius_mm
    needed = 0.5 * tips.side_mm * lean
    load = seating.load_index(0.5, -0.05)
    assert seating.loads[load - 1] < needed <= seating.loads[load]
    depth = curved.contact.S.diagonal() * seating.least_forces[load] / 0.5
    assert (depth >= tips.side_mm * lean * (1.0 - 1e-9)).all()
    assert seating.load_index(1e3, 1.0) == len(seating.loads) - 1
    assert seating_of(paper.measuring()).load_index(3.5, 0.0) == 0
    assert len(seating_of(mango.measuring()).loads) == 1
