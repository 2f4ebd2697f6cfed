"""One press: exact where nothing is off, each flag where its cause is planted, refused without every tip."""

import math
from dataclasses import replace

import numpy as np
import pytest
from measured_units import read_press, with_design, with_exact_tips
from refusal import refusal

from instrument.press.half_width import Deviations, half_width
from instrument.press.pair_press import single_reading
from instrument.press.ripeness import ripeness_classes
from pipeline.reading.reading_records import UnevenFruit
from pipeline.response.scene_press import scene_of
from sensor.theory.contrast_rise import read_rise, select_rise
from solve.contact.domes.fruit_under_domes import fruit_under_domes
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.pose_forces import Pose, Stand

TRAVELS = np.linspace(0.0, 0.5, 41)[1:]  # [mm] of the square
READ_OFF = Deviations(independent=[0.01])


def pressed(ball, E, **pose):
    return ball.forces([Pose(E=E, travel=x, stand=Stand(**pose)) for x in TRAVELS.tolist()])


def test_level_square_reads_what_it_presses(ball):
    sensor = ball.measuring(classes=ripeness_classes("ripe:0.8,unripe"))
    for E in (0.5, 0.81, 1.5, 3.5):
        reading = read_press(sensor, pressed(ball, E))
        assert pytest.approx(E, rel=1e-3) == reading.E
        assert reading.reduced == pytest.approx(E / 0.91, rel=1e-3)
        assert reading.flags == ()
        assert reading.ripeness == ("ripe" if E <= 0.8 else "unripe")
        assert reading.tilt == pytest.approx(0.0, abs=0.05)


def test_tilt_and_its_direction_are_read(ball):
    for direction in (0.0, 90.0, -135.0):
        tilt = tuple(3.0 * np.array([math.cos(math.radians(direction)), math.sin(math.radians(direction))]))
        reading = read_press(ball.measuring(), pressed(ball, 1.0, tilt_deg=tilt))
        assert reading.tilt == pytest.approx(3.0, rel=0.05)
        assert reading.direction == pytest.approx(direction, abs=2.0)
        assert reading.flags == ()


@pytest.mark.parametrize(("beyond", "flags"), [(1.8, ()), (2.2, ("tilt_beyond_design",))])
def test_tilts_that_heights_of_tips_may_show_are_no_tilts_of_the_hand(beyond, flags, ball):
    """A line through heights of 0.05 mm at four corners 6 mm apart has a slope of 0.05 / 6; domes roll as they tilt."""
    sensor = ball.measuring()
    narrow = with_design(sensor, reading=replace(ball.design.reading, tilt_deg=1.0))
    deviation = math.degrees(0.5 * ball.design.process.accuracy_mm / 6.0 * sensor.domes.rolling_factor)
    assert narrow.tilt_deviation_deg == pytest.approx(deviation, rel=1e-3)
    forces = pressed(ball, 1.0, tilt_deg=(narrow.steepest_deg + beyond * deviation, 0.0))
    assert read_press(narrow, forces).flags == flags


def test_planted_causes_raise_their_flags(ball):
    sensor = ball.measuring()
    narrow = with_design(sensor, reading=replace(ball.design.reading, tilt_deg=1.0))
    forces = pressed(ball, 1.0, tilt_deg=(3.5, 0.0))
    assert read_press(narrow, forces).flags == ("tilt_beyond_design",)
    assert read_press(sensor, forces).flags == ()
    soft = read_press(sensor, pressed(ball, 0.3))
    assert soft.flags == ("out_of_range",)
    assert pytest.approx(0.3, rel=0.01) == soft.E
    bruised = with_design(sensor, fruit=replace(ball.design.fruit, bruise_limit_MPa=0.04))
    assert read_press(bruised, pressed(ball, 0.6)).flags == ("press_over_bruise_limit",)


def test_moments_of_a_pair_that_tell_nothing_have_their_flags(paper):
    for forces, flags in (
        ([0.0, 1.0], ("lift_off",)),
        ([-1.0, 1.0], ("bad_force", "lift_off")),
        ([math.nan, 1.0], ("bad_force", "lift_off")),
        ([0.4, 1e6], ("bad_force",)),
        ([1.0, 0.4], ("out_of_range",)),
    ):
        refused = single_reading(paper.measuring(), np.array(forces))
        assert (refused.E, refused.u, refused.flags) == (None, None, flags)


@pytest.mark.parametrize(("off", "bruises"), [(0.997, True), (1.003, False)])
def test_bruise_is_told_at_the_pressure_of_the_pressed_contact(off, bruises, ball):
    """Domes at full travel meet 1 % less flesh than Hertz says."""
    sensor = ball.measuring()
    contact = ball.contact
    scene = scene_of(ball.design)
    poses = dome_poses([scene], np.array([ball.design.press.travel_mm]))
    domes = dome_forces(poses, np.array([0.8]), ball.C, fruit_under_domes(scene, contact, [scene.fruit]))
    limit = off * float(domes.mean_pressure.max())
    bruised = with_design(sensor, fruit=replace(ball.design.fruit, bruise_limit_MPa=limit))
    assert bruised.bruises(domes.F[0], 0.8) is bruises


def test_heights_of_tips_widen_the_uncertainty_as_a_saddle_does(ball):
    """A process of 0.05 mm, two sigma, leaves each tip 0.025 mm; a saddle moves the contacts to each other."""
    sensor = ball.measuring()
    forces = pressed(ball, 1.0)
    plain, without = read_press(sensor, forces), read_press(with_exact_tips(sensor), forces)
    law, found = sensor.rise_law, plain.E
    step = 1e-3
    rise = select_rise(forces, 4)
    moved, still = (
        read_rise(replace(law, contrast=contrast, rolling=None), rise, sensor.noises).E
        for contrast in (law.with_offset(step), law.contrast)
    )
    per_mm = abs(moved / still - 1.0) / step
    contrast = 0.025 * np.linalg.norm(law.contrast.weights)
    assert pytest.approx(1.0, rel=1e-2) == found
    assert np.sqrt(plain.u**2 - without.u**2) == pytest.approx(2.0 * contrast * per_mm, rel=0.05)


def test_what_fruit_and_poses_leave_open_is_that_of_the_design(ball):
    """Between moduli along the logarithm, 2 % at 1 MPa; squares add. A report of an older version has no unevenness."""
    sensor = ball.measuring()
    none = UnevenFruit(skin_percent=0.0, flesh_percent=0.0, one_press_percent=0.0, presses=3.0, presses_percent=0.0)

    def widths(sources, uneven):
        rows = []
        for E, percent in ((0.5, 1.0), (2.0, 3.0)):
            share = sources * percent
            named = {"pose_percent": share, "thickness_percent": 2.0 * share, "poisson_percent": 0.0}
            fruit = uneven and replace(none, skin_percent=3.0 * uneven * percent, flesh_percent=4.0 * uneven * percent)
            rows.append(replace(sensor.report.moduli[0], E_MPa=E, sources=named, fruit=fruit))
        return half_width(replace(sensor, report=replace(sensor.report, moduli=tuple(rows))), 1.0, READ_OFF)

    plain, posed, uneven = widths(0.0, None), widths(1.0, None), widths(0.0, 1.0)
    assert posed.independent == plain.independent
    assert posed.undetermined == pytest.approx(math.hypot(plain.undetermined, 2.0 * 0.02))
    assert posed.shared == pytest.approx(math.hypot(plain.shared, 2.0 * 2.0 * 0.02))
    assert uneven.independent == pytest.approx(math.hypot(plain.independent, 2.0 * 0.02 * 5.0))
    assert (uneven.undetermined, uneven.shared) == (plain.undetermined, plain.shared)


def test_sources_that_an_old_report_lacks_are_asked_for(ball):
    sensor = ball.measuring()
    old = replace(sensor.report.moduli[0], sources={"pose_percent": 1.0})
    refusal(half_width, replace(sensor, report=replace(sensor.report, moduli=(old,))), 1.0, READ_OFF)


def test_spread_of_poisson_s_ratio_is_in_the_uncertainty_of_E(paper):
    """By the derivative of 1 - nu^2; a spread is two standard deviations, as a half width is."""
    sensor = paper.measuring()
    u = []
    for spread in (0.05, 0.0):
        fruit = replace(paper.design.fruit, poisson=0.4, poisson_spread=spread)
        u.append(half_width(with_design(sensor, fruit=fruit), 1.0, READ_OFF).total)
    assert u[0] == pytest.approx(math.hypot(u[1], 2.0 * 0.4 * 0.05 / (1.0 - 0.4**2)))
