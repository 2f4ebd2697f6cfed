import numpy as np
import pytest
from skfem import ElementTetP2, MeshTet

from reference.direct_fruit import (
    check_balance,
    tip_stiffness,
)
from solve.elasticity import stiffness_matrix, vector_basis
from solve.linear import SolveError

SOLVER = 1e-9  # relative accuracy asked of each linear solve


def column():
    """Return a quarter of a column, pressed over its whole top: 2 x 3 mm, 4 mm high."""
    mesh = MeshTet.init_tensor(np.linspace(0, 2, 3), np.linspace(0, 3, 3), np.linspace(-4, 0, 4))
    return mesh.with_boundaries(
        {
            "base": lambda x: x[2] < -4.0 + 1e-9,
            "high_tip": lambda x: x[2] > -1e-9,
            "symmetry_x": lambda x: x[0] < 1e-9,
            "symmetry_y": lambda x: x[1] < 1e-9,
        }
    )


def test_column_on_a_sliding_base_has_the_stiffness_of_a_bar():
    E, poisson = 2.5, 0.3
    basis = vector_basis(column(), ElementTetP2(), 2)
    held = {"base": ("u^3",), "symmetry_x": ("u^1",), "symmetry_y": ("u^2",)}
    found = tip_stiffness(basis, stiffness_matrix(basis, E, poisson), held, ("high_tip",))
    assert found == pytest.approx(np.array([[E * 2.0 * 3.0 / 4.0]]), rel=SOLVER)


def test_reactions_that_do_not_balance_or_are_not_reciprocal_are_refused():
    balanced = np.array([[2.0, -0.1], [-0.1, 3.0]])
    check_balance(balanced, -balanced.sum(axis=0))
    with pytest.raises(SolveError):
        check_balance(balanced, -balanced.sum(axis=0) * (1.0 + 1e-6))
    skew = balanced + np.array([[0.0, 1e-6], [0.0, 0.0]])
    with pytest.raises(SolveError):
        check_balance(skew, -skew.sum(axis=0))
    with pytest.raises(SolveError):
        check_balance(balanced, np.array([np.nan, 0.0]))
