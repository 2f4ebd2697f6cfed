"""Domes on a mango's ball of 35 mm against contact by finite elements that share nothing with the law."""

import pytest
from bars import bars, holds

from benchmarks.bars.domes import ball

# Linear 27-node hexahedra of the piece, 24k dofs, under loads of normal distribution with a deviation of 0.7 mm: what
# curvature adds to the compliance between neighbours and across; from 20k to 38k dofs they move by 3e-6 and 2e-6.
NEIGHBOUR_CHANGE = -0.02756043 + 0.02876697
OPPOSITE_CHANGE = -0.02654397 + 0.02752876
NEIGHBOUR = 0.0361  # times E [1/mm]


@pytest.mark.parametrize("name", bars("domes", "domes beside solids"))
def test_error_bar_holds(name):
    """Every tip of six poses is compared.

    Lifted most, the law is 0.7 mN low, 1.5 % of the force: 0.24 mN are the body's, which is solved at the feet of the
    level press on the fruit's own radius only.
    """
    holds(name)


def test_curvature_adds_to_what_neighbours_give_way():
    """To 0.12 % of the compliance between neighbours: the loads are 0.8 mm wide, not points."""
    _, compliance = ball()
    change = compliance.shape_change
    assert change[0, 1] == pytest.approx(NEIGHBOUR_CHANGE, abs=1.2e-3 * NEIGHBOUR)
    assert change[0, 2] == pytest.approx(OPPOSITE_CHANGE, abs=1.2e-3 * NEIGHBOUR)
