"""What a bench leaves of springs and gains, against formulas of least squares; and the benches that are refused."""

from dataclasses import replace

import numpy as np
import pytest
from flat_square import square_contact, square_design, square_springs
from refusal import refusal
from stand_ins import with_compliance

from pipeline.find.fruit_design import PRESETS
from pipeline.options import RunOptions, load_design
from pipeline.reading.analysis import analyse_readings
from pipeline.reading.bench_uncertainty import calibration_errors
from pipeline.sensor import Sensor
from pipeline.verdicts.rules import calibration_verdict
from sensor.design.bench import Bench
from sensor.quantity import STANDARD_GRAVITY
from sensor.theory.hertz import force_factor

N_PER_G = 1e-3 * STANDARD_GRAVITY
FULL = np.array([0.064, 0.67, 0.064, 0.67])  # [N]
K = np.array([0.056, 0.635, 0.056, 0.635])  # [N/mm]
NOISES = 1e-4 * FULL
DIGIT = 12.0**-0.5  # deviation of a rounded number
UNSET = {"reading.stiffness_percent": "", "reading.gain_percent": ""}
KITCHEN = {"bench.balance_g": 1.0, "bench.balance_max_g": 2000.0, "bench.dial_mm": 0.1}
LABORATORY = {"bench.balance_g": 0.001, "bench.dial_mm": 0.001}


def designed(**settings):
    return load_design("mango", {**UNSET, **{key.replace("__", "."): value for key, value in settings.items()}})


def slope_error(deviation, largest, fractions):
    """Return the relative error of a slope through readings at fractions of a largest one, by least squares."""
    return deviation / (largest * np.linalg.norm(fractions - np.mean(fractions)))


def by_weights(balance=0.01, most=200.0, dial=0.01):
    """Return what balance, dial and noise leave over six readings, each [1] of each tip."""
    sixths = np.linspace(0.0, 1.0, 6)
    loads = np.minimum(0.9 * FULL, N_PER_G * most)
    return (
        slope_error(DIGIT * N_PER_G * balance, loads, sixths),
        slope_error(DIGIT * dial, loads / K, sixths),
        slope_error(NOISES, loads, sixths),
    )


@pytest.mark.parametrize(
    ("bench", "numbers", "by"),
    [
        ({}, {}, "dial"),
        ({"bench__balance_g": 0.5}, {"balance": 0.5}, "balance"),
        ({"bench__dial_mm": 0.1}, {"dial": 0.1}, "dial"),
        ({"bench__balance_max_g": 20.0}, {"most": 20.0}, "dial"),
    ],
)
def test_weights_leave_the_digits_of_balance_and_dial(bench, numbers, by):
    left = calibration_errors(designed(reading__calibrated_by="weights", **bench), FULL, K, NOISES)
    balance, dial, noise = by_weights(**numbers)
    assert left.stiffness_percent == pytest.approx((100.0 * np.hypot(balance, dial)).tolist(), rel=1e-9)
    assert left.gain_percent == pytest.approx((100.0 * np.hypot(balance, noise)).tolist(), rel=1e-9)
    assert (left.by, left.typed) == (by, ())


@pytest.mark.parametrize("calibrated_by", ["plate", "ball"])
def test_a_plate_calibrates_deflections_whatever_the_dial(calibrated_by):
    """Over five travels, a fifth of the deepest to all of it, which the tip of the least deflection limits."""
    design = designed(reading__calibrated_by=calibrated_by)
    left = calibration_errors(design, FULL, K, NOISES)
    fifths = np.linspace(0.2, 1.0, 5)
    deepest = 0.9 * (FULL / K).min()
    process = design.process
    glass = (1.0 - 0.2**2) / 70e3
    reduced = 1.0 / ((1.0 - process.poisson**2) / process.E_MPa + glass)
    flattened = [(K * x / force_factor(reduced, design.tips.dome_radius_mm)) ** (2.0 / 3.0) for x in deepest * fifths]
    by_modulus = 2.0 / 3.0 * process.E_scatter * (flattened[-1] - flattened[0]) / (0.8 * deepest)
    deflections = np.hypot(slope_error(NOISES / K, deepest, fifths), by_modulus)
    assert deflections.min() > 1e-4
    assert left.gain_percent == pytest.approx((100.0 * deflections).tolist(), rel=1e-9)

    balance, dial, noise = by_weights()
    travel = slope_error(DIGIT * 0.01, deepest, fifths)
    ratios = np.diag(np.hypot(dial, noise) ** 2)  # of a plate to weights, one of each tip
    from_mean = np.eye(4) - 0.25
    differing_part = np.sqrt(np.diag(from_mean @ ratios @ from_mean.T) / 3.0)
    common_part = 1.5 * 2.0 * np.sqrt(travel**2 + (travel**2 + ratios.sum() / 16.0) / 3.0)
    expected = np.sqrt(balance**2 + noise**2 + deflections**2 + common_part**2 + differing_part**2)
    assert left.stiffness_percent == pytest.approx((100.0 * expected).tolist(), rel=1e-9)
    coarse = calibration_errors(designed(reading__calibrated_by=calibrated_by, bench__dial_mm=0.1), FULL, K, NOISES)
    assert coarse.gain_percent == left.gain_percent


@pytest.mark.parametrize("given", [{"stiffness_percent": 7.0}, {"stiffness_percent": 7.0, "gain_percent": 0.0}])
def test_a_percentage_that_the_design_gives_holds(given):
    solved = calibration_errors(designed(), FULL, K, NOISES)
    left = calibration_errors(designed(**{f"reading__{key}": value for key, value in given.items()}), FULL, K, NOISES)
    assert left.typed == tuple(given)
    for key in ("stiffness_percent", "gain_percent"):
        assert getattr(left, key) == (4 * (given[key],) if key in given else getattr(solved, key))


def test_a_tip_without_a_force_has_a_bounded_error():
    left = calibration_errors(designed(), np.array([np.nan, 0.0, 0.064, 0.67]), K, NOISES)
    assert np.isfinite([*left.stiffness_percent, *left.gain_percent]).all()
    assert left.largest_stiffness > 1.0


# Low springs of 56 N/m over 1.13 mm, and 0.039 mm by the change of the tilt: 6.67 g, of which 0.9 are 6.01 g.
@pytest.mark.parametrize(
    ("key", "refused", "accepted"), [("bench.balance_g", 6.7, 6.5), ("bench.balance_max_g", 5.9, 6.1)]
)
def test_a_bench_that_cannot_weigh_the_softest_spring_is_refused_before_work_starts(key, refused, accepted):
    """Low springs of 56 N/m over 1.13 mm, and 0.039 mm by the change of the tilt: 6.67 g, of which 0.9 are 6.01 g."""
    Sensor(design=load_design("mango", {**UNSET, key: accepted}))
    design = load_design("mango", {**UNSET, key: refused})
    error = refusal(Sensor, design=design)
    assert (error.field, error.value) == (key, refused)
    Sensor(design=design, springs_as="sized")  # a search goes on to stiffer springs


def assessed(bench=None, **reading):
    """Return the readings of a square of flat tips that is calibrated on a bench, and the verdict on its springs."""
    design = replace(square_design(noise_percent=0.01, **reading), bench=Bench(**bench or {}))
    readings = analyse_readings(with_compliance(design, square_contact(), square_springs()))
    return readings, calibration_verdict(readings, design.reading)


@pytest.mark.usefixtures("linear_world")
def test_what_the_bench_leaves_is_in_the_uncertainty():
    """Springs that are known ten times worse: their part grows as much, and the others stay."""
    (of_fine, fine), (of_coarse, coarse) = (
        assessed({"balance_g": digit, "dial_mm": digit}, calibrated_by="plate") for digit in (0.001, 0.01)
    )
    assert (fine.passed, coarse.passed) == (True, False)
    assert coarse.value / fine.value == pytest.approx(10.0, rel=0.01)
    for one, other in zip(of_fine.moduli, of_coarse.moduli, strict=True):
        before, after = (dict(row.sources.contributions) for row in (one, other))
        assert after.pop("stiffness") / before.pop("stiffness") == pytest.approx(10.0, rel=0.05)
        assert after == pytest.approx(before)


@pytest.mark.usefixtures("linear_world")
def test_a_stiffness_that_the_design_gives_passes_as_given():
    _, verdict = assessed(stiffness_percent=20.0)
    assert (verdict.value, verdict.limit, verdict.passed) == (0.2, "as given", True)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name == "mango" else pytest.mark.study) for name in PRESETS]
)
def test_presets_are_calibrated_on_the_default_bench_and_not_on_a_kitchen_s(name):
    for bench, passes in ((KITCHEN, False), ({}, True), (LABORATORY, True)):
        design = load_design(name, {**UNSET, **bench})
        sensor = Sensor(design=design, options=RunOptions(tolerance=0.01), springs_as="sized")
        assert sensor.verdict("reading.calibration").passed is passes
        assert sensor.verdict("reading.uncertainty").passed is True or not passes
