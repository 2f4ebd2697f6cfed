"""One reading: exact where nothing is off, each flag where its cause is planted, refused without every tip."""

import math
from dataclasses import replace

import numpy as np
import pytest
from measured_units import stated_and_moved, with_exact_tips, with_heights

from pipeline.measure.unit.presses import reading_of
from pipeline.measure.unit.ripeness import ripeness_classes
from pipeline.response.scene_press import scene_of
from solve.contact.domes.law import domes_on
from solve.contact.poses import Pose

FULL = 0.5  # [mm] travel of the square


RADII = (35.0, 35.0)  # told, so that no saddle is in the bar


def pressed(ball, E, **pose):
    return ball.forces([Pose(E=E, travel=FULL, **pose)])[0].tolist()


def on_ball(sensor):
    """Return a unit with tips as high as designed, on a fruit that is told to be the ball of its design."""
    return replace(with_exact_tips(sensor), radii_mm=RADII)


def test_level_square_reads_what_it_presses(ball):
    sensor = on_ball(ball.measuring(classes=ripeness_classes("ripe:0.8,unripe")))
    for E in (0.5, 0.81, 1.5, 3.5):
        reading = reading_of(sensor, pressed(ball, E))
        assert pytest.approx(E, rel=1e-3) == reading.E
        assert reading.reduced == pytest.approx(E / 0.91, rel=1e-3)
        assert reading.flags == ()
        assert reading.ripeness == ("ripe" if E <= 0.8 else "unripe")
        assert reading.tilt == pytest.approx(0.0, abs=0.05)


def test_tilt_and_its_direction_are_read(ball):
    for direction in (0.0, 90.0, -135.0):
        tilt = tuple(3.0 * np.array([math.cos(math.radians(direction)), math.sin(math.radians(direction))]))
        reading = reading_of(on_ball(ball.measuring()), pressed(ball, 1.0, tilt_deg=tilt))
        assert reading.tilt == pytest.approx(3.0, rel=0.05)
        assert reading.direction == pytest.approx(direction, abs=2.0)
        assert reading.flags == ()


def test_planted_causes_raise_their_flags(ball):
    sensor = on_ball(ball.measuring())
    upright = replace(sensor.design, reading=replace(ball.design.reading, tilt_deg=1.0))
    narrow = replace(sensor, report=replace(sensor.report, design=upright))
    forces = pressed(ball, 1.0, tilt_deg=(3.5, 0.0))
    assert reading_of(narrow, forces).flags == ("tilt_beyond_design",)
    assert reading_of(sensor, forces).flags == ()
    soft = reading_of(sensor, pressed(ball, 0.3))
    assert soft.flags == ("out_of_range",)
    assert pytest.approx(0.3, rel=0.01) == soft.E
    tender = replace(sensor.design, fruit=replace(ball.design.fruit, bruise_limit_MPa=0.04))
    bruised = replace(sensor, report=replace(sensor.report, design=tender))
    assert reading_of(bruised, pressed(ball, 0.6)).flags == ("press_over_bruise_limit",)
    for forces, flags in (
        ([0.0, 0.4, 0.06, 0.4], ("lift_off",)),
        ([-1.0, 0.4, 0.06, 0.4], ("bad_force", "lift_off")),
        ([math.nan, 0.4, 0.06, 0.4], ("bad_force", "lift_off")),
        ([0.06, 1e6, 0.06, 0.4], ("bad_force",)),
        ([0.4, 0.06, 0.4, 0.06], ("out_of_range",)),
    ):
        refused = reading_of(sensor, forces)
        assert (refused.E, refused.u, refused.flags) == (None, None, flags)


@pytest.mark.parametrize(("off", "bruises"), [(0.997, True), (1.003, False)])
def test_bruise_is_told_at_the_pressure_of_the_pressed_contact(off, bruises, ball):
    """Domes at full travel meet 1 % less flesh than Hertz says."""
    sensor = ball.measuring()
    contact = ball.contact
    scene = scene_of(ball.design)
    domes = domes_on(scene, contact, ball.C, [scene], np.array([0.8]), np.array([ball.design.press.travel_mm]))
    limit = off * float(domes.mean_pressure.max())
    tender = replace(ball.design, fruit=replace(ball.design.fruit, bruise_limit_MPa=limit))
    bruised = replace(sensor, report=replace(sensor.report, design=tender))
    assert bruised.bruises(domes.F[0], 0.8) is bruises


def test_saddle_that_is_not_told_is_in_the_bar_of_a_single_moment(ball):
    """A square feels 2 a^2 k sin 2 azimuth between its diagonals, with k = 0.4 / 35 per mm under domes that roll."""
    sensor = with_exact_tips(ball.measuring())
    forces = pressed(ball, 1.0)
    untold, told = reading_of(sensor, forces), reading_of(on_ball(sensor), forces)
    assert (untold.flags, told.flags) == (("uncertain",), ())
    contrast = 2.0 * 3.0**2 * 0.4 / 35.0 / math.sqrt(2.0) / (1.0 + 10.0 / 35.0) ** 2
    step = 1e-5
    moved = abs(reading_of(with_heights(sensor, (0.0, step, 0.0, step)), forces).E / untold.E - 1.0) / step
    assert np.sqrt(untold.u**2 - told.u**2) == pytest.approx(2.0 * contrast * moved, rel=0.01)


@pytest.mark.parametrize("calibrated_by", ["weights", "plate"])
@pytest.mark.parametrize("field", ["K_percent", "gain_percent"])
def test_springs_and_gains_widen_the_uncertainty_by_what_they_move(field, calibrated_by, ball):
    sensor = ball.measuring()
    sensor = replace(sensor, unit=replace(sensor.unit, calibrated_by=calibrated_by))
    stated, moved = stated_and_moved(sensor, np.array(pressed(ball, 1.0)), reading_of, field, 1)
    assert stated == pytest.approx(moved, rel=0.02)


def test_heights_of_tips_widen_the_uncertainty_by_what_they_move(ball):
    """A process of 0.05 mm, two sigma, leaves each tip 0.025 mm; a micrometre of each moves E by so much less."""
    sensor = ball.measuring()
    forces = pressed(ball, 1.0)
    plain = reading_of(sensor, forces)
    moved = [reading_of(with_heights(sensor, 1e-3 * tip), forces).E / plain.E - 1.0 for tip in np.eye(4)]
    without = reading_of(with_exact_tips(sensor), forces)
    expected = 2.0 * 25.0 * np.linalg.norm(moved)
    assert np.sqrt(plain.u**2 - without.u**2) == pytest.approx(expected, rel=0.02)


def test_bias_of_a_design_is_in_the_uncertainty_as_a_bound(ball):
    """Over the root of three, 95 % of two sigma; between moduli along the logarithm."""
    sensor = ball.measuring()
    rows = [replace(sensor.report.moduli[0], E_MPa=E, E_bias_percent=bias) for E, bias in ((0.5, 4.0), (2.0, -8.0))]
    u = []
    for moduli in (tuple(rows), ()):
        report = replace(sensor.report, moduli=moduli)
        u.append(reading_of(replace(sensor, report=report), pressed(ball, 1.0)).u)
    assert np.sqrt(u[0] ** 2 - u[1] ** 2) == pytest.approx(2.0 * 0.06 / np.sqrt(3.0), rel=1e-3)


def test_spread_of_poisson_s_ratio_is_in_the_uncertainty_of_E(ball):
    """By the derivative of 1 - nu^2, in squares beside what is there without it."""
    sensor = ball.measuring()
    forces = pressed(ball, 1.0)
    u = []
    for spread in (0.05, 0.0):
        design = replace(ball.design, fruit=replace(ball.design.fruit, poisson=0.4, poisson_spread=spread))
        u.append(reading_of(replace(sensor, report=replace(sensor.report, design=design)), forces).u)
    assert u[0] == pytest.approx(math.hypot(u[1], 2.0 * 2.0 * 0.4 * 0.05 / (1.0 - 0.4**2)))
