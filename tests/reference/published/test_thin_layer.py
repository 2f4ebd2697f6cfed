"""A wide flat punch on a thin bonded layer: F = M A d / h with the oedometric modulus M, plus an edge term ~ h / a.

M = E (1 - nu) / ((1 + nu)(1 - 2 nu)): Johnson, Contact Mechanics (1985), section 5.8, doi:10.1017/CBO9781139171731.
Solved by plain finite elements, as the product refuses a tip that is wider than the fruit is high.
"""

import numpy as np

from reference.direct_fruit import mesh_compliance
from reference.fruit_meshes import fruit_mesh, solved_block
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

SIDE, POISSON = 8.0, 0.3
MODULUS = (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))


def test_layer_tends_to_uniform_compression():
    """The excess over M A / h is c h / a: halving the height halves it; the next term and the mesh leave 3 %."""
    excess = []
    for height in (1.0, 0.5):
        fruit = Fruit(length_mm=28.0, width_mm=14.0, height_mm=height, poisson=POISSON)
        tips = Tips(side_mm=SIDE, spacing_mm=14.0)
        S = mesh_compliance(fruit_mesh(solved_block(fruit, tips), fruit, tips, 1.0), POISSON).S
        excess.append(height / (S[0, 0] * MODULUS * SIDE**2) - 1.0)
        assert abs(S[0, 1]) < 1e-3 * S[0, 0]
    assert 0.0 < excess[1] < excess[0] < 0.4
    np.testing.assert_allclose(2.0 * excess[1] - excess[0], 0.0, atol=0.03)
