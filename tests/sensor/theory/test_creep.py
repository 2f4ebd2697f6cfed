"""The law of creep against integrals over the history of a load."""

import math

import numpy as np
import pytest

from sensor.theory.creep import EFFECTIVE, NO_CREEP, CreepLaw

LAW = CreepLaw(per_decade=0.06, error=0.02)


def by_hand(t, T):
    return 1.0 - (1.0 - np.clip(t / T, 0.0, 1.0)) ** 2


def superposed(kernel, load, times):
    """Return the response at the last of some times to a load: each of its steps at the middle of its time."""
    middle = 0.5 * (times[1:] + times[:-1])
    return float(np.diff(load) @ kernel(times[-1] - middle))


def test_a_decade_adds_its_share_and_decades_multiply():
    assert LAW.growth(1.0, 10.0) == pytest.approx(1.06, rel=1e-12)
    assert LAW.growth(0.3, 300.0) == pytest.approx(1.06**3, rel=1e-12)
    assert LAW.press_stiffness_ratio(30.0, 3.0 / EFFECTIVE) == pytest.approx(1.06, rel=1e-12)


def test_what_does_not_creep_has_one_stiffness():
    assert (NO_CREEP.press_stiffness_ratio(30.0, 1.0), NO_CREEP.deviation(30.0, 1.0)) == (1.0, 0.0)
    assert NO_CREEP.residual_deflection(1.0, 1.0, 2.0) == 0.0


@pytest.mark.parametrize("T", [0.4, 3.0])
def test_stiffness_at_the_stop_of_a_hand_is_that_of_its_effective_time(T):
    """To first order in n; K(t) K(1 s) of the law is t^-n sin(n pi) / (n pi) (J. D. Ferry, Viscoelastic Properties)."""
    n = LAW.exponent
    times = np.linspace(0.0, T, 200_001)
    force = superposed(lambda t: t**-n * math.sin(math.pi * n) / (math.pi * n), by_hand(times, T), times)
    assert force == pytest.approx(LAW.press_stiffness_ratio(1.0, T), rel=(math.pi * n) ** 2 / 4.0)


@pytest.mark.parametrize("held", [0.0, 0.3, 20.0])
def test_springs_grow_softer_in_a_hold_by_superposition(held):
    n = LAW.exponent
    times = np.linspace(0.0, 2.0 + held, 100_001)
    even = np.minimum(times / 2.0, 1.0)
    at_stop = 2.0**n / (1.0 + n)
    grown = superposed(lambda t: t**n, even, times) / at_stop
    assert LAW.growth_in_hold(held, 2.0) == pytest.approx(grown, rel=1e-6)
    assert NO_CREEP.growth_in_hold(held, 2.0) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("since", [0.1, 1.0, 20.0])
def test_a_press_leaves_at_most_the_zero_that_is_told(since):
    """A force that stays leaves just that, one that rises and falls by hand within 2 s less."""
    n = LAW.exponent
    compliance = EFFECTIVE**n  # of a press of one second
    told = LAW.residual_deflection(since, 1.0, 2.0)
    stays = ((2.0 + since) ** n - since**n) / compliance
    assert told == pytest.approx(stays, rel=1e-12)
    times = np.linspace(0.0, 2.0 + since, 200_001)
    load = np.where(times < 1.0, by_hand(times, 1.0), by_hand(np.maximum(2.0 - times, 0.0), 1.0))
    left = superposed(lambda t: t**n, load, times) / compliance
    assert 0.2 * told < left < told


def test_the_spread_of_the_law_and_of_its_time_widen_the_stiffness():
    """By a step of each: the share of a decade, and a time anywhere within a factor e."""
    moved = (
        CreepLaw(LAW.per_decade + 1e-6).press_stiffness_ratio(30.0, 2.0) / LAW.press_stiffness_ratio(30.0, 2.0) - 1.0
    )
    by_time = LAW.press_stiffness_ratio(30.0, 2.0 / math.e) / LAW.press_stiffness_ratio(30.0, 2.0) - 1.0
    expected = math.hypot(moved / 1e-6 * LAW.error, by_time / math.sqrt(3.0))
    assert LAW.deviation(30.0, 2.0) == pytest.approx(expected, rel=0.02)  # a step of e is no slope
