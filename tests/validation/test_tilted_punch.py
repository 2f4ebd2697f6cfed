"""Tilted punches in full contact on a half-space, M over theta.

Circle 4/3 E* r^3: Johnson, Contact Mechanics (1985), section 3.4, doi:10.1017/CBO9781139171731.
Square 0.08277 pi E* a^3: boundary elements, 48 graded cells a side, not extrapolated, hence 3e-4 below the limit.
"""

import numpy as np

from solve.halfspace.punch import circle_punch, square_punch


def test_tilt_stiffness_of_the_circle():
    np.testing.assert_allclose(circle_punch(3).tilt_stiffness, 4.0 / 3.0 * 0.5**3, rtol=1e-12)


def test_tilt_stiffness_of_the_square():
    found = square_punch(3).tilt_stiffness / np.pi
    assert 0.08277 < found < 0.08277 * (1.0 + 5e-4)


def test_square_lies_between_its_inner_and_outer_circle():
    """A larger footprint is stiffer, in tilt as in indentation."""
    for name, power in (("flat_stiffness", 1), ("tilt_stiffness", 3)):
        inner = getattr(circle_punch(3), name)
        assert inner < getattr(square_punch(3), name) < inner * np.sqrt(2.0) ** power
