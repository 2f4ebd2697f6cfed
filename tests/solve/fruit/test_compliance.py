"""A pair that stands for the tips of each kind: exact where tips of a kind carry equal forces."""

import numpy as np
import pytest

from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

INFO = SolveInfo(method="closed form", dofs=0, seconds=0.0, status="half-space")
PLACES = np.array([(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)])
LOW, HIGH = (0, 2), (1, 3)


def square():
    apart = np.hypot(*(np.subtract.outer(axis, axis) for axis in PLACES.T))
    S = 0.91 / np.where(apart > 0.0, np.pi * apart, 1.2)
    return FruitCompliance(tips=("a", "b", "c", "d"), S=S, difference_error=1e-4, s11_error=2e-4, info=INFO)


def test_forces_of_a_level_square_are_those_of_its_pair():
    contact = square()
    C = np.diag([1.0, 0.05, 1.0, 0.05])
    four = np.linalg.solve(C + contact.S / 2.0, np.full(4, 0.5))
    pair = contact.as_pair(LOW, HIGH)
    two = np.linalg.solve(np.diag([1.0, 0.05]) + pair.S / 2.0, np.full(2, 0.5))
    assert four[[0, 1]] == pytest.approx(two, rel=1e-12)
    assert (pair.difference_error, pair.s11_error) == (1e-4, 2e-4)


@pytest.mark.parametrize(("difference", "is_exact"), [(4e-16, True), (1e-9, False)])
def test_round_off_does_not_part_the_tips_of_a_pair_in_the_middle(difference, is_exact):
    """A mesh without mirror planes leaves 4e-16 between the tips of a pair in the middle of a fruit that is turned."""
    S = np.array([[0.757, 0.0078], [0.0078, 0.757 * (1.0 + difference)]])
    ratio = FruitCompliance(S=S, difference_error=1e-4, s11_error=2e-4, info=INFO).stiffness_ratio()
    assert (ratio == 1.0) == is_exact
    assert ratio == pytest.approx(1.0, abs=2e-9)
