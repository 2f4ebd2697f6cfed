"""Rigid frictionless rectangle a x b on a half-space, F = f E* d a.

Fit of foundation engineering: K = 2 G l / (1 - nu) (0.73 + 1.54 (b/l)^0.75) with half-sides l >= b, G. Gazetas,
Foundation Vibrations, in: Foundation Engineering Handbook (1991), chapter 15.
"""

import numpy as np
import pytest

from solve.halfspace.punch import rectangle_punch

FIT = 0.02  # the fit gives 1.135 for the square, where 1.1523 is exact: 1.5 %
GRIDS = 1e-4


@pytest.mark.parametrize("aspect", [1.0, 1.5, 2.0, 4.0])
def test_stiffness_follows_the_fit_of_foundations(aspect):
    """With half-side b = 1/2 and G / (1 - nu) = E* / 2: F / (E* d) = aspect / 2 (0.73 + 1.54 aspect^-0.75)."""
    expected = 0.5 * aspect * (0.73 + 1.54 * aspect**-0.75)
    assert rectangle_punch(aspect, 3).flat_stiffness == pytest.approx(expected, rel=FIT)


@pytest.mark.parametrize("aspect", [1.5, 2.0, 4.0])
def test_a_turned_rectangle_is_as_stiff(aspect):
    """The table is for side 1 along x: a turned one, scaled, has other cells and must give the same force."""
    turned = aspect * rectangle_punch(1.0 / aspect, 3).flat_stiffness
    assert rectangle_punch(aspect, 3).flat_stiffness == pytest.approx(turned, rel=GRIDS)


def test_longer_faces_are_stiffer_but_less_than_in_proportion():
    found = np.array([rectangle_punch(aspect, 3).flat_stiffness for aspect in (1.0, 1.5, 2.0, 4.0)])
    assert np.all(np.diff(found) > 0.0)
    assert np.all(np.diff(found / np.array([1.0, 1.5, 2.0, 4.0])) < 0.0)
