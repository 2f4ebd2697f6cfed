"""Tilted punches in full contact on a half-space, M over theta.

Circle 4/3 E* r^3: Johnson, Contact Mechanics (1985), section 3.4, doi:10.1017/CBO9781139171731.
Square 0.08277 pi E* a^3: boundary elements, 48 graded cells a side, not extrapolated, hence 3e-4 below the limit.
"""

import numpy as np

from solve.halfspace.punch import circle_punch, square_punch


def tilt_stiffness(punch):
    """Return M / (E* theta side^3) of a punch turned about its y axis."""
    x = punch.nodes[:, 0]
    return x @ punch.stiffness @ x


def test_tilt_stiffness_of_the_circle():
    np.testing.assert_allclose(tilt_stiffness(circle_punch(3)), 4.0 / 3.0 * 0.5**3, rtol=1e-12)


def test_tilt_stiffness_of_the_square():
    found = tilt_stiffness(square_punch(3)) / np.pi
    assert 0.08277 < found < 0.08277 * (1.0 + 5e-4)


def test_square_lies_between_its_inner_and_outer_circle():
    """A larger footprint is stiffer, in tilt as in indentation."""
    for stiffness, power in ((lambda punch: punch.flat_stiffness, 1), (tilt_stiffness, 3)):
        inner = stiffness(circle_punch(3))
        assert inner < stiffness(square_punch(3)) < inner * np.sqrt(2.0) ** power
