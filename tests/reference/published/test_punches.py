"""Flat, parabolic and tilted punches on a half-space, of a side or diameter of 1 and at E* = 1.

A circle of radius r: F = 2 r E* d, under the profile d = rho^2 in full contact F = 4/3 E* r^3, and tilted
M = 4/3 E* r^3 theta. I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47, doi:10.1016/0020-7225(65)90019-4; K. L. Johnson,
Contact Mechanics (1985), section 3.4, doi:10.1017/CBO9781139171731.

A square is the electrified square plate, whose capacity is 0.36679: F. H. Read, J. Comput. Phys. 133 (1997) 1,
doi:10.1006/jcph.1996.5519. F = pi C E* d = 1.15230 E* d. Tilted it has 0.08277 pi E* by boundary elements, 48 graded
cells a side, not extrapolated, hence 3e-4 below the limit.
"""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from solve.fruit.box import Grading
from solve.fruit.footprints import Footprint
from solve.fruit.split import footprint_compliance
from solve.halfspace.punch import circle_punch, square_punch

R = 0.5
SQUARE = np.pi * 0.366789
SIXTH_DIGIT = 1e-5  # of the capacity; extrapolated boundary elements differ in it
GRADING = Grading(0.7, (0.7, 0.21, 0.09))


def tilt_stiffness(punch):
    """Return M / (E* theta side^3) of a punch turned about its y axis."""
    x = punch.nodes[:, 0]
    return x @ punch.stiffness @ x


@pytest.mark.parametrize("nodes", [3, 5, 9])
def test_circle(nodes):
    """The table is a finite sum of exact terms."""
    table = circle_punch(nodes)
    paraboloid = (table.stiffness @ (table.nodes**2).sum(axis=1)).sum()
    found = table.flat_stiffness, paraboloid, tilt_stiffness(table)
    np.testing.assert_allclose(found, [2.0 * R, *2 * [4.0 / 3.0 * R**3]], rtol=1e-12)


def test_square():
    punch = square_punch(3)
    np.testing.assert_allclose(punch.flat_stiffness, SQUARE, rtol=SIXTH_DIGIT)
    assert 0.08277 < tilt_stiffness(punch) / np.pi < 0.08277 * (1.0 + 5e-4)


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
    np.testing.assert_allclose(limit, (1.0 - nu**2) / SQUARE, rtol=SIXTH_DIGIT)
