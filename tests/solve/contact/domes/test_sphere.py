"""The contact of a rigid sphere pressed into a half-space, by Segedin's and Sneddon's formulas."""

import numpy as np
import pytest

from solve.contact.domes.sphere import sphere_contact_radius

SPHERE, CURVATURE = 2.0, 1.0 / 35.0


def depth_at(a, sphere=SPHERE, curvature=CURVATURE):
    return a * np.arctanh(a / sphere) + a**2 * curvature


@pytest.mark.parametrize("share", [1e-4, 0.05, 0.0999, 0.1001, 0.5, 0.9, 0.99])
def test_contact_radius_belongs_to_its_depth(share):
    a = np.array([share * SPHERE])
    np.testing.assert_allclose(sphere_contact_radius(depth_at(a), SPHERE, CURVATURE), a, rtol=1e-10)
