"""Presses on a reference ball: the factor that they give a unit, and what they leave of its errors."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measured_units import read_press, text_of
from refusal import refusal
from virtual_compression import VirtualTest

from instrument.calibrate.reference_presses import (
    PressedBall,
    ReferenceBall,
    deep_press,
    fit_ball_correction,
    measure_ball_correction,
    reference_ball,
)
from instrument.calibrate.unit_table import error_sources, level_press, read_without_noise, unit_table
from instrument.calibrate.unit_verdicts import unit_verdicts
from instrument.press.fruit_reading import FruitReading
from sensor.quantity import UNIFORM_DEVIATION
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes
from solve.presses.pressing import press
from twintip.cli import main

RADIUS = 40.0  # mm
FIRM = 1.3  # MPa, the modulus of a fruit that presses as the ball does
RUBBER = FIRM * (1.0 - 0.5**2) / (1.0 - 0.3**2)
BALL = ReferenceBall(E_MPa=RUBBER, radius_mm=RADIUS, percent=1.0)
DEEP = 79.0  # mm
TILTS = ((0.0, 0.0), (1.0, 0.5), (-0.5, 1.0))


def log_of(presses, press_s=3.0):
    """Return the text of a log of presses of forces (samples, tips) [N], each of a duration [s]."""
    rows, t = [], 0.0
    for forces in presses:
        for row in [np.zeros(4), *forces, np.zeros(4)]:
            rows.append([t, *row.tolist()])
            t += press_s / len(forces)
        t += 10.0
    return text_of("t_s,F_1_N,F_2_N,F_3_N,F_4_N", rows)


@pytest.fixture
def on_ball(mango, tmp_path):
    """Return a function that corrects a unit by presses of forces, (samples, tips) [N]."""

    def correction(presses, ball=BALL, sensor=None, **timing):
        path = tmp_path / "ball.csv"
        path.write_text(log_of(presses, **timing), encoding="utf-8")
        return measure_ball_correction(PressedBall(source=path, ball=ball), sensor or mango.measuring())[0]

    return correction


@pytest.fixture(scope="module")
def presses(mango):
    """Return presses of the engine on deep flesh of a ball, each at another tilt."""
    ball = {"radii_mm": (RADIUS, RADIUS), "thickness_mm": DEEP}
    return [mango.press(FIRM, np.linspace(0.15, 1.0, 30), tilt_deg=tilt, **ball) for tilt in TILTS]


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.2])
def test_factor_is_that_of_forces_that_are_all_off(scale, mango, on_ball, presses):
    """E is proportional to all forces with their springs. The engine's bias beside its design is within 1.5 %."""
    found = on_ball([forces / scale for forces in presses], sensor=mango.measuring(1.0 / scale))
    assert found.factor == pytest.approx(scale, rel=0.015)
    assert (found.E_MPa, found.radius_mm) == (pytest.approx(FIRM), RADIUS)
    # By the ball 1 %, by zeros that drift 1.3 % over the forces, by the model 0.6 %, and a little scatter.
    assert found.percent == pytest.approx(math.hypot(1.0, 1.3 * scale, 0.6), abs=0.15)


def test_presses_that_scatter_widen_the_factor(mango, on_ball, presses):
    """A median of three has pi / 2 of the variance of a mean, and t of 2 is 4.303.

    A log has samples of air beside those of a press, which move a reading by some thousandths.
    """
    scattered = [presses[0] * factor for factor in (0.98, 1.0, 1.02)]
    found = on_ball(scattered)
    read = [read_press(mango.measuring().for_ball(RADIUS), forces).E for forces in scattered]
    scatter = np.std(np.log(read), ddof=1) * math.sqrt(0.5 * math.pi / 3.0) * 4.303 / 2.0
    assert scatter > 0.01
    alike = on_ball(3 * [presses[0]]).percent  # the ball, zeros, times and contact model
    assert found.percent == pytest.approx(math.hypot(alike, 100.0 * scatter), rel=0.01)


def test_what_moves_all_presses_alike_is_in_the_error_of_the_factor(mango):
    """A zero is off from the first sample on, or drifts during each press: presses do not scatter by it."""
    sensor = mango.measuring()
    exact = replace(BALL, percent=1e-9)

    def factor(forces):
        reading = read_press(sensor.for_ball(RADIUS), forces)
        return fit_ball_correction([reading] * 3, exact, sensor, "ball.csv")

    forces, _ = deep_press(sensor.for_ball(RADIUS), FIRM)
    plain = factor(forces)
    moved = []
    for tip, bound in enumerate(sensor.report.read_out.channels.zero_drift_N):
        for course in (np.ones(len(forces)), np.linspace(0.0, 1.0, len(forces))):
            off = np.array(forces)
            off[:, tip] += UNIFORM_DEVIATION * bound * course
            moved.append(factor(off).factor / plain.factor - 1.0)
    assert math.hypot(*moved) > 0.01
    expected = math.hypot(*moved, UNIFORM_DEVIATION * sensor.model_error)
    # The slope of a drift leaves out the saddle that it is taken for, which lessens it by up to a tenth.
    assert expected < 0.01 * plain.percent < 1.1 * expected


def test_times_that_are_not_known_are_in_the_error_of_the_factor(mango, presses):
    """They are those of the log: a line that comes sooner than the read-out converts has channels of any time."""
    sensor = mango.measuring()
    reading = read_press(sensor.for_ball(RADIUS), presses[0])
    known, unknown = (
        fit_ball_correction([replace(reading, time_s=time_s)] * 3, BALL, sensor, "ball.csv").percent
        for time_s in (0.0, 0.006)
    )
    on_ball = sensor.for_ball(RADIUS)
    slopes = deep_press(on_ball, FIRM)[1].slopes
    assert unknown**2 - known**2 == pytest.approx((100.0 * 0.006) ** 2 * np.square(slopes.times).sum())


@pytest.mark.parametrize("press_s", [1.5, 6.0])
def test_creep_is_known_from_the_duration_of_presses_on_a_ball(press_s, mango, on_ball, presses):
    sensor = mango.measuring()
    sensor = replace(sensor, unit=replace(sensor.unit, creep_per_decade=None, creep_error=None))
    found = on_ball(presses, sensor=sensor, press_s=press_s)
    assert found.press_s == pytest.approx(press_s, rel=0.05)
    law = sensor.creep
    for duration in (found.press_s, 10.0 * found.press_s):
        decades = math.log10(duration / found.press_s)
        expected = math.hypot(decades * law.error / (1.0 + law.per_decade), UNIFORM_DEVIATION * law.exponent)
        corrected = replace(sensor, unit=replace(sensor.unit, ball=found))
        assert corrected.channels_in(0.0, duration).creep == pytest.approx(expected)


def test_independent_presses_of_wrong_domes_are_read_right_after_a_ball(mango, on_ball):
    """Domes 6 % rounder with a pointed apex, pressed by boundary elements on rubber, then on a fruit as round.

    Both discretisations leave 0.5 %, the rubber's law and that of the fruit 0.5 %.
    """
    tips = mango.design.tips
    sensor = SprungDomes(
        dome_radius=0.94 * tips.dome_radius_mm,
        positions=np.array([(place.x, place.y) for place in tips.places_mm]),
        K=mango.K,
        form=lambda r: 0.02 * np.maximum(1.0 - np.square(r / 3.0), 0.0) ** 2,
    )
    x = mango.design.press.travel_mm * np.linspace(0.2, 1.0, 12)
    rubber = EllipsoidFruit(E=RUBBER, R1=RADIUS, R2=RADIUS, poisson=0.5)
    correction = on_ball([press(sensor, rubber, x)] * 3)
    plain = mango.measuring()
    corrected = replace(plain, unit=replace(plain.unit, ball=correction))
    forces = press(sensor, EllipsoidFruit(E=FIRM, R1=RADIUS, R2=RADIUS), x)
    before, after = (read_press(replace(each, radii_mm=(RADIUS, RADIUS)), forces) for each in (plain, corrected))
    assert abs(before.E / FIRM - 1.0) > 0.05
    # A fruit is as deep as that of the design, these presses are on a half-space: by which both differ.
    on_deep = plain.for_ball(RADIUS)
    deep = on_deep.correct_modulus(deep_press(on_deep, FIRM)[1].E)
    assert after.E / deep == pytest.approx(1.0, abs=0.01)
    assert after.u < before.u


def with_ball(sensor, factor=None, **ball):
    """Return a unit as three exact presses on a ball correct it, or with another factor."""
    ball = replace(BALL, **ball)
    found = deep_press(sensor.for_ball(ball.radius_mm), FIRM)[1]
    reading = FruitReading(E=sensor.for_ball(ball.radius_mm).correct_modulus(found.E))
    correction = fit_ball_correction([reading] * 3, ball, sensor, "ball.csv")
    return replace(sensor, unit=replace(sensor.unit, ball=replace(correction, factor=factor or correction.factor)))


def test_form_is_that_of_the_report_less_what_a_ball_shows(mango):
    sensor = mango.measuring()
    corrected = with_ball(sensor)
    *left, own = corrected.form_deviations(FIRM)
    assert own == pytest.approx(0.01 * corrected.unit.ball.percent)
    # The fruit of the design are less round than the ball: a tenth of 4 to 8 % is left.
    assert math.hypot(*left) < 0.01
    for row in mango.report.moduli:
        plain = sensor.form_deviations(row.E_MPa)
        assert plain == pytest.approx([0.01 * each for each in row.form_percent])
        assert math.hypot(*corrected.form_deviations(row.E_MPa)[:-1]) < 0.4 * math.hypot(*plain)


@pytest.mark.parametrize("radius", [20.0, 80.0])
def test_a_ball_of_another_radius_leaves_more(radius, mango):
    """What it moves otherwise is in the bar."""
    near, far = (with_ball(mango.measuring(), radius_mm=each).form_deviations(FIRM)[:-1] for each in (53.0, radius))
    assert math.hypot(*far) > math.hypot(*near)


def test_reports_without_a_form_have_none_and_take_no_ball(mango, on_ball, presses):
    sensor = mango.measuring()
    rows = tuple(replace(row, form_percent=()) for row in mango.report.moduli)  # of an older version
    sensor = replace(sensor, report=replace(mango.report, moduli=rows))
    assert sensor.form_deviations(FIRM) == []
    assert refusal(on_ball, presses, sensor=sensor).field == "reading.moduli.form_percent"
    assert with_ball(sensor).form_deviations(FIRM) == [pytest.approx(0.01 * with_ball(sensor).unit.ball.percent)]


def test_springs_and_gains_are_left_as_far_as_they_move_fruit_otherwise_than_the_ball(mango):
    """On the ball itself nothing is left of them, but for gains that drift with the temperature."""
    sensor = with_ball(mango.measuring(percent=1.0, gain_percent=5.0))
    channels = sensor.channels
    shown = channels.on_ball
    on_ball = channels.spring_and_gain_uncertainty(shown.springs, shown.gains)
    drift = 0.01 * UNIFORM_DEVIATION * np.array(sensor.report.read_out.channels.gain_drift_percent)
    assert on_ball["stiffness"] == on_ball["gain"] == 0.0
    assert on_ball["gain_drift"] == pytest.approx(np.linalg.norm(drift * shown.gains))
    other = channels.spring_and_gain_uncertainty(1.5 * shown.springs, shown.gains)
    assert other["stiffness"] == pytest.approx(0.01 * np.linalg.norm(0.5 * shown.springs))
    static = np.sqrt(0.05**2 - drift**2)
    other = channels.spring_and_gain_uncertainty(shown.springs, 1.5 * shown.gains)
    assert other["gain"] == pytest.approx(np.linalg.norm(0.5 * static * shown.gains))


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_reading_is_multiplied(factor, mango, presses):
    sensor = mango.measuring()
    plain = read_press(sensor, presses[0])
    assert pytest.approx(factor * plain.E) == read_press(with_ball(sensor, factor=factor), presses[0]).E
    assert with_ball(sensor, factor=factor).uncorrected_modulus(factor * plain.E) == pytest.approx(
        sensor.uncorrected_modulus(plain.E)
    )


def test_a_unit_is_no_better_without_a_ball(mango):
    """Its table and its verdict hold the form of the domes, as its readings do; a ball is what would mend it."""
    sensor = mango.measuring(percent=0.5, gain_percent=0.1)
    sensor = replace(sensor, unit=replace(sensor.unit, calibrated_by="plate"))
    corrected = with_ball(sensor)
    plain, after = (unit_table(each, mango.measuring()) for each in (sensor, corrected))
    for without, row in zip(plain, after, strict=True):
        assert row.u < without.u
        slopes = read_without_noise(sensor, level_press(sensor, without.E)).slopes
        by_unit = sensor.channels.spring_and_gain_uncertainty(np.array(slopes.springs), np.array(slopes.gains))
        assert without.u == pytest.approx(2.0 * math.hypot(*sensor.form_deviations(without.E), *by_unit.values()))
    assert "the form of the domes" in error_sources(sensor)
    (verdict,) = unit_verdicts(sensor, plain)
    assert verdict.value > 0.08
    assert (verdict.passed, "--ball" in verdict.remedy) == (False, True)
    (verdict,) = unit_verdicts(corrected, after)
    assert (verdict.passed, verdict.remedy) == (True, None)


PAGE = (Path(__file__).parents[3] / "docs" / "read-a-fruit.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_page_s_commands_take_a_ball_from_the_plates_to_the_factor(mango, presses, monkeypatch, tmp_path, capsys):
    """Whatever nu is, the ball that was compressed and the fruit of the engine have the same E / (1 - nu^2).

    A fourth press on the ball has three samples only, and does not count.
    """
    monkeypatch.setattr("twintip.commands.calibrate.read_report", lambda _: mango.report)
    monkeypatch.chdir(tmp_path)
    reduced = mango.measuring().reduced(FIRM)
    test = VirtualTest(E_MPa=reduced * (1.0 - 0.3**2), radius_mm=RADIUS, noise_percent=0.1)
    weighed = []
    for tip, K in zip(mango.report.tips, mango.K, strict=True):
        weighed += [[tip.name, g, 9.80665e-3 * g / K] for g in (0, 10, 20)]
    Path("rubber.csv").write_text(test.csv(), encoding="utf-8")
    Path("weights.csv").write_text(text_of("tip,weight_g,deflection_mm", weighed), encoding="utf-8")
    Path("ball.csv").write_text(log_of([*presses, presses[0][:3]]), encoding="utf-8")
    by_plates, by_presses = re.findall(r"^    pipeline (\w+ .*--(?:poisson|ball) .*)$", PAGE, re.MULTILINE)
    assert main(by_plates.split()) == 0
    (found,) = json.loads(capsys.readouterr().out)
    # The curve of this ball is that of nu 0.3. Those of 0.3 to 0.49 differ by 6 %, which is beyond the error of nu.
    assert found["E_over_1_minus_nu2_MPa"] == pytest.approx(reduced, rel=0.06)
    words = [*by_presses.split(), "--json"]
    words[words.index("--ball-reduced-modulus") + 1] = str(found["E_over_1_minus_nu2_MPa"])
    words[words.index("--ball-modulus-error") + 1] = str(found["u_percent"])
    main(words)
    told = json.loads(capsys.readouterr().out)
    ball, creep = told["ball"], told["K_press_over_weighed"]
    assert ball["E_MPa"] == pytest.approx(FIRM * found["E_over_1_minus_nu2_MPa"] / reduced)
    assert ball["factor"] == pytest.approx(ball["E_MPa"] / FIRM / creep, rel=0.015)  # the engine's bias, as above
    assert told["ball_presses"] == {"counted": 3, "presses": 4, "flags": {"few_samples": 1}}


def test_presses_that_scatter_too_far_are_refused(mango):
    """The half width of a median of three is 4.303 sqrt(pi / 6) = 3.11 standard deviations, here apart."""
    sensor = mango.measuring()
    E = deep_press(sensor.for_ball(RADIUS), FIRM)[1].E
    near, far = ([FruitReading(E=E * math.exp(step * apart)) for step in (-1.0, 0.0, 1.0)] for apart in (0.03, 0.035))
    assert fit_ball_correction(near, BALL, sensor, "ball.csv").percent > 4.0
    told = refusal(fit_ball_correction, far, BALL, sensor, "ball.csv")
    assert told.field.startswith("ball.csv: error of the factor")
    assert told.value == pytest.approx(3.5 * 4.303 * math.sqrt(math.pi / 6.0), rel=1e-3)


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"reduced_MPa": math.nan}, "--ball-reduced-modulus"),
        ({"reduced_MPa": 0.0}, "--ball-reduced-modulus"),
        ({"radius_mm": -40.0}, "--ball-radius"),
        ({"u_percent": 0.0}, "--ball-modulus-error"),
        ({"u_percent": 0.02}, "--ball-modulus-error"),  # a fraction, typed for a percentage
        ({"u_percent": 51.0}, "--ball-modulus-error"),
    ],
)
def test_numbers_of_a_ball_beyond_their_bounds_are_refused(changed, field):
    numbers = {"reduced_MPa": RUBBER / 0.75, "radius_mm": RADIUS, "u_percent": 2.0}
    told = reference_ball(**numbers)
    assert (told.E_MPa, told.radius_mm, told.percent) == (pytest.approx(RUBBER), RADIUS, 1.0)
    assert refusal(reference_ball, **{**numbers, **changed}).field == field


@pytest.mark.parametrize(
    ("ball", "chosen", "scale", "field"),
    [
        ({"radius_mm": 15.0}, slice(None), 1.0, "--ball-radius"),
        ({"E_MPa": 0.1}, slice(None), 1.0, "--ball-reduced-modulus"),
        ({"E_MPa": 30.0}, slice(None), 1.0, "--ball-reduced-modulus"),
        ({}, slice(2), 1.0, None),
        ({}, slice(None), 2.2, None),
    ],
)
def test_presses_that_tell_no_factor_are_refused(ball, chosen, scale, field, mango, on_ball, presses, tmp_path):
    scaled = [forces / scale for forces in presses[chosen]]
    told = refusal(on_ball, scaled, ball=replace(BALL, **ball), sensor=mango.measuring(1.0 / scale))
    assert told.field.startswith(field or str(tmp_path / "ball.csv"))
