"""A curve by known parameters gives them back; the errors of a fit are those of the formulas that it names."""

import numpy as np
import pytest
from stand_ins import specimen

from instrument.compress.force_law import ForceLaw, TestGeometry, hertz_force_law
from instrument.compress.law_fit import fit_law, standard_errors
from instrument.compress.phases import split_phases
from instrument.compress.pressed_shapes import Ellipsoid
from instrument.compress.range_choice import add_choice_error, choose_range
from sensor.quantity import Estimate


def power_law(deepest):
    """Return F = 2 E D^1.5 up to a travel."""
    travels = np.array([0.0, deepest])
    return ForceLaw(exponent=1.5, travels=travels, forces=2.0 * travels**1.5, error=0.0, variants={})


LAW = power_law(7.0)


def curve(k=8.0, touch=1.0, settling=0.1, settling_force=3.0, offset=0.7, drift=0.3, exponent=1.5):
    """Return travel [mm] and force [N]: x = x0 + (F / k)^(1 / n) - s exp(-F / F_s), and the load cell's zero line."""
    force = np.linspace(0.0, 60.0, 20_000)
    position = touch + (force / k) ** (1.0 / exponent) - settling * np.exp(-force / settling_force)
    travel = np.linspace(0.0, position[-1], 800)
    return travel, np.interp(travel, position, force) + offset + drift * travel


def test_parameters_of_a_curve_come_back():
    travel, force = curve()
    fit = fit_law(LAW, travel, force, 0.7, with_drift=True)
    assert fit.modulus.value == pytest.approx(4.0, rel=1e-3)
    assert fit.touch.value == pytest.approx(1.0, abs=1e-3)
    assert fit.onset == pytest.approx(0.9, abs=2e-3)
    assert np.exp(fit.parameters.log_settling_force) == pytest.approx(3.0, rel=0.02)
    np.testing.assert_allclose(fit.zero_line(travel), 0.7 + 0.3 * travel, atol=5e-3)
    np.testing.assert_allclose(fit.force(travel, 60.0), force, atol=0.02)
    np.testing.assert_allclose(fit.residual, fit.force(travel, 60.0) - force, atol=0.02)
    assert fit.modulus.error < 1e-3 * fit.modulus.value


def test_skin_that_does_not_settle_has_no_error_of_it():
    travel, force = curve(settling=0.0, drift=0.0)
    fit = fit_law(LAW, travel, force, 0.7, with_drift=False)
    assert fit.parameters.settling == pytest.approx(0.0, abs=1e-4)
    assert (fit.parameters.drift, fit.errors.drift) == (0.0, 0.0)


def test_force_that_does_not_rise_is_not_fitted():
    travel, force = curve()
    assert fit_law(LAW, travel, -force, 0.0, with_drift=False) is None
    assert fit_law(LAW, travel, 60.0 + force[::-1], 0.0, with_drift=False) is None


@pytest.mark.parametrize("plates", [1, 2])
def test_law_is_hertz_s_up_to_a_tenth_of_the_radius(plates):
    """F = 4/3 sqrt(R) E* (D / 2)^1.5 between two plates, D^1.5 in a seat."""
    body = Ellipsoid(height_mm=70.0, radius_mm=30.0, radius_across_mm=30.0)
    law = hertz_force_law(TestGeometry(body=body, plates=plates))
    assert (law.exponent, law.deepest) == (1.5, pytest.approx(3.0 * plates))
    forces = 4.0 / 3.0 / 0.91 * np.sqrt(30.0) * 2.0 * (np.array([1.0, 4.0, 9.0]) / plates) ** 1.5
    assert law.depth(forces, 2.0) == pytest.approx([1.0, 4.0, 9.0])


def test_range_ends_where_the_law_does():
    travel, force = curve(settling=0.0, drift=0.0)
    chosen = choose_range(split_phases(specimen(travel, force)).loading, power_law(2.0))
    assert chosen.range_end == pytest.approx(3.0, abs=0.02)
    assert chosen.idle_points == pytest.approx(np.searchsorted(travel, 1.0), abs=3)


@pytest.mark.parametrize(("bend", "end"), [(1.0, 1.0), (0.95, 0.8), (0.75, 0.6)])
def test_longest_range_that_follows_the_law_is_taken(bend, end):
    """Beyond a fraction of the largest force the curve bends away from the law, by half as much again."""
    travel, force = curve(settling=0.0, drift=0.0, offset=0.0)
    noise = np.random.default_rng(1).normal(0.0, 0.05, len(force))
    bent = force + 0.5 * np.maximum(force - bend * force[-1], 0.0)
    chosen = choose_range(split_phases(specimen(travel, bent + noise)).loading, LAW)
    assert chosen.follows_law
    assert np.interp(chosen.range_end, travel, bent) / bent[-1] == pytest.approx(end, abs=0.03)
    assert chosen.modulus.value == pytest.approx(4.0, rel=0.03)


def test_drift_counts_where_it_is_seen():
    """By Schwarz's criterion a drift of many standard errors is taken, one of none is not."""
    noise = np.random.default_rng(1).normal(0.0, 0.05, 800)
    for drift in (0.0, 0.5):
        travel, force = curve(drift=drift)
        chosen = choose_range(split_phases(specimen(travel, force + noise)).loading, LAW)
        assert chosen.fit.parameters.drift == pytest.approx(drift, abs=0.05)
        assert chosen.modulus.value == pytest.approx(4.0, rel=0.02)
        assert chosen.touch.value == pytest.approx(1.0, abs=0.02)


def test_errors_are_white_s():
    """inv(J'J) J' diag(r^2) J inv(J'J) with n / (n - p), where residuals scatter apart."""
    rng = np.random.default_rng(5)
    J = rng.normal(size=(40, 3)) * [1.0, 10.0, 0.1]
    r = rng.normal(size=40)
    r[1::2] = -np.abs(r[1::2])
    r[::2] = np.abs(r[::2])  # neighbours are of other signs: no correlation above 0
    bread = np.linalg.inv(J.T @ J)
    covariance = bread @ (J.T * r**2) @ J @ bread * 40.0 / 37.0
    assert standard_errors(J, r) == pytest.approx(np.sqrt(np.diag(covariance)))
    assert standard_errors(J, np.zeros(40)) == pytest.approx([0.0, 0.0, 0.0])


def test_residuals_that_are_alike_widen_the_errors():
    """With n equal residuals neighbours have a correlation of (n - 1) / n, at most 0.95: (1 + c) / (1 - c) times."""
    for count, correlation in ((10, 0.9), (400, 0.95)):
        J = np.ones((count, 1))
        white = np.sqrt(1.0 / (count - 1))
        widened = white * np.sqrt((1.0 + correlation) / (1.0 - correlation))
        assert standard_errors(J, np.ones(count)) == pytest.approx([widened])
    by_chance = np.array([1.0, 1.0, -1.0, -1.0] * 4)  # neighbours: 8 - 7 of 16, below 2 / sqrt(16)
    assert standard_errors(np.ones((16, 1)), by_chance) == pytest.approx([np.sqrt(1.0 / 15.0)])


def test_other_ranges_widen_the_error_by_what_noise_does_not_explain():
    """Hausman: a difference of 2 with errors 1 and 2 has 1 left; one of three times the error tells none."""
    best = Estimate(100.0, 1.0, "N")
    others = [Estimate(102.0, 2.0), Estimate(101.0, 2.5), Estimate(150.0, 3.0)]
    assert add_choice_error(best, others).error == pytest.approx(np.sqrt(1.0 + 0.5 + 0.01**2))
    assert add_choice_error(best, []) == Estimate(100.0, pytest.approx(np.sqrt(1.0 + 0.01**2)), "N")
