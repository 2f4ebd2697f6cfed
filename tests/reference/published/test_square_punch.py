"""Square punch on a half-space: the electrified square plate.

Capacity of the unit square plate 0.36679: F. H. Read, J. Comput. Phys. 133 (1997) 1, doi:10.1006/jcph.1996.5519;
a rigid frictionless punch of side a answers F = pi C a E* d = 1.15230 a E* d.
"""

import numpy as np

from sensor.design.fruit import Fruit
from solve.fruit.box import Grading
from solve.fruit.footprints import Footprint
from solve.fruit.split import footprint_compliance
from solve.halfspace.punch import square_punch

STIFFNESS = np.pi * 0.366789
# sixth digit of the capacity; extrapolated boundary elements differ in it
TOLERANCE = 1e-5
GRADING = Grading(0.7, (0.7, 0.21, 0.09))


def test_stiffness_of_the_square_punch():
    np.testing.assert_allclose(square_punch(3).flat_stiffness, STIFFNESS, rtol=TOLERANCE)


def test_block_grows_into_the_half_space():
    """A block of size H differs from the half-space by c / H: two sizes give the limit (1 - nu^2) / 1.1523."""
    nu = 0.3
    sizes = np.array([100.0, 200.0])
    found = []
    for size in sizes:
        block = Fruit(length_mm=size, width_mm=size, height_mm=0.5 * size, poisson=nu)
        found.append(footprint_compliance(block, [Footprint(0.0, 0.0, 1.0)], GRADING).S[0, 0])
    limit = (sizes[1] * found[1] - sizes[0] * found[0]) / (sizes[1] - sizes[0])
    # the next term is (side / H)^3, 1e-6 here
    np.testing.assert_allclose(limit, (1.0 - nu**2) / STIFFNESS, rtol=TOLERANCE)
