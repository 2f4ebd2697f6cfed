"""A ball on a table against Hertz's formulas in another form, and its roll against the geometry of a ball."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from sensor.theory.free_fruit import roll, table_indentation_fraction
from sensor.theory.hertz import approach

E, POISSON, RADIUS = 3.5, 0.3, 35.0
FORCES = (0.44843, 2.2418)  # [N] of the paper's scene at full travel, low and high tip


def test_share_settles_where_fruit_and_table_bear_the_same_force():
    force, travel = sum(FORCES), 0.6
    share = table_indentation_fraction(force, travel, E, POISSON, RADIUS)
    assert share == pytest.approx(approach(force * (1.0 - share), E, POISSON, RADIUS) / travel, abs=1e-9)
    assert 0.2 < share < 0.2 / 0.6


def moment(u, clearance, x, k):
    """Return the moment about the support of a ball that has rolled by u, under springs of k that press by clearance.

    The tips stand at x; the skin of the ball about u lies u-dependent below its top.
    """
    top = np.sqrt(RADIUS**2 - (x - u) ** 2) - np.sqrt(RADIUS**2 - x**2)
    return float(np.sum(k * (clearance + top) * (x - u)))


def test_a_deep_press_rolls_the_ball_to_where_the_moment_vanishes():
    """Springs that differ by a thousandth: the angle is small, so the linear formula is that of the whole geometry."""
    x, k, depth = np.array([-1.0, 1.0]), np.array([1.0, 1.001]), 0.6
    found = roll((k * depth).tolist(), x.tolist(), k.tolist(), RADIUS)
    u = brentq(moment, 0.0, 0.1, args=(depth, x, k))
    assert found.steady
    assert math.radians(found.angle_deg) * RADIUS == pytest.approx(u, rel=1e-2)
    assert found.angle_deg > 0.0  # towards the stiffer tip


def test_a_ball_under_the_paper_pair_does_not_come_to_rest():
    """Each mm of roll gives k (s/2)^2 / R to the high tip: more than the force takes back until travel > s^2 / 4 R."""
    x, k = np.array([-4.0, 4.0]), np.array(FORCES) / 0.6
    assert not roll(FORCES, x.tolist(), k.tolist(), RADIUS).steady
    shallow = roll((0.5 * np.array(FORCES)).tolist(), x.tolist(), k.tolist(), RADIUS)
    assert shallow.resistance < 0.0
    assert shallow.angle_deg == math.inf
    assert moment(0.1, 0.3, x, k) > moment(0.0, 0.3, x, k) > 0.0


def test_friction_that_holds_balances_the_moment():
    found = roll(FORCES, (-4.0, 4.0), (1.0, 1.0), RADIUS)
    ratio = FORCES[1] / FORCES[0]
    assert found.friction == pytest.approx((ratio - 1.0) / (ratio + 1.0) * 8.0 / (4.0 * RADIUS), rel=1e-9)
    assert found.friction == pytest.approx(0.038, rel=0.01)
    assert found.lever_mm == pytest.approx(2.0 * RADIUS * found.friction)
