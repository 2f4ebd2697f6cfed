"""A press of a square read by its rise: what noise makes is stated, what is the same in all samples drops out.

Forces are those of the contact engine or of boundary elements, which know nothing of the means that are read.
"""

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from measured_units import read_press, readings_at, stated_and_moved, with_heights, with_path, with_read_out
from refusal import refusal
from stored_presses import STORED, random_fruits, square

from instrument.firmware.firmware import render_header, render_module
from sensor.theory.contrast_rise import read_rise, select_rise
from solve.presses.pressing import press
from twintip.cli import main

E = 1.0
SHARES = np.linspace(0.05, 1.0, 30)
TILT = (1.0, -0.5)
DRAWS = 200


@pytest.fixture(scope="module")
def noisy(mango):
    """Return the mango with noise of 0.5 % of full scale in place of its read-out's, which is a hundredth of that."""
    noisy = copy.copy(mango)
    noisy.report = with_read_out(mango.measuring(), signal=None).report
    return noisy


@pytest.fixture(scope="module")
def going_in(mango):
    return forces_into_the_fruit(mango)


@pytest.fixture(scope="module")
def into_the_ball(ball):
    return forces_into_the_fruit(ball)


def forces_into_the_fruit(measured):
    """Return the forces [N] at thirty travels, the last one full, where all tips touch."""
    forces = measured.press(E, SHARES, tilt_deg=TILT)
    return forces[(forces > 0.02).all(axis=1)]


def test_noise_scatters_as_stated(noisy, going_in, rng):
    """A scatter of 200 draws is known to 5 %, so that three deviations are 15 %; a mean, to four of its own."""
    sensor = noisy.measuring()
    noise = sensor.noises * rng.normal(size=(DRAWS, *going_in.shape))
    readings = [read_press(sensor, going_in + each) for each in noise]
    moduli = np.array([reading.E for reading in readings]) / read_press(sensor, going_in).E
    assert abs(moduli.mean() - 1.0) < 4.0 * moduli.std() / np.sqrt(DRAWS) + moduli.std() ** 2
    assert np.mean([reading.noise for reading in readings]) == pytest.approx(2.0 * moduli.std(), rel=0.2)


def test_noise_falls_with_the_samples_and_the_rest_stays(noisy, going_in):
    sensor = noisy.measuring(percent=1.0, gain_percent=2.0)
    few, many = (read_press(sensor, np.repeat(going_in, count, axis=0)) for count in (1, 100))
    assert many.left == pytest.approx(few.left, rel=0.1)
    assert many.noise == pytest.approx(0.1 * few.noise, rel=0.1)
    assert many.u == pytest.approx(np.hypot(many.noise, many.left))


@pytest.mark.parametrize("calibrated_by", ["weights", "plate"])
@pytest.mark.parametrize("field", ["K_percent", "gain_percent"])
def test_springs_and_gains_widen_the_bar_by_what_they_move(noisy, going_in, field, calibrated_by):
    sensor = noisy.measuring()
    sensor = replace(sensor, unit=replace(sensor.unit, calibrated_by=calibrated_by))
    stated, moved = stated_and_moved(sensor, going_in, read_press, field, 1)
    assert stated == pytest.approx(moved, rel=0.03)


def test_zeros_that_are_off_or_drift_widen_the_bar_by_what_they_move(mango, going_in):
    """Both by the drift that the read-out allows for, a bound over root three; its slope is known to a tenth."""
    sensor = mango.measuring()
    plain = read_press(sensor, going_in)
    drift = np.array([0.0, 0.002, 0.0, 0.0])
    without, wider = (
        read_press(with_path(sensor, zero_drift_N=tuple(drifts.tolist())), going_in) for drifts in (0.0 * drift, drift)
    )
    since = np.linspace(0.0, 1.0, len(going_in))
    off = abs(read_press(sensor, going_in + drift).E / plain.E - 1.0)
    moved = abs(read_press(sensor, going_in + np.outer(since, drift)).E / plain.E - 1.0)
    assert np.sqrt(wider.u**2 - without.u**2) == pytest.approx(2.0 / math.sqrt(3.0) * math.hypot(off, moved), rel=0.12)


def test_heights_that_are_wrong_are_in_the_offset(mango, going_in):
    """The high tips are nearer than told by the mean of theirs, the low ones farther; E hardly moves."""
    sensor = mango.measuring()
    plain, moved = (read_press(each, going_in) for each in (sensor, with_heights(sensor, (0.0, -0.05, 0.02, -0.03))))
    assert pytest.approx(plain.E, rel=0.015) == moved.E
    assert moved.offset - plain.offset == pytest.approx(0.04 + 0.01, abs=2e-3)
    assert plain.tilt == pytest.approx(math.hypot(*TILT), rel=0.05)


@pytest.mark.parametrize("case", STORED["presses"], ids=lambda case: f"{case['E']}-{case['R1']}-{case['R2']}")
def test_presses_on_ellipsoids_lie_in_the_bar(ball, case):
    """Forces of boundary elements on a half-space, by a square whose fruit is told nowhere; then with its radii told.

    The travels reach beyond those of the design; its body is 12 mm thick, which moves E by less than 1 %.
    """
    sensor = ball.measuring()
    forces = np.array(case["forces"])
    found = read_press(sensor, forces)
    assert abs(found.E / case["E"] - 1.0) <= found.u < 0.35
    told = read_press(replace(sensor, radii_mm=(case["R1"], case["R2"])), forces)
    assert abs(told.E / case["E"] - 1.0) < min(0.04, told.u)
    assert told.u < found.u


def test_radii_that_are_told_leave_the_bar(ball, into_the_ball):
    """A ball of the design's own radius reads alike, with what the untold curvature adds taken off."""
    sensor = ball.measuring()
    untold, told = read_press(sensor, into_the_ball), read_press(replace(sensor, radii_mm=(35.0, 35.0)), into_the_ball)
    assert pytest.approx(untold.E, rel=1e-9) == told.E
    step = 1e-3
    radius = 35.0 / (1.0 + step)
    moved = abs(read_press(replace(sensor, radii_mm=(radius, radius)), into_the_ball).E / told.E - 1.0) / step
    assert np.sqrt(untold.u**2 - told.u**2) == pytest.approx(2.0 * 0.25 * moved, rel=0.1)


def test_radii_that_are_told_change_nothing_where_the_design_names_the_same_ones(mango, going_in):
    """A design that names the radii that occur has what they move E by in the source of its pose."""
    sensor = mango.measuring()
    fruit = mango.design.fruit
    told = read_press(replace(sensor, radii_mm=(fruit.radius_mm, fruit.radius_across_mm)), going_in)
    untold = read_press(sensor, going_in)
    assert (told.E, told.u) == pytest.approx((untold.E, untold.u), rel=1e-9)


@pytest.mark.parametrize("text", ["0,35", "35,40,45", "35;40", "nan", "0.5", "1e7", ""])
def test_radii_that_are_none_are_refused(text, ball, monkeypatch, capsys):
    monkeypatch.setattr("twintip.commands.read.read_report", lambda _: ball.report)
    assert main(["read", "folder", "press.csv", "--radius", text]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("pipeline: --radius")


def test_way_out_of_the_fruit_does_not_count(noisy, going_in):
    """A fruit that gives back nine tenths of its force on the way out reads as it did on the way in."""
    sensor = noisy.measuring()
    back = 0.9 * going_in[::-1]
    assert read_press(sensor, np.concatenate([going_in, back])) == read_press(sensor, going_in)


def test_a_report_without_readings_of_presses_is_refused(mango):
    sensor = mango.measuring()
    sensor = with_read_out(sensor, rise_level=())
    at_rest = lambda: readings_at(sensor, [0.0], np.zeros((1, 4)))  # noqa: E731
    for work in (at_rest, lambda: render_header(sensor), lambda: render_module(sensor)):
        assert refusal(work).field == "read_out.rise_level"


def test_a_signal_is_read_whole_once_a_press(noisy, going_in):
    """The first sample of a press serves the next one only."""
    air, count = np.zeros((3, 4)), len(going_in)
    rows = np.concatenate([air, going_in, going_in[-2::-1], air, 0.9 * going_in, air])
    times = 0.01 * np.arange(len(rows))
    sensor = noisy.measuring()
    readings = readings_at(sensor, times, rows)
    expected = [read_press(sensor, share * going_in).E for share in (1.0, 0.9)]
    assert [reading.E for reading in readings] == pytest.approx(expected, rel=1e-9)
    assert [reading.samples for reading in readings] == [count - 1] * 2
    assert [reading.t for reading in readings] == pytest.approx([0.01 * (2 + count), 0.01 * (4 + 3 * count)])
    every = readings_at(sensor, times, rows, every_sample=True)
    assert len(every) == 3 * count - 1
    assert pytest.approx(readings[0].E, rel=1e-12) == every[count - 1].E
    assert (every[0].E, every[0].flags) == (None, ("few_samples",))


@pytest.mark.parametrize("tip", range(4))
@pytest.mark.parametrize("modulus", [0.5, 3.5])
def test_a_zero_that_is_off_by_less_than_a_per_cent_is_no_touch(mango, tip, modulus):
    """On a turned saddle, where the tips touch one after the other: E moves as the slope of zeros tells, to a half.

    A slope is of first order, and the second is as large where a zero is a third of the force at the last touch. Taken
    for a touch, the same zero moves 3.5 MPa by more than half.
    """
    saddle = {"radii_mm": (45.0, 110.0), "azimuth_deg": 30.0, "tilt_deg": (1.5, 1.0), "from_touch": True}
    forces = mango.press(modulus, np.linspace(0.0, 1.0, 25)[1:], **saddle)
    sensor = mango.measuring()
    zero = 0.008 * np.array(sensor.report.read_out.full_scale_N)[tip]
    found = read_rise(sensor.rise_law, select_rise(forces, 4, sensor.least_forces), np.zeros(4))
    expected = found.slopes.zeros[tip] * zero
    moved = read_press(sensor, forces + zero * np.eye(4)[tip]).E / read_press(sensor, forces).E - 1.0
    assert abs(expected) < 0.03
    assert moved == pytest.approx(expected, rel=0.5, abs=1e-3)


@pytest.mark.study
def test_sixty_presses_of_cheeks_lie_in_the_bar(ball):
    """Own boundary elements: a mango's radii at any azimuth, tilts to 4 degrees, 0.9 mm from the first touch."""
    sensor = ball.measuring()
    errors, bars = [], []
    for fruit in random_fruits(60, seed=44):
        found = read_press(sensor, press(square(), fruit, np.linspace(0.03, 0.9, 30)))
        errors.append(abs(found.E / fruit.E - 1.0))
        bars.append(found.u)
        assert found.tilt == pytest.approx(fruit.tilt, rel=0.2, abs=0.1)
    assert np.mean(np.less_equal(errors, bars)) >= 0.95
    assert max(np.divide(errors, bars)) < 2.0
