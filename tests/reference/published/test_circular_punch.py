"""Circular punch on a half-space, closed forms.

Sneddon, Int. J. Eng. Sci. 3 (1965) 47, doi:10.1016/0020-7225(65)90019-4.
Of radius r: F = 2 r E* d; under the profile d = rho^2 in full contact F = 4/3 E* r^3; tilt M = 4/3 E* r^3 theta
(Johnson, Contact Mechanics (1985), section 3.4). Tables are for the diameter 1 and E* = 1.
"""

import numpy as np
import pytest

from solve.halfspace.punch import circle_punch

R = 0.5
# the table is a finite sum of exact terms
TOLERANCE = 1e-12


@pytest.mark.parametrize("nodes", [3, 5, 9])
def test_flat_circle(nodes):
    np.testing.assert_allclose(circle_punch(nodes).flat_stiffness, 2.0 * R, rtol=TOLERANCE)


@pytest.mark.parametrize("nodes", [3, 5, 9])
def test_paraboloid_in_full_contact(nodes):
    table = circle_punch(nodes)
    profile = (table.nodes**2).sum(axis=1)
    np.testing.assert_allclose((table.stiffness @ profile).sum(), 4.0 / 3.0 * R**3, rtol=TOLERANCE)
