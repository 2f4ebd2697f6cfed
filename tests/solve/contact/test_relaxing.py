"""Tips over time on flesh that relaxes, against closed forms and independent integrations."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from sensor.theory.contrast_law import ContrastLaw
from sensor.theory.relaxation import Relaxation
from solve.contact.relaxing import elastic_forces, timed_forces
from solve.linear import SolveError

STOP_S = 1.2
HOLD_S = 30.0
SPEED = 0.5  # [mm/s]


def nodes(steps):
    """Return times of a ramp and a hold, fine where either begins."""
    ramp = STOP_S * (np.arange(steps + 1) / steps) ** 2
    wait = HOLD_S * (np.arange(1, steps + 1) / steps) ** 3
    return np.concatenate([ramp, STOP_S + wait])[None]


def travel(times):
    return SPEED * np.minimum(times, STOP_S)


def one_tip(C, S, hertz=0.0):
    return ContrastLaw(weights=(1.0,), gaps=(0.0,), C=((C,),), S=((S,),), hertz=hertz)


@pytest.mark.parametrize("E", [0.3, 1.3, 20.0])
def test_one_maxwell_arm_and_a_spring_follow_their_closed_form(E):
    """Laplace's transform of K k / (K + k), k = K_m (1 - g / (1 + s tau)), has one pole."""
    K, S, g, tau = 0.9, 0.756, 0.58, 3.0
    K_m = E / S
    at_once = K * K_m / (K + K_m)
    at_last = K * (1.0 - g) * K_m / (K + (1.0 - g) * K_m)
    rate = (1.0 - g * K_m / (K + K_m)) / tau

    def integral(t):
        return at_last * t + (at_once - at_last) * -np.expm1(-rate * t) / rate

    times = nodes(24)
    exact = SPEED * (integral(times) - integral(np.maximum(times - STOP_S, 0.0)))[0, 1:]
    solved = timed_forces(one_tip(1.0 / K, S), Relaxation(((g, tau),)), np.array([E]), times, travel(times))
    error = np.abs(solved.F[0, 1:, 0] - exact)
    assert (error / exact).max() < 1e-6
    assert (error <= solved.error[0, 1:, 0]).all()


def test_level_pair_is_the_sum_of_its_modes():
    """S and C of one pattern: the sum and the difference of both tips each relax as one tip."""
    times = nodes(24)
    gap = 0.2  # of the high tip, which touches later; its difference mode then begins to move

    def forces(law):
        arms = Relaxation(((0.3, 0.5), (0.28, 40.0)))
        return timed_forces(law, arms, np.array([1.0]), times, travel(times)).F[0]

    pair = ContrastLaw(weights=(-1.0, 1.0), gaps=(0.0, 0.0), C=((1.2, 0.0), (0.0, 1.2)), S=((0.77, 0.01), (0.01, 0.77)))
    assert forces(pair) == pytest.approx(np.tile(forces(one_tip(1.2, 0.78)), 2), rel=1e-10, abs=1e-15)
    late = forces(dataclasses.replace(pair, gaps=(0.0, gap)))[:, 1]
    assert (late[times[0] < gap / SPEED] == 0.0).all()
    assert (late[times[0] > 1.1 * gap / SPEED] > 0.0).all()


def independent_dome(E, C, hertz, arms, times):
    """Return the force of one dome by the differential equations of Maxwell's arms, an adaptive Runge-Kutta method.

    F = n - sum_i g_i m_i of n = E (q / h)^1.5 and tau m' = n - m; q from the springs at each time.
    """
    shares, taus = np.array(arms.shares), np.array(arms.times)

    def n(t, memory):
        lost = float(shares @ memory)

        def excess(q):
            return q + C * (E * (max(q, 0.0) / hertz) ** 1.5 - lost) - SPEED * min(t, STOP_S)

        return E * (brentq(excess, 0.0, SPEED * STOP_S + C * lost + 1e-12, xtol=1e-15, rtol=1e-14) / hertz) ** 1.5

    memory, found = np.zeros(len(shares)), [0.0]
    for before, t in pairwise(times):
        way = solve_ivp(lambda s, m: (n(s, m) - m) / taus, (before, t), memory, method="DOP853", rtol=1e-10, atol=1e-13)
        memory = way.y[:, -1]
        found.append(n(t, memory) - float(shares @ memory))
    return np.array(found)


@pytest.mark.parametrize("E", [0.5, 3.5])
def test_dome_on_a_spring_agrees_with_its_differential_equations(E):
    arms = Relaxation(((0.25, 0.4), (0.33, 12.0)))
    times = nodes(12)
    hertz = 0.42
    expected = independent_dome(E, 1.0 / 0.9, hertz, arms, times[0])
    solved = timed_forces(one_tip(1.0 / 0.9, 0.0, hertz), arms, np.array([E]), times, travel(times))
    error = np.abs(solved.F[0, 1:, 0] - expected[1:])
    assert (error <= solved.error[0, 1:, 0] + 1e-9 * expected[1:]).all()
    assert (error / expected[1:]).max() < 2e-4


def test_elastic_forces_meet_their_law_and_tips_that_are_off_have_none():
    law = ContrastLaw(
        weights=(-1.0, 1.0, 0.0), gaps=(0.0, 0.1, 9.0), C=np.diag([1.1, 0.06, 0.5]),
        S=np.full((3, 3), 0.02) + 0.3 * np.eye(3), hertz=0.4,
    )  # fmt: skip
    E = np.array([0.1, 1.0, 30.0])
    depth = np.array([0.2, 0.5, 0.6])
    F = elastic_forces(law, E, depth)
    assert (F[:, 2] == 0.0).all()
    sunk = 0.4 * (F / E[:, None]) ** (2.0 / 3.0) + F @ np.array(law.S) / E[:, None] + F @ np.array(law.C)
    assert (sunk + law.gaps)[:, :2] == pytest.approx(np.repeat(depth[:, None], 2, axis=1), rel=1e-12)


def test_dome_whose_contact_shrinks_is_refused():
    times = np.array([[0.0, 1.0, 2.0]])
    with pytest.raises(SolveError):
        timed_forces(one_tip(0.1, 0.0, 0.4), Relaxation(((0.1, 1.0),)), np.ones(1), times, np.array([[0.0, 0.5, 0.2]]))
