"""Simulated units, presses and logs: forces against those of another program, and reading back what went in."""

from dataclasses import replace

import numpy as np
import pytest
from firmware_presses import BALL
from refusal import refusal

from instrument.calibrate.calibration import calibrate_unit, read_print_table
from instrument.calibrate.hard_plate import read_plate_table
from instrument.press.measuring import MeasuringUnit
from instrument.press.presses import readings_of
from instrument.press.printed_unit import unit_of
from instrument.press.signals import Signal
from instrument.simulate.bench_tables import plate_table, weights_table
from instrument.simulate.drawn_fruit import (
    add_bruise,
    beyond_design,
    draw_fruit,
    random_skin,
    usual_fruit,
)
from instrument.simulate.log import log_lines
from instrument.simulate.simulated_press import PRESS_MOMENTS, HandPress, press_curve
from instrument.simulate.simulation import SimulationSettings, designed_press, log_of_fruit, unit_of_seed
from instrument.simulate.unit import designed_unit, draw_unit, given_unit, refuse_unsimulated
from pipeline.options import load_design
from pipeline.tables.rows import Rows
from sensor.design.bench import Bench


def asked_of(report, **changes):
    of = {"presses": 1, "rate": 60.0, "noise": False, "uneven": False, "bruise_mm": None, "relaxation": (), "seed": 3}
    return SimulationSettings(**{"fruit": usual_fruit(report), **of, **changes})


def read_log(unit, lines):
    return list(readings_of(unit, Signal(Rows(lines, "press.csv"), len(unit.report.tips))))


@pytest.mark.parametrize(
    ("hand", "rate"),
    [
        ({}, 30.0),
        pytest.param({}, 200.0, marks=pytest.mark.slow),
        pytest.param({"tilt": (1.5, -2.0), "off_centre": (0.4, 0.3), "azimuth": 30.0}, 60.0, marks=pytest.mark.slow),
    ],
)
def test_a_press_of_the_design_is_read_back(hand, rate, mango):
    """The bias of the level middle of the fruit is 2 % at most; delays of channels are in the log of a slow one.

    Half a millimetre from the apex the normal leans by up to 0.7 degrees, which a wrong sign would double.
    """
    fruit = replace(usual_fruit(mango.report), **hand)
    lines = log_of_fruit(mango.report, designed_unit(mango.report), asked_of(mango.report, fruit=fruit, rate=rate))
    (found,) = read_log(mango.measuring(), lines)
    assert pytest.approx(fruit.E, rel=0.025 if not hand else 0.1) == found.E
    assert found.press_s == pytest.approx(3.0, abs=0.1)  # the lightest part is no touch
    assert found.tilt == pytest.approx(np.hypot(*fruit.tilt), abs=0.2 if hand else 0.1)
    if hand:
        assert found.direction == pytest.approx(np.degrees(np.arctan2(-2.0, 1.5)), abs=3.0)


@pytest.mark.parametrize("factor", [pytest.param(None, marks=pytest.mark.slow), 0.9])
def test_counts_of_a_unit_are_read_back(factor, mango):
    """Whatever its springs, its matrix of counts, the creep of its leaves, and what a ball tells of it."""
    K = mango.K * [0.8, 1.1, 1.3, 0.9]
    npc = np.diag(1e-6 * np.array([1.0, -2.0, 3.0, 4.0])) + 1e-8
    unit = replace(
        unit_of(mango.report, stiffnesses=K.tolist(), percent=[1.0] * 4, method="test"),
        newtons_per_count=tuple(map(tuple, npc.tolist())),
        zero_counts=(9.0, 8.0, 7.0, -6.0),
        saturation_counts=2**23 - 1,
    )
    if factor is not None:
        unit = replace(unit, ball=replace(BALL, factor=factor, form_percent=(0.0,) * 3))
    asked = asked_of(mango.report)
    lines = log_of_fruit(mango.report, given_unit(mango.report, unit), asked)
    assert lines[0] == "t_s,counts_1,counts_2,counts_3,counts_4"
    assert lines[1].split(",")[1:] == ["9", "8", "7", "-6"]
    (found,) = read_log(MeasuringUnit(report=mango.report, unit=unit), lines)
    assert pytest.approx(asked.fruit.E, rel=0.025) == found.E


def test_a_bench_finds_the_drawn_unit(mango, tmp_path):
    """The bars of the springs hold them: a plate by a fine gauge tells them to a thousandth."""
    report = mango.report
    unit = unit_of_seed(report, 5)
    weights, plate = (tmp_path / name for name in ("weights.csv", "plate.csv"))
    for path, table, bench in ((weights, weights_table, Bench()), (plate, plate_table, Bench(dial_mm=1e-4))):
        path.write_text("\n".join(table(report, unit, bench, np.random.default_rng(1))), encoding="utf-8")
    by_weights = calibrate_unit(report, read_print_table(weights, report)).unit
    pressed = read_plate_table(plate, report)
    by_plate = calibrate_unit(report, read_print_table(weights, report), plate=pressed).unit
    for found in (by_weights, by_plate):
        off = np.array(found.stiffnesses) / unit.domes.K - 1.0
        assert (np.abs(off) < 0.03 * np.array(found.K_percent)).all()
        assert found.zero_counts == pytest.approx(unit.zeros, abs=5.0 * unit.noise.max())


def test_draws_follow_the_seed_and_scatter_as_the_process(mango):
    report = mango.report
    one, same, other = (unit_of_seed(report, seed) for seed in (1, 1, 2))
    assert (one.domes.K == same.domes.K).all()
    assert (one.domes.K != other.domes.K).all()
    drawn = [draw_unit(report, np.random.default_rng(seed)) for seed in range(400)]
    nominal = designed_unit(report).domes
    process = report.design.process
    thickness = np.array(report.design.tips.each(*process.leaf_thicknesses_mm))
    expected = np.hypot(3.0 * 0.5 * process.accuracy_mm / thickness, process.E_scatter)
    scatter = np.std([np.log(each.domes.K / nominal.K) for each in drawn], axis=0)
    assert scatter == pytest.approx(expected, rel=0.15)
    assert np.std([each.heights for each in drawn]) == pytest.approx(0.5 * process.accuracy_mm, rel=0.1)
    assert np.std([each.domes.dome_radius for each in drawn]) > 0.02 * nominal.dome_radius
    assert np.mean([10.0**each.creep - 1.0 for each in drawn]) == pytest.approx(report.creep.per_decade, rel=0.1)


def test_drawn_fruits_lie_within_the_ranges_of_the_design(mango):
    rng = np.random.default_rng(2)
    drawn = [draw_fruit(mango.report, rng) for _ in range(200)]
    assert [list(beyond_design(each, mango.report)) for each in drawn] == 200 * [[]]
    E = np.log([each.E for each in drawn])
    assert np.ptp(E) > 0.95 * np.log(3.5 / 0.5)
    soft = np.log([each.softness for each in drawn])
    assert soft.std() == pytest.approx(0.01 * mango.design.fruit.flesh_scatter_percent, rel=0.1)


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({}, []),
        ({"E": 5.0}, ["E"]),
        ({"radii": (45.0, 200.0)}, ["radius across"]),
        ({"radii": (110.0, 45.0)}, []),
        ({"thickness": 3.0, "tilt": (4.0, 3.0)}, ["thickness", "tilt"]),
        ({"off_centre": (0.0, 2.0)}, ["distance from the apex"]),
    ],
)
def test_what_lies_outside_the_design_is_named(changes, names, mango):
    found = list(beyond_design(replace(usual_fruit(mango.report), **changes), mango.report))
    assert [text.rpartition(" is outside")[0].rsplit(" ", 2)[0] for text in found] == names


def test_waves_have_their_rms_at_rows_and_at_single_places():
    heights = random_skin(np.random.default_rng(4), 0.02, 2.0, 8.0)
    x, y = np.linspace(-40.0, 40.0, 200)[:, None], np.linspace(-40.0, 40.0, 180)[None, :]
    at_all = heights(*np.broadcast_arrays(x, y))
    assert at_all.std() == pytest.approx(0.02, rel=0.05)
    assert heights(x[7:8], y[:, 5:6])[0, 0] == pytest.approx(at_all[7, 5])


@pytest.mark.parametrize(("turn", "soft"), [(0.0, 0), (90.0, 3), (180.0, 2), (45.0, None)])
def test_a_bruise_stays_where_it_is_when_the_sensor_turns(turn, soft, mango):
    """Tips stand at (-1, -1), (1, -1), (1, 1), (-1, 1): turned by 90 degrees, the last is where the first was."""
    found = add_bruise(usual_fruit(mango.report), mango.report, 6.0, turn)
    assert [tip for tip, softness in enumerate(found.softness) if softness > 1.0] == ([] if soft is None else [soft])


def numbers_of(lines):
    """Return the rows of numbers of a log."""
    return np.array([row.split(",") for row in lines[1:]], dtype=float)


@pytest.mark.slow
def test_channels_come_one_after_the_other_in_a_log_of_the_read_out(mango):
    """On a ramp a channel that is converted later shows more; at a faster rate all have one time."""
    report = mango.report
    unit = replace(designed_unit(report), per_mm=np.eye(4))
    press = press_curve(unit, usual_fruit(report), designed_press(report))
    slow, fast = (numbers_of(log_lines(report, unit, [press], rate)) for rate in (42.0, 420.0))
    late = 1e3 * (np.interp(2.0, slow[:, 0], slow[:, 3]) - np.interp(2.0, fast[:, 0], fast[:, 3]))
    slope = 1e3 * np.gradient(fast[:, 3], fast[:, 0])[840]
    assert late == pytest.approx(slope * 1e-3 * report.read_out.signal.delay_ms[2], rel=0.1)


def test_the_curve_between_solved_samples(mango):
    """The way back is the way down, and nothing is shown before and after."""
    press = press_curve(designed_unit(mango.report), usual_fruit(mango.report), HandPress(travel=1.0, press_s=2.0))
    t = np.repeat(np.array([-1.0, 0.0, 1.0, 2.0, 2.5, 3.0, 9.0])[:, None], 4, axis=1)
    found = press.at(t)
    assert not found[[0, 1, 5, 6]].any()
    assert found[4] == pytest.approx(found[2])
    assert found[3] == pytest.approx(press.deflections[PRESS_MOMENTS - 1])


def test_designs_without_domes_or_with_a_skin_are_refused(mango):
    refuse_unsimulated(mango.report)
    assert refusal(refuse_unsimulated, replace(mango.report, design=load_design("paper"))).field == "tips.shape"
    skin = replace(
        mango.design,
        fruit=replace(mango.design.fruit, skin_mm=0.2, skin_E_MPa=20.0),
        reading=replace(mango.design.reading, calibrated_by="plate"),
    )
    assert refusal(refuse_unsimulated, replace(mango.report, design=skin)).field == "fruit.skin_mm"
