import numpy as np
import pytest
from skfem import ElementHex1, ElementHex2, ElementTetP1, ElementTetP2, MeshHex, MeshTet, asm
from skfem.models.elasticity import linear_elasticity

from solve.elasticity import assemble_elements, lame_parameters, stiffness_matrix, vector_basis

E, POISSON = 2.5, 0.3
# element, polynomial degree integrated exactly on an affine mesh
ELEMENTS = {
    "tet 1": (ElementTetP1, 1),
    "tet 2": (ElementTetP2, 2),
    "hex 1": (ElementHex1, 2),
    "hex 2": (ElementHex2, 4),
}


def distorted(name, rng):
    """Return a unit cube whose inner nodes are moved at random."""
    refinements = 2 if name.startswith("tet") else 1
    mesh = (MeshTet() if name.startswith("tet") else MeshHex()).refined(refinements)
    inner = mesh.interior_nodes()
    p = mesh.p.copy()
    p[:, inner] += 0.1 / 2**refinements * rng.uniform(-1.0, 1.0, size=(3, len(inner)))
    return type(mesh)(p, mesh.t)


@pytest.fixture(params=ELEMENTS)
def basis(request, rng):
    element, order = ELEMENTS[request.param]
    return vector_basis(distorted(request.param, rng), element(), order)


def test_lame_parameters_are_those_of_the_textbook():
    lam, mu = lame_parameters(E, POISSON)
    assert 2.0 * mu * (1.0 + POISSON) == pytest.approx(E)
    assert mu * (3.0 * lam + 2.0 * mu) / (lam + mu) == pytest.approx(E)
    assert lam / (2.0 * (lam + mu)) == pytest.approx(POISSON)


def test_matrix_is_that_of_the_stock_assembly(basis):
    stock = asm(linear_elasticity(*lame_parameters(E, POISSON)), basis)
    assert abs(stiffness_matrix(basis, E, POISSON) - stock).max() <= 1e-13 * abs(stock).max()


def test_rows_and_columns_of_element_matrices_go_to_their_dofs(rng):
    """Matrices that are not symmetric would show rows in the place of columns. Nothing meets at the last dof."""
    blocks = rng.normal(size=(9, 4, 4))
    dofs = np.array([rng.permutation(7)[:4] for _ in blocks])
    expected = np.zeros((8, 8))
    for block, places in zip(blocks, dofs, strict=True):
        expected[np.ix_(places, places)] += block
    found = assemble_elements(blocks, dofs, 8)
    assert found.has_canonical_format
    np.testing.assert_allclose(found.toarray(), expected, atol=1e-14 * np.abs(expected).max())
