"""Holds of compression tests: planted Prony series come back, whatever the speed; what tells nothing is refused."""

from dataclasses import replace

import numpy as np
import pytest
from refusal import refusal
from scipy.stats import norm
from stand_ins import specimen

from instrument.compress import modulus
from instrument.compress.force_law import POISSON, TestGeometry, hertz_force_law
from instrument.compress.holds import _schwarz_criterion, fit_relaxation
from instrument.compress.modulus import measure_modulus
from instrument.compress.phases import split_phases
from instrument.compress.pressed_shapes import Ellipsoid
from pipeline.storage.record_data import as_data

GAP_MM = 0.4
DEPTH_MM = 3.0
ZERO_N = 0.3
STIFFNESS = 20.0  # [N / mm^1.5] of Hertz's law at the first instant


def held_curve(arms, loading_s=2.0, hold_s=60.0, noise=0.0, rate_Hz=20.0, retreat=0, seed=1):
    """Return a test of flesh by Hertz's law whose force is the convolution of Lee and Radok, integrated finely."""
    speed = DEPTH_MM / loading_s
    start = GAP_MM / speed
    time = np.arange(0.0, start + loading_s + hold_s, 1.0 / rate_Hz)
    depth = np.clip((time - start) * speed, 0.0, DEPTH_MM)
    s = np.linspace(0.0, loading_s, 2_001)
    middles = 0.5 * (s[1:] + s[:-1])
    steps = np.diff((speed * s) ** 1.5)
    force = np.zeros_like(time)
    for i, t in enumerate(time - start):
        done = middles < t
        left = 1.0 - sum(g * -np.expm1((middles[done] - t) / tau) for g, tau in arms)
        force[i] = STIFFNESS * float(np.sum(left * steps[done]))
    travel = GAP_MM + np.where(time < start, (time - start) * speed, depth)
    if retreat:
        back = np.arange(1, retreat + 1) / retreat
        time = np.concatenate([time, time[-1] + back])
        travel = np.concatenate([travel, travel[-1] * (1.0 - back)])
        force = np.concatenate([force, force[-1] * (1.0 - back)])
    force = force + ZERO_N + noise * force.max() * np.random.default_rng(seed).normal(size=len(force))
    return specimen(travel, force, time=time)


def found(test):
    of = split_phases(test)
    return fit_relaxation(of.specimen, of.hold, GAP_MM, ZERO_N)


@pytest.mark.parametrize(("loading_s", "retreat"), [(0.5, 0), (6.0, 30)])
def test_two_planted_arms_come_back_whatever_the_speed(loading_s, retreat):
    arms = ((0.25, 3.0), (0.2, 25.0))
    told = found(held_curve(arms, loading_s=loading_s, hold_s=150.0, retreat=retreat))
    assert [arm.share.value for arm in told.arms] == pytest.approx([g for g, _ in arms], rel=0.02)
    assert [arm.time.value for arm in told.arms] == pytest.approx([tau for _, tau in arms], rel=0.02)
    T = loading_s
    s = np.linspace(0.0, T, 100_001)
    lost = sum(g * np.trapezoid(-np.expm1((s - T) / tau) * 1.5 * (s / T) ** 0.5 / T, s) for g, tau in arms)
    of_a_row = sum(g * 0.05 / tau for g, tau in arms)  # the stop lies between two rows of 0.05 s
    assert told.lost_in_loading == pytest.approx(lost, abs=of_a_row)


@pytest.mark.slow
def test_noise_of_a_percent_leaves_the_arm_in_its_bar():
    covered = []
    for seed in range(20):
        (arm,) = found(held_curve(((0.4, 8.0),), noise=0.01, rate_Hz=5.0, seed=seed)).arms
        covered.append(abs(arm.share.value - 0.4) <= arm.share.error and abs(arm.time.value - 8.0) <= arm.time.error)
    assert np.mean(covered) >= 0.8  # two sigma of each of two numbers, of 20 tests


def test_more_arms_must_raise_the_likelihood_by_more_than_they_cost(rng):
    """BIC = k ln n - 2 ln L, with L of normally distributed residuals at their own variance."""

    def bic(residuals, parameters):
        likelihood = norm.logpdf(residuals, scale=np.sqrt(np.mean(residuals**2))).sum()
        return parameters * np.log(len(residuals)) - 2.0 * likelihood

    wide, narrow = rng.normal(size=200), 0.98 * rng.normal(size=200)
    change = _schwarz_criterion(narrow, 5) - _schwarz_criterion(wide, 3)
    assert change == pytest.approx(bic(narrow, 5) - bic(wide, 3), rel=1e-9)


def test_curve_without_hold_or_time_has_none():
    arms = ((0.4, 8.0),)
    test = held_curve(arms)
    ramp = test.time <= (GAP_MM + DEPTH_MM) / (DEPTH_MM / 2.0)
    assert split_phases(specimen(test.travel[ramp], test.force[ramp], time=test.time[ramp])).hold is None
    assert split_phases(specimen(test.travel, test.force)).hold is None
    turned = held_curve(arms, hold_s=0.05, rate_Hz=400.0, retreat=200)  # a machine stands still before it turns back
    assert split_phases(turned).hold is None


def test_hold_that_is_shorter_than_its_loading_is_refused():
    assert refusal(found, held_curve(((0.4, 8.0),), loading_s=4.0, hold_s=3.0)).field.endswith("hold")


@pytest.fixture
def law_of_the_curve(monkeypatch):
    """Put Hertz's law, by which the curves are made, in the place of the solved one."""

    def law(geometry, _count):
        apparent = hertz_force_law(geometry)
        return replace(apparent, variants={POISSON: (apparent,)})

    monkeypatch.setattr(modulus, "solve_force_law", law)


@pytest.mark.usefixtures("law_of_the_curve")
def test_travel_of_the_frame_is_taken_off_before_the_hold():
    """A frame of 10 um/N under some 80 N; the machine stands still while the flesh under it relaxes."""
    geometry = TestGeometry(body=Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0))
    test = held_curve(((0.4, 8.0),), loading_s=6.0)
    start = split_phases(test).hold.start
    gives = 0.01 * (test.force - ZERO_N)
    gives[start:] = gives[start]
    soft = measure_modulus(
        replace(test, travel=test.travel + gives), replace(geometry, compliance_um_per_N=10.0)
    ).relaxation
    stiff = measure_modulus(test, geometry).relaxation
    assert soft.lost_in_loading == pytest.approx(stiff.lost_in_loading, rel=1e-3)


@pytest.mark.usefixtures("law_of_the_curve")
def test_modulus_tells_the_relaxation_of_a_hold_and_is_that_of_the_loading_alone():
    geometry = TestGeometry(body=Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0))
    test = held_curve(((0.4, 8.0),), noise=0.002)
    result = measure_modulus(test, geometry)
    alone = measure_modulus(test.up_to(split_phases(test).hold.start + 1), geometry)
    assert (alone.relaxation, alone.E_MPa) == (None, result.E_MPa)
    (arm,) = as_data(result)["relaxation"]["arms"]
    assert arm["share"] == pytest.approx(0.4, rel=0.03)
    assert arm["u_time_percent"] == result.relaxation.arms[0].time.percent
