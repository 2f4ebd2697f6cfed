"""What a bench leaves, as a design predicts it: tables with its errors are drawn, and `calibrate` fits them."""

from dataclasses import replace

import numpy as np
import pytest
from measured_units import text_of

from instrument.press.signals import count_keys
from pipeline.reading.bench_uncertainty import calibration_errors
from sensor.design.bench import PRESSED, WEIGHED_AT, Bench
from sensor.quantity import STANDARD_GRAVITY
from sensor.theory.student import student_quantile

N_PER_G = 1e-3 * STANDARD_GRAVITY
COUNTS_PER_N = 1e7
DRAWS = 100


def drawn_digits(rng, exact, digit):
    """Return readings as text from a zero that is anywhere, rounded to a last digit, which is a power of ten."""
    decimals = max(0, round(-np.log10(digit)))
    shown = np.round(exact + rng.uniform(-0.5, 0.5) * digit, decimals)
    return [f"{each:.{decimals}f}" for each in shown - shown[0]]


class BenchTables:
    """Tables that a unit shows on a bench whose readings are rounded; its springs are those of the design."""

    def __init__(self, measured, bench):
        """Take the forces to which the design presses each tip."""
        self.measured = measured
        self.bench = bench
        self.full_scale = np.array(measured.report.read_out.full_scale_N)
        self.names = [tip.name for tip in measured.report.tips]

    def left(self):
        """Return what the bench leaves as the design predicts it."""
        design = self.measured.design
        reading = replace(design.reading, calibrated_by="weights", stiffness_percent=None, gain_percent=None)
        design = replace(design, reading=reading, bench=self.bench)
        return calibration_errors(design, self.full_scale, self.measured.K, np.zeros(len(self.names)))

    def weights(self, rng):
        """Return a table of weights: each load is near a sixth of the range, as a maker has it."""
        rows = []
        for tip, name in enumerate(self.names):
            most = min(PRESSED * self.full_scale[tip], N_PER_G * self.bench.balance_max_g)
            loads = most * (np.array(WEIGHED_AT) + np.append(0.0, rng.uniform(-0.05, 0.05, len(WEIGHED_AT) - 1)))
            grams = drawn_digits(rng, loads / N_PER_G, self.bench.balance_g)
            shown = drawn_digits(rng, loads / self.measured.K[tip], self.bench.dial_mm)
            counts = COUNTS_PER_N * np.outer(loads, np.eye(len(self.names))[tip]).round(8)
            rows += [[name, *read, *each] for *read, each in zip(grams, shown, counts.tolist(), strict=True)]
        return text_of(",".join(["tip,weight_g,deflection_mm", *count_keys(len(self.names))]), rows)


def statistical(values):
    """Return by how much a standard deviation of some values may be off: 3.5 deviations."""
    return 3.5 / np.sqrt(2.0 * values)


@pytest.mark.parametrize(
    ("bench", "by"),
    [
        (Bench(balance_g=0.1, dial_mm=0.001), "balance"),
        pytest.param(Bench(balance_g=0.01, dial_mm=0.01), "dial", marks=pytest.mark.slow),
        pytest.param(Bench(balance_g=0.1, balance_max_g=20.0, dial_mm=0.01), "dial", marks=pytest.mark.slow),
    ],
    ids=["coarse balance", "coarse dial", "balance of a small load"],
)
def test_stiffnesses_by_weights_scatter_as_the_bench_predicts(bench, by, mango, rng, calibrate):
    """Each kind of spring; what `calibrate` tells of a spring is wider, by Student's t and by the digits once more."""
    tables = BenchTables(mango, bench)
    left = tables.left()
    half = BenchTables(mango, replace(bench, balance_g=0.5 * bench.balance_g, dial_mm=0.5 * bench.dial_mm))
    units = [calibrate(mango.report, tables.weights(rng)).unit for _ in range(DRAWS)]
    found = np.array([unit.stiffnesses for unit in units]) / mango.K - 1.0
    told = np.sqrt(np.mean([np.square(unit.K_percent) for unit in units], axis=0))
    for kind in mango.design.tips.spring_groups:
        predicted = left.stiffness_percent[kind[0]]
        within = statistical(DRAWS * len(kind))
        assert 100.0 * found[:, kind].std() == pytest.approx(predicted, rel=within)
        widest = np.hypot(0.5 * student_quantile(len(WEIGHED_AT) - 2), 1.0)
        assert 1.0 - within < np.sqrt(np.mean(told[list(kind)] ** 2)) / predicted < widest * (1.0 + within)
        finer = half.left().stiffness_percent[kind[0]]
        assert 100.0 * found[:, kind].std() > finer * (1.0 + within), "a bench of half the digits is found out"
    assert left.by == by
