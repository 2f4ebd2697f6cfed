import numpy as np
import pytest

import solve.fruit.remainder
from solve.fruit.box import box_mesh
from solve.fruit.remainder import remainder_compliance
from solve.halfspace import potentials as halfspace
from solve.linear import SolveError

# Coarse lines of the quarter and the whole of a block 12 x 10 x 6 mm
HALVES = (np.array([0.0, 2.0, 3.6, 4.8, 5.6, 6.0]), np.array([0.0, 2.0, 3.6, 4.6, 5.0]))
DEPTH = np.array([0.0, 2.0, 4.0, 5.4, 6.0])
QUARTER = (*HALVES, DEPTH)
WHOLE = (*(np.concatenate([-line[:0:-1], line]) for line in HALVES), DEPTH)
LOADS = np.array([[2.0, 0.5], [2.5, 1.0]])
POISSON = 0.3


def test_parities_of_the_quarter_add_up_to_the_whole_block():
    """A single load is a quarter of the sum of its four mirrored families, each on the quarter of the block."""
    parities = ((1, 1), (1, -1), (-1, 1), (-1, -1))
    quarter, dofs = remainder_compliance(box_mesh(QUARTER), POISSON, LOADS, parities)
    (whole,), whole_dofs = remainder_compliance(box_mesh(WHOLE), POISSON, LOADS, ((0, 0),))
    np.testing.assert_allclose(0.25 * sum(quarter), whole, rtol=1e-9)
    assert dofs < whole_dofs


def test_parities_of_different_planes_are_refused():
    with pytest.raises(ValueError, match="parities"):
        remainder_compliance(box_mesh(QUARTER), POISSON, LOADS, ((1, 1), (1, 0)))


@pytest.mark.parametrize("component", [(0, 0), (0, 1), (0, 2), (2, 2)])
def test_a_halved_half_space_stress_breaks_reciprocity(component, monkeypatch):
    """Betti's theorem holds for true fields only; half of tau_xy moves s11 by no more than 4e-4 and is yet refused."""
    right = halfspace.stress

    def wrong(fields, poisson):
        sigma = right(fields, poisson)
        sigma[component] *= 0.5
        sigma[component[::-1]] = sigma[component]
        return sigma

    monkeypatch.setattr(solve.fruit.remainder.halfspace, "stress", wrong)
    with pytest.raises(SolveError):
        remainder_compliance(box_mesh(QUARTER), POISSON, LOADS, ((1, 1),))


def test_thin_layers_keep_their_quadrature():
    """Cells 1e-4 of the block thick: a place on a face is known without a search in the cell."""
    thin = (np.array([0.0, 2.0, 4.0, 5.9994, 6.0]), HALVES[1], np.array([0.0, 2.0, 4.0, 5.9994, 6.0]))
    (found,), _ = remainder_compliance(box_mesh(thin), POISSON, LOADS, ((1, 1),))
    (expected,), _ = remainder_compliance(box_mesh(QUARTER), POISSON, LOADS, ((1, 1),))
    np.testing.assert_allclose(found, expected, rtol=1e-2)
