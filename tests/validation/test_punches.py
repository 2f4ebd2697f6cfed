"""Rigid punches on a half-space and on a layer bonded to a rigid base, against closed forms and published numbers.

Circle: I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47, doi:10.1016/0020-7225(65)90019-4; K. L. Johnson, Contact Mechanics
(1985), section 3.4. Square: capacity 0.36679 of the unit plate, F. H. Read, J. Comput. Phys. 133 (1997) 1,
doi:10.1006/jcph.1996.5519. Layer: N. N. Lebedev, Y. S. Ufliand, J. Appl. Math. Mech. 22 (1958) 442; W. C. Hayes et al.,
J. Biomech. 5 (1972) 541, doi:10.1016/0021-9290(72)90010-3. Tables are for the side or diameter 1 and E* = 1.
"""

import numpy as np
import pytest

from cad.design.fruit import Fruit
from solve.fruit.footprints import Footprint
from solve.fruit.split import LEVELS, footprint_compliance
from solve.halfspace.punch import circle_punch, square_punch

R = 0.5
SQUARE = np.pi * 0.366789
SIXTH_DIGIT = 1e-5  # of the capacity
# F / (2 a E* d) by nu and a / h: the integral equation at 24 Gauss points, which meets Hayes's three digits; nu 0.4999
# stands for the published 0.5.
KAPPA = {
    (0.3, 0.2): 1.206558241,
    (0.3, 0.4): 1.472612002,
    (0.3, 0.5): 1.624025413,
    (0.4999, 0.2): 1.280568974,
    (0.4999, 0.4): 1.683514623,
    (0.4999, 0.5): 1.932617781,
}


def tilt_stiffness(punch):
    """Return M / (E* theta side^3) of a punch turned about its y axis."""
    x = punch.nodes[:, 0]
    return x @ punch.stiffness @ x


@pytest.mark.parametrize("nodes", [3, 5, 9])
def test_circle_is_exact(nodes):
    """Flat 2 r E* d; under the profile d = rho^2 in full contact 4/3 E* r^3; tilt 4/3 E* r^3 theta."""
    table = circle_punch(nodes)
    profile = (table.nodes**2).sum(axis=1)
    found = [table.flat_stiffness, (table.stiffness @ profile).sum(), tilt_stiffness(table)]
    np.testing.assert_allclose(found, [2.0 * R, 4.0 / 3.0 * R**3, 4.0 / 3.0 * R**3], rtol=1e-12)


def test_square_is_as_stiff_as_the_electrified_plate_and_tilts_as_boundary_elements_say():
    """0.08277 pi E* a^3: 48 graded cells a side, not extrapolated, hence 3e-4 below the limit."""
    table = square_punch(3)
    np.testing.assert_allclose(table.flat_stiffness, SQUARE, rtol=SIXTH_DIGIT)
    assert 0.08277 < tilt_stiffness(table) / np.pi < 0.08277 * (1.0 + 5e-4)


def test_block_grows_into_the_half_space():
    """A block of size H differs from the half-space by c / H: two sizes give the limit (1 - nu^2) / 1.1523."""
    found = []
    for size in (100.0, 200.0):
        block = Fruit(length_mm=size, width_mm=size, height_mm=0.5 * size, poisson=0.3)
        found.append(footprint_compliance(block, [Footprint(0.0, 0.0, 1.0)], LEVELS[0]).S[0, 0])
    # the next term is (side / H)^3, 1e-6 here
    np.testing.assert_allclose(2.0 * found[1] - found[0], (1.0 - 0.3**2) / SQUARE, rtol=SIXTH_DIGIT)


@pytest.mark.parametrize(("poisson", "ratio"), KAPPA)
def test_wide_block_is_the_bonded_layer(poisson, ratio):
    """A block 16 heights wide, sides up to its bound, the height; the mesh error goal is 5e-4."""
    height = 5.0
    block = Fruit(length_mm=16.0 * height, width_mm=16.0 * height, height_mm=height, poisson=poisson)
    found = footprint_compliance(block, [Footprint(0.0, 0.0, 2.0 * ratio * height, circle_punch)], LEVELS[0]).S[0, 0]
    assert found == pytest.approx((1.0 - poisson**2) / (2.0 * ratio * height * KAPPA[poisson, ratio]), rel=5e-4)
