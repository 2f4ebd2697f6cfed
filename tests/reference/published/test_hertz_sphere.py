"""Rigid sphere on a half-space: F = 4/3 E* sqrt(R) d^3/2, contact radius sqrt(R d).

Hertz, J. reine angew. Math. 92 (1882) 156; Johnson, Contact Mechanics (1985), section 4.2,
doi:10.1017/CBO9781139171731.
"""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.tips.ball import Sphere
from solve.contact.gap import tip_gap
from solve.contact.pressure_cells import contact_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.footprints import Footprint

SIDE = 0.2
RADIUS = 1.0


@pytest.fixture(scope="module")
def footprints():
    """Return cells of a footprint 5000 times smaller than its block: the half-space to 2e-4."""
    block = Fruit(length_mm=1000.0, width_mm=1000.0, height_mm=1000.0, poisson=0.3)
    return contact_cells(block, [Footprint(0.0, 0.0, SIDE)], np.linspace(-0.5, 0.5, 25))


@pytest.mark.parametrize("contact_radius", [0.05, 0.07, 0.09])
def test_force_and_radius(footprints, contact_radius):
    d = contact_radius**2 / RADIUS
    gap = tip_gap(Sphere(side_mm=2.0 * RADIUS), *footprints.local.T)
    touch = UnilateralContact(footprints).solve(d - gap, np.zeros((1, 1)))
    area = footprints.areas[touch.pressure > 0.0].sum()
    # a cell is 1/6 to 1/11 of the contact radius: force to the second order of that, radius to half a cell
    expected = 4.0 / 3.0 / (1.0 - 0.3**2) * np.sqrt(RADIUS) * d**1.5
    np.testing.assert_allclose(touch.F, expected, rtol=1e-2)
    np.testing.assert_allclose(np.sqrt(area / np.pi), contact_radius, atol=0.5 * SIDE / 24)
