"""Hertz's contact against its own other forms, the tables of ASAE S368 and SciPy's elliptic integrals."""

import math

import pytest
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


@pytest.mark.parametrize(
    ("theta_deg", "K"),
    [(90, 1.351), (80, 1.342), (70, 1.314), (60, 1.267), (50, 1.198)],
)
def test_equivalent_radius_gives_the_factor_of_the_standard(theta_deg, K):
    """ASAE S368: E = 0.338 K^(3/2) F (1 - nu^2) D^(-3/2) (1/R + 1/R')^(1/2), K over cos(theta) in its table.

    The table is old and has three digits; cos(theta) = (1/R - 1/R') / (1/R + 1/R').
    """
    cosine = math.cos(math.radians(theta_deg))
    small, large = 1.0 / (1.0 + cosine), 1.0 / (1.0 - cosine)
    of_the_standard = 0.338 * K**1.5 * math.sqrt(1.0 / small + 1.0 / large)
    assert 0.75 / math.sqrt(equivalent_radius(small, large)) == pytest.approx(of_the_standard, rel=2e-3)


@pytest.mark.parametrize("ratio", [1.001, 1.2, 3.0, 20.0])
def test_ellipse_of_contact_has_the_force_of_its_integrals(ratio):
    """An independent form, Johnson (3.66) to (3.70), with e the eccentricity and a = 1 the larger axis.

    1/(2 R') = C (K - E) / e^2, 1/(2 R) = C (E/(1 - e^2) - K) / e^2, d = C K and F / E* = 2 pi C / 3.
    """
    least, most = 1e-9, 1.0 - 1e-15
    for _ in range(200):
        m = 0.5 * (least + most)  # e^2
        if (ellipe(m) / (1.0 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) > ratio:
            most = m
        else:
            least = m
    large = ratio
    C_a = (1.0 / (2.0 * large)) * m / (ellipk(m) - ellipe(m))  # C for a = 1: curvature = C a^2 ... at a = 1
    depth = C_a * ellipk(m)
    force = C_a * 2.0 * math.pi / 3.0  # over E*
    sphere = equivalent_radius(1.0, large)
    assert 4.0 / 3.0 * math.sqrt(sphere) * depth**1.5 == pytest.approx(force, rel=1e-6)


def test_alike_radii_are_a_sphere_and_order_does_not_matter():
    assert equivalent_radius(35.0, 35.0) == pytest.approx(35.0, rel=1e-14)
    assert equivalent_radius(35.0, 35.0 * (1.0 + 1e-6)) == pytest.approx(35.0, rel=1e-6)
    assert equivalent_radius(20.0, 45.0) == equivalent_radius(45.0, 20.0)
