"""Hertz's contact against its own other forms and SciPy's elliptic integrals."""

import math

import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from sensor.theory.hertz import (
    approach,
    contact_radius,
    contact_reach,
    equivalent_radius,
    force_factor,
    relative_radius,
)


def test_force_factor_gives_the_force_of_an_approach():
    E_star, depth = 2.0 / (1.0 - 0.3**2), approach(1.5, 2.0, 0.3, 35.0)
    assert force_factor(E_star, 35.0) * depth**1.5 == pytest.approx(1.5, rel=1e-13)


def test_relative_radius_is_that_of_two_spheres():
    assert (relative_radius(10.0, math.inf), relative_radius(10.0, 35.0)) == (10.0, pytest.approx(350.0 / 45.0))


def test_contact_radius_is_that_of_the_force():
    """a^3 = 3 F R / (4 E*), Johnson (4.22)."""
    E_star = 2.0 / (1.0 - 0.3**2)
    assert contact_radius(1.5, 2.0, 0.3, 35.0) ** 3 == pytest.approx(3.0 * 1.5 * 35.0 / (4.0 * E_star), rel=1e-13)
    assert contact_radius(-0.1, 2.0, 0.3, 35.0) == 0.0
    assert contact_reach(0.0, 2.0, 0.3, 35.0, 0.1) == pytest.approx(3.5)


@pytest.mark.parametrize("ratio", [1.001, 1.2, 3.0, 20.0])
def test_ellipse_of_contact_has_the_force_of_its_integrals(ratio):
    """An independent form, Johnson (3.66) to (3.70), with e the eccentricity and a = 1 the larger axis.

    1/(2 R') = C (K - E) / e^2, 1/(2 R) = C (E/(1 - e^2) - K) / e^2, d = C K and F / E* = 2 pi C / 3.
    """

    def excess(m):  # m = e^2
        return (ellipe(m) / (1.0 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) - ratio

    m = brentq(excess, 1e-9, 1.0 - 1e-12, xtol=1e-15)
    C = m / (ellipk(m) - ellipe(m)) / (2.0 * ratio)
    depth, force = C * ellipk(m), C * 2.0 * math.pi / 3.0  # the force over E*
    sphere = equivalent_radius(1.0, ratio)
    assert 4.0 / 3.0 * math.sqrt(sphere) * depth**1.5 == pytest.approx(force, rel=1e-6)


def test_alike_radii_are_a_sphere_and_order_does_not_matter():
    assert equivalent_radius(35.0, 35.0) == pytest.approx(35.0, rel=1e-14)
    assert equivalent_radius(35.0, 35.0 * (1.0 + 1e-6)) == pytest.approx(35.0, rel=1e-6)
    assert equivalent_radius(20.0, 45.0) == equivalent_radius(45.0, 20.0)
