import numpy as np
import pytest
from skfem import ElementHex1, ElementHex2, MeshHex

from solve.elasticity import stiffness_matrix, vector_basis

MESH = MeshHex.init_tensor(np.array([0.0, 0.4, 1.0]), np.array([0.0, 1.0, 1.5]), np.array([0.0, 0.3, 1.2]))
POISSON = [-0.5, 0.3, 0.4999]


def at_dofs(basis, field):
    """Return the coefficients of a displacement given as a function of x (3, dofs) -> (3, dofs)."""
    values = field(basis.doflocs)
    u = np.zeros(basis.N)
    for dofs in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs):
        for row, numbers in enumerate(dofs):
            u[numbers] = values[row % 3, numbers]
    return u


@pytest.fixture(scope="module")
def basis():
    return vector_basis(MESH, ElementHex2(), 4)


@pytest.mark.parametrize("poisson", POISSON)
def test_matrix_is_symmetric_with_six_rigid_modes(basis, poisson):
    K = stiffness_matrix(basis, 1.0, poisson, b_bar=True).toarray()
    np.testing.assert_allclose(K, K.T, atol=1e-12 * np.abs(K).max())
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < 1e-11 * values[-1]
    assert values[6] > 1e-3


def test_linear_dilatation_is_kept(basis):
    """A quadratic displacement has a linear dilatation, which the projection leaves: same energy as without it."""
    u = at_dofs(basis, lambda x: np.stack([x[0] ** 2 + x[1] * x[2], x[0] * x[1], x[2] ** 2 - x[0] * x[1]]))
    K, full = stiffness_matrix(basis, 1.0, 0.4, b_bar=True), stiffness_matrix(basis, 1.0, 0.4)
    assert u @ K @ u == pytest.approx(u @ full @ u, rel=1e-11)


def test_projected_energy_is_never_above_the_full_one():
    """A projection takes energy away and never adds any."""
    basis = vector_basis(MESH, ElementHex1(), 4)
    difference = (stiffness_matrix(basis, 1.0, 0.45) - stiffness_matrix(basis, 1.0, 0.45, b_bar=True)).toarray()
    assert np.linalg.eigvalsh(difference)[0] > -1e-12
