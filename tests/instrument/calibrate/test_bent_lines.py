"""Lines of a calibration that bend: by how much a press is then wrong, and that its bar holds it."""

from dataclasses import replace

import numpy as np
import pytest
from measured_units import elastic, read_press, text_of, weighed

from instrument.press.measuring import MeasuringUnit
from sensor.theory.straight_line import fit_line
from solve.contact.pose_forces import Pose

SAMPLES = 30


def test_lack_of_fit_is_that_of_a_line_through_a_parabola(rng):
    """Independent: two straight lines by least squares, one through the weights, one through a part of their range."""
    for _ in range(50):
        p0, p1, p2 = rng.normal(size=3) * (1.0, 0.0, 0.05) + (0.0, 1.0, 0.0)
        weights = np.sort(rng.uniform(0.0, 4.0, 9))
        press = rng.uniform(0.0, rng.uniform(0.5, 4.0), 20)
        lack = fit_line(weights, p0 + p1 * weights + p2 * weights**2, np.zeros(9)).bend.lack_of_fit
        of_weights, of_press = (np.polyfit(F, p0 + p1 * F + p2 * F**2, 1)[0] for F in (weights, press))
        middle = 0.5 * np.cov(press, press**2)[0, 1] / press.var(ddof=1)
        assert lack.at_zero + lack.per_x * middle == pytest.approx(of_press / of_weights - 1.0, abs=1e-9)


def pair_forces(measured, E, at_zero, per_N):
    """Return the forces [N] of level presses of a pair, (samples, tips), on a fruit of modulus E [MPa].

    The travel is what springs sink and the fruit gives, x = F / K (1 + e_0 + k F / 2) + (S F) / E.
    """
    S = np.array(measured.report.contact.compliance_per_mm)
    forces = []
    for x in travels_of(measured):
        F = np.zeros(len(S))
        for _ in range(20):  # each step leaves a tenth of the error
            springs = np.diag((1.0 + at_zero + 0.5 * per_N * F) / measured.K)
            F = np.linalg.solve(springs + S / E, np.full(len(F), x))
        forces.append(F)
    return np.array(forces)


def travels_of(measured):
    return measured.design.press.travel_mm * np.linspace(0.05, 1.0, SAMPLES)


@pytest.mark.parametrize(
    ("name", "kind"), [("paper", "force_bend"), ("paper", "deflection_bend"), ("mango", "force_bend")]
)
def test_error_by_a_small_bend_is_what_moves_a_reading(name, kind, request):
    """Each slope is off by a thousandth, or by one for each newton. A dome's own term bends by 2 % less."""
    measured = request.getfixturevalue(name)
    sensor = measured.measuring()
    forces = measured.forces([Pose(E=1.5, travel=x) for x in travels_of(measured)])
    plain = read_press(sensor, forces)
    tips = len(measured.K)
    for one in np.eye(tips)[[0, -1]]:
        for at_zero, per_N in ((0.001 * one, 0.0 * one), (0.0 * one, 0.001 * one)):
            bends = {kind: tuple(at_zero.tolist()), f"{kind}_per_N": tuple(per_N.tolist())}
            bent = read_press(replace(sensor, unit=replace(sensor.unit, **bends)), forces)
            assert bent.u == pytest.approx(plain.u + bent.bend, rel=1e-9)
            if kind == "force_bend":
                shown = forces * (1.0 + at_zero + 0.5 * per_N * forces)
            else:
                shown = pair_forces(measured, 1.5, at_zero, per_N)
            E = read_press(sensor, shown).E
            assert bent.bend == pytest.approx(abs(E / plain.E - 1.0), rel=0.03)


class Bench:
    """A unit of the pair with bent channels and springs, its weights and its presses.

    A channel shows g (F + a F^2 / 2) under a force F, and its spring sinks as in `pair_forces`.
    """

    def __init__(self, measured, rng, most):
        """Draw loads, bends up to a change of slope over the weights, noise and the digits of the dial."""
        self.measured = measured
        tips = len(measured.K)
        self.reach = np.array(measured.report.read_out.full_scale_N) * rng.uniform(0.5, 6.0, tips)
        self.of_channel, self.of_spring = rng.uniform(-most, most, (2, tips)) / self.reach
        self.gain = 10.0 ** rng.uniform(4.0, 5.0, tips)
        self.noise = self.gain * self.reach * 10.0 ** rng.uniform(-5.0, -3.0)
        self.step = 10.0 ** -rng.integers(4, 7)
        self.steps = rng.integers(4, 8)
        self.rng = rng

    def counts(self, forces):
        """Return the counts of forces [N], (samples, tips), with noise."""
        exact = self.gain * (forces + 0.5 * self.of_channel * forces**2)
        return np.round(exact + self.noise * self.rng.normal(size=forces.shape))

    def weights(self):
        """Return the table of the unit's weights, up and down."""
        up = np.linspace(0.0, 1.0, self.steps)

        def shown(tip, load):
            sunk = load / self.measured.K[tip] * (1.0 + 0.5 * self.of_spring[tip] * load)
            return f"{round(sunk / self.step) * self.step:.6f}"

        names = [tip.name for tip in self.measured.report.tips]
        loads = np.outer(self.reach, np.concatenate([up, up[-2::-1]]))
        return text_of("tip,weight_g,deflection_mm,counts_l,counts_h", weighed(names, loads, shown, self.counts))

    def press(self, E):
        """Return the counts of a level press on a fruit of modulus E [MPa], (samples, tips)."""
        return self.counts(pair_forces(self.measured, E, 0.0, self.of_spring))


@pytest.mark.parametrize(("draws", "least"), [(12, 11), pytest.param(300, 291, marks=pytest.mark.study)])
def test_bars_hold_the_truth_where_channels_and_springs_bend(draws, least, paper, calibrate, rng):
    """Slopes that change by up to a quarter over the weights; without the lack of fit only some half are held."""
    inside = without = 0
    for _ in range(draws):
        bench = Bench(paper, rng, 0.25)
        unit = elastic(calibrate(paper.report, bench.weights()).unit)
        E = np.exp(rng.uniform(*np.log([0.5, 3.5])))
        forces = [unit.forces_of_counts(row, np.zeros(2)) for row in bench.press(E)]
        reading = read_press(MeasuringUnit(report=paper.report, unit=unit), forces)
        off = abs(E / reading.E - 1.0)
        inside += off <= reading.u
        without += off <= reading.u - reading.bend
    assert inside >= least
    assert without < 0.75 * draws


@pytest.mark.parametrize(("bend", "notes"), [(0.008, 0), (0.03, 2)])
def test_a_bend_beyond_half_a_per_cent_to_either_side_is_noted(bend, notes, paper, calibrate, rng):
    """Of a channel and of a deflection, each with its name and the change of its slope."""
    bench = Bench(paper, rng, 0.0)
    bench.of_channel = bend / bench.reach * (0.0, 1.0)
    bench.of_spring = bend / bench.reach * (1.0, 0.0)
    bench.noise *= 0.0
    bench.step = 1e-6
    assumed = calibrate(paper.report, bench.weights()).assumed
    assert len(assumed) == notes
    for name, note in zip(("deflection of low", "counts_h"), assumed, strict=False):
        assert name in note
        assert f"{100.0 * bend / (1.0 + 0.5 * bend):+.2g} %" in note


@pytest.mark.parametrize("bend", [0.04, -0.06])
def test_bend_on_a_plate_is_told_with_its_size(bend, paper, calibrate, rng):
    """The plate has deflections right at half of its travel, the weights have forces right at half of the largest.

    Two of a thousand are what counts are rounded by, and terms of the second order.
    """
    bench = Bench(paper, rng, 0.0)
    bench.of_channel = bend / bench.reach * (0.0, 1.0)
    bench.noise *= 0.0
    bench.step = 1e-6
    travels = np.concatenate([np.linspace(0.1, 1.0, 6), np.linspace(0.9, 0.1, 5)]) * min(bench.reach / paper.K)
    rows = np.column_stack([travels.round(6), bench.counts(np.outer(travels, paper.K))])
    plate = text_of("travel_mm,counts_l,counts_h", rows.tolist())
    unit = elastic(calibrate(paper.report, bench.weights(), plate).unit)
    for E in (0.7, 3.0):
        forces = [unit.forces_of_counts(row, np.zeros(2)) for row in bench.press(E)]
        reading = read_press(MeasuringUnit(report=paper.report, unit=unit), forces)
        assert reading.bend == pytest.approx(abs(E / reading.E - 1.0), rel=0.1, abs=2e-3)
