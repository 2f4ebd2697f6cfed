"""Slope and curvature of the skin against elliptic integrals and the strain energy of point loads."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

from sensor.theory.sloped_skin import frictionless_stiffness_change, log_coefficient, slope_factor, stretch_factor

ROUND_OFF = 1e-12  # relative: sums of 64 positive terms
ANGLES = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.5])
def test_a_slope_stretches_the_plan(slope):
    """By the mean of 1 / r over an ellipse, 2 / pi K(-slope^2); at nu 0 a half-space gives alike in all directions."""
    stretched = 2.0 / math.pi * ellipk(-(slope**2))
    assert stretch_factor(slope) == pytest.approx(stretched, rel=ROUND_OFF)
    assert slope_factor(0.0, slope) == pytest.approx(stretched, rel=ROUND_OFF)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_small_slopes_act_by_their_square(poisson):
    slope = 1e-2
    expected = slope**2 * (0.5 * poisson / (1.0 - poisson) - 0.25)
    assert slope_factor(poisson, slope) - 1.0 == pytest.approx(expected, abs=2.0 * slope**4)


def test_a_sliding_tip_loses_the_square_of_the_sine_less_what_the_flesh_beside_gives():
    """cos^2 of the press; and the part of the vertical load down the slope, whose answer is stiffer, is missing."""
    slope = math.tan(math.radians(6.6))
    expected = -(math.sin(math.radians(6.6)) ** 2) * (1.0 - 0.5 * 0.3 / 0.7)
    assert frictionless_stiffness_change(0.3, slope) == pytest.approx(expected, rel=0.02)
    assert frictionless_stiffness_change(0.0, slope) == pytest.approx(
        -(math.sin(math.radians(6.6)) ** 2), rel=ROUND_OFF * 1e3
    )
    assert frictionless_stiffness_change(0.3, 0.0) == pytest.approx(0.0, abs=ROUND_OFF)


def energy(poisson, *, tangential):
    """Return the integral over all directions of sigma:eps r^4 / 2, E = 1, under a unit load at z = 0.

    The stresses times 2 pi r^2 on the surface are Johnson's (3.20a) and (3.76).
    """
    c, s, free = np.cos(ANGLES), np.sin(ANGLES), 1.0 - 2.0 * poisson
    x, y, t = free * (c**2 - s**2), free * (s**2 - c**2), 2.0 * free * c * s
    if tangential:
        x = c * (-3.0 * c**2 + free * (3.0 * c**2 - 2.0))
        y = c * (-3.0 * s**2 + free * 3.0 * s**2)
        t = s * (-3.0 * c**2 + free * (3.0 * c**2 - 1.0))
    density = x**2 + y**2 - 2.0 * poisson * x * y + 2.0 * (1.0 + poisson) * t**2
    return float(density.mean() / (4.0 * np.pi))


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_log_term_is_the_strain_energy_that_the_removed_skin_held(poisson):
    normal, tangential = (energy(poisson, tangential=kind) for kind in (False, True))
    assert log_coefficient(poisson, 0.0) == pytest.approx(normal, rel=1e3 * ROUND_OFF, abs=ROUND_OFF)
    share = math.sin(math.radians(20.0)) ** 2
    expected = (1.0 - share) * normal + share * tangential
    assert log_coefficient(poisson, math.tan(math.radians(20.0))) == pytest.approx(expected, rel=1e3 * ROUND_OFF)
