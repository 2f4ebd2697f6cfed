"""Circular punch on a layer bonded to a rigid base: kappa = F / (2 a E* d).

Lebedev and Ufliand, J. Appl. Math. Mech. 22 (1958) 442; Hayes et al., J. Biomech. 5 (1972) 541,
doi:10.1016/0021-9290(72)90010-3.
"""

import numpy as np
import pytest
from layer_equations import bonded, circle_stiffness

from sensor.design.fruit import Fruit
from solve.fruit.footprints import Footprint
from solve.fruit.split import LEVELS, footprint_compliance
from solve.halfspace.punch import circle_punch

A_OVER_H = (0.2, 0.4, 0.6, 0.8, 1.0)
KAPPA = {0.3: (1.207, 1.473, 1.785, 2.126, 2.484), 0.5: (1.281, 1.684, 2.213, 2.860, 3.619)}
TABLE_UNCERTAINTY = 0.002


def kappa(poisson, ratio):
    return circle_stiffness(lambda u: bonded(u, poisson) - 1.0, ratio)


@pytest.mark.parametrize("poisson", KAPPA)
def test_integral_equation_gives_the_published_table(poisson):
    found = [kappa(poisson, ratio) for ratio in A_OVER_H]
    np.testing.assert_allclose(found, KAPPA[poisson], atol=TABLE_UNCERTAINTY)


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
@pytest.mark.parametrize("ratio", [0.2, 0.4, 0.5])
def test_wide_block_is_the_layer(poisson, ratio):
    """The split on a block 16 heights wide, sides up to its bound, the height; the mesh error goal is 5e-4."""
    height = 5.0
    block = Fruit(length_mm=16.0 * height, width_mm=16.0 * height, height_mm=height, poisson=poisson)
    found = footprint_compliance(block, [Footprint(0.0, 0.0, 2.0 * ratio * height, circle_punch)], LEVELS[0]).S[0, 0]
    expected = (1.0 - poisson**2) / (2.0 * ratio * height * kappa(poisson, ratio))
    np.testing.assert_allclose(found, expected, rtol=5e-4)
