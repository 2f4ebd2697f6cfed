import numpy as np
import pytest
from skfem import ElementTetP2, MeshTet

from benchmarks.bars.truths import TRUTHS
from reference.direct_fruit import (
    check_balance,
    direct_compliance,
    tip_stiffness,
)
from reference.fruit_meshes import fruit_mesh, fruit_meshes, solved_block
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.elasticity import stiffness_matrix, vector_basis
from solve.linear import SolveError

TIPS = Tips(side_mm=1.0, spacing_mm=8.0)
BLOCK = Fruit(length_mm=20.0, width_mm=20.0, height_mm=12.0, poisson=0.3)
TRUTH = {0.3: TRUTHS["paper's block"], 0.45: TRUTHS["paper's block, nu 0.45"]}
SOLVER = 1e-9  # relative accuracy asked of each linear solve


@pytest.fixture(scope="module")
def meshes():
    """Return a family of three meshes, each four times as coarse as that of the product."""
    return tuple(fruit_mesh(solved_block(BLOCK, TIPS), BLOCK, TIPS, scale) for scale in (4.0, 2.0, 1.0))


@pytest.fixture(scope="module", params=[pytest.param(0.3, marks=pytest.mark.study), 0.45])
def reference(request, meshes):
    """Return the result and the reference: on the meshes of the product, and at 0.45 on the next coarser family."""
    family = meshes if request.param > 0.3 else fruit_meshes(BLOCK, TIPS)
    return direct_compliance(family, request.param), TRUTH[request.param].values, family


def test_reference_lies_inside_the_error_bars(reference):
    found, (s11_less_s12, s11), _ = reference
    (low, cross), (cross_again, high) = found.S
    assert low == high
    assert cross == cross_again
    assert abs(low - s11) <= found.error_own * low
    bar = found.error_pair * (low - cross)
    assert abs((low - cross) - s11_less_s12) <= bar
    assert abs(cross - (s11 - s11_less_s12)) <= bar


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
