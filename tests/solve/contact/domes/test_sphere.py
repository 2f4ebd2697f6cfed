"""A rigid sphere pressed into a half-space: Hertz where it is small, Segedin's and Sneddon's formulas where not."""

import numpy as np
import pytest

from solve.contact.domes.sphere import paraboloid_force, sphere_contact_radius, sphere_force

SPHERE, CURVATURE = 2.0, 1.0 / 35.0
ROUNDING = 1e-12


def depth_at(a, sphere=SPHERE, curvature=CURVATURE):
    return a * np.arctanh(a / sphere) + a**2 * curvature


@pytest.mark.parametrize("share", [1e-4, 0.05, 0.0999, 0.1001, 0.5, 0.9, 0.99])
def test_contact_radius_belongs_to_its_depth(share):
    a = np.array([share * SPHERE])
    np.testing.assert_allclose(sphere_contact_radius(depth_at(a), SPHERE, CURVATURE), a, rtol=1e-10)


@pytest.mark.parametrize("share", [0.2, 0.6, 0.95])
def test_force_of_a_sphere_on_a_flat_surface(share):
    """F / E* = (a^2 + r^2) / 2 ln((r + a) / (r - a)) - a r: Segedin 1957."""
    a = share * SPHERE
    expected = 0.5 * (a**2 + SPHERE**2) * np.log((SPHERE + a) / (SPHERE - a)) - a * SPHERE
    np.testing.assert_allclose(sphere_force(np.array(a), SPHERE, np.array(0.0)), expected, rtol=ROUNDING)


def test_stiffness_is_that_of_a_flat_punch_of_the_contact():
    """It is 2 a E* for any profile: Johnson, Contact Mechanics, (5.20) ff."""
    depth, step = np.array([0.3]), 1e-5
    low, high = (
        sphere_force(sphere_contact_radius(depth + d, SPHERE, CURVATURE), SPHERE, CURVATURE) for d in (-step, step)
    )
    a = sphere_contact_radius(depth, SPHERE, CURVATURE)
    np.testing.assert_allclose((high - low) / (2.0 * step), 2.0 * a, rtol=1e-8)


def test_paraboloid_has_the_force_of_hertz():
    """F = 4/3 E* sqrt(R) d^1.5 with a^2 = R d, Johnson (4.22) and (4.23)."""
    radius, depth = 1.0 / (1.0 / SPHERE + CURVATURE), np.array([0.0, 1e-3, 0.2])
    force = paraboloid_force(np.sqrt(radius * depth), np.array(radius))
    np.testing.assert_allclose(force, 4.0 / 3.0 * np.sqrt(radius) * depth**1.5, rtol=ROUNDING)
