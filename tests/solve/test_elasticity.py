import numpy as np
import pytest
from skfem import ElementHex1, ElementHex2, ElementTetP1, ElementTetP2, MeshHex, MeshTet, asm
from skfem.models.elasticity import linear_elasticity

from solve.elasticity import lame_parameters, stiffness_matrix, vector_basis
from solve.linear import factorised

E, POISSON = 2.5, 0.3
# element, polynomial degree integrated exactly on an affine mesh
ELEMENTS = {
    "tet 1": (ElementTetP1, 1),
    "tet 2": (ElementTetP2, 2),
    "hex 1": (ElementHex1, 2),
    "hex 2": (ElementHex2, 4),
}


def distorted(name: str, rng: np.random.Generator):
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


def linear_field(basis, G: np.ndarray) -> np.ndarray:
    """Return the dofs of u = G x."""
    u = np.zeros(basis.N)
    for component in range(3):
        dofs = basis.get_dofs(elements=np.arange(basis.mesh.nelements)).all(f"u^{component + 1}")
        u[dofs] = G[component] @ basis.doflocs[:, dofs]
    return u


def test_lame_parameters_are_those_of_the_textbook():
    lam, mu = lame_parameters(E, POISSON)
    assert 2.0 * mu * (1.0 + POISSON) == pytest.approx(E)
    assert mu * (3.0 * lam + 2.0 * mu) / (lam + mu) == pytest.approx(E)
    assert lam / (2.0 * (lam + mu)) == pytest.approx(POISSON)


def test_patch_of_distorted_elements_carries_a_linear_field_exactly(basis, rng):
    G = rng.normal(size=(3, 3))
    exact = linear_field(basis, G)
    boundary = basis.get_dofs().all()
    factor = factorised(stiffness_matrix(basis, E, POISSON), boundary)
    u = factor.solve(np.zeros(basis.N), exact[factor.fixed])
    assert np.abs(u - exact).max() <= 1e-12 * np.abs(exact).max()


def test_matrix_is_symmetric_and_has_six_rigid_body_modes_and_no_more(basis):
    if basis.N > 400:
        basis = vector_basis(type(basis.mesh)(), basis.elem.elem, order=4)
    K = stiffness_matrix(basis, E, POISSON).toarray()
    assert np.abs(K - K.T).max() <= 1e-13 * np.abs(K).max()
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() <= 1e-13 * values[-1]
    assert values[6] >= 1e-6 * values[-1]


def test_matrix_is_that_of_the_stock_assembly(basis):
    stock = asm(linear_elasticity(*lame_parameters(E, POISSON)), basis)
    assert abs(stiffness_matrix(basis, E, POISSON) - stock).max() <= 1e-13 * abs(stock).max()
