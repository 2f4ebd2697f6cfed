import numpy as np
import pytest
from skfem import ElementHex1, ElementHex2, ElementTetP1, ElementTetP2, Functional, MeshHex, MeshTet, asm
from skfem.helpers import dot, grad
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


def test_energy_of_a_linear_field_is_that_of_uniform_strain(basis, rng):
    G = rng.normal(size=(3, 3))
    lam, mu = lame_parameters(E, POISSON)
    strain = 0.5 * (G + G.T)
    u = linear_field(basis, G)
    energy = lam * np.trace(strain) ** 2 + 2.0 * mu * np.sum(strain**2)  # a(u, u) in a unit volume
    assert u @ stiffness_matrix(basis, E, POISSON) @ u == pytest.approx(energy, rel=1e-12)


def test_matrix_is_symmetric_and_has_six_rigid_body_modes_and_no_more(basis):
    if basis.N > 400:
        basis = vector_basis(type(basis.mesh)(), basis.elem.elem, order=4)
    K = stiffness_matrix(basis, E, POISSON).toarray()
    assert np.abs(K - K.T).max() <= 1e-13 * np.abs(K).max()
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() <= 1e-13 * values[-1]
    assert values[6] >= 1e-6 * values[-1]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_translation_and_rotation_cost_no_force(basis, axis):
    K = stiffness_matrix(basis, E, POISSON)
    spin = np.cross(np.eye(3)[axis], np.eye(3)).T  # u = axis x r
    shift = linear_field(basis, np.zeros((3, 3)))
    shift[basis.get_dofs(elements=np.arange(basis.mesh.nelements)).all(f"u^{axis + 1}")] = 1.0
    for rigid in (shift, linear_field(basis, spin)):
        assert np.abs(rigid).max() > 0.5
        assert np.abs(K @ rigid).max() <= 1e-13 * abs(K).max() * K.shape[0] ** 0.5


def test_matrix_is_that_of_the_stock_assembly(basis):
    stock = asm(linear_elasticity(*lame_parameters(E, POISSON)), basis)
    assert abs(stiffness_matrix(basis, E, POISSON) - stock).max() <= 1e-13 * abs(stock).max()


def test_wrong_lame_constant_would_be_seen_by_the_comparison(basis):
    lam, mu = lame_parameters(E, POISSON)
    planted = asm(linear_elasticity(lam * 1.001, mu), basis)
    assert abs(stiffness_matrix(basis, E, POISSON) - planted).max() > 1e-5 * abs(planted).max()


def harmonic(x: np.ndarray) -> np.ndarray:
    """Return u = grad(exp(sqrt2 x) sin y sin z): div u = 0 and laplace u = 0, so no body force, whatever nu."""
    a = np.sqrt(2.0)
    e = np.exp(a * x[0])
    sy, sz, cy, cz = np.sin(x[1]), np.sin(x[2]), np.cos(x[1]), np.cos(x[2])
    return np.stack([a * e * sy * sz, e * cy * sz, e * sy * cz])


@pytest.mark.parametrize(
    ("name", "degree", "levels"), [("tet 1", 1, (2, 3)), ("tet 2", 2, (1, 2)), ("hex 2", 2, (1, 2))]
)
def test_observed_order_is_that_of_the_element(name, degree, levels):
    element, order = ELEMENTS[name]
    errors, gradient_errors = [], []
    for level in levels:
        mesh = (MeshTet() if name.startswith("tet") else MeshHex()).refined(level)
        basis = vector_basis(mesh, element(), order)
        exact = np.zeros(basis.N)
        for component in range(3):
            dofs = basis.get_dofs(elements=np.arange(mesh.nelements)).all(f"u^{component + 1}")
            exact[dofs] = harmonic(basis.doflocs[:, dofs])[component]
        factor = factorised(stiffness_matrix(basis, E, POISSON), basis.get_dofs().all())
        u = factor.solve(np.zeros(basis.N), exact[factor.fixed])
        fine = vector_basis(mesh, element(), order=6)
        field = fine.interpolate(u)
        errors.append(np.sqrt(displacement_error.assemble(fine, u=field)))
        gradient_errors.append(np.sqrt(gradient_error.assemble(fine, u=field)))
    # A priori orders of a smooth solution: degree + 1 in L2 and degree in the gradient, to 0.3 on coarse meshes.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(degree + 1.0, abs=0.3)
    assert np.log2(gradient_errors[0] / gradient_errors[1]) == pytest.approx(degree, abs=0.3)


@Functional
def displacement_error(w):
    difference = np.asarray(w["u"]) - harmonic(w.x)
    return dot(difference, difference)


@Functional
def gradient_error(w):
    """Return the squared error of the gradient, the exact one by central differences."""
    step = 1e-5
    axes = np.eye(3)[:, :, None, None]
    exact = [(harmonic(w.x + step * axis) - harmonic(w.x - step * axis)) / (2.0 * step) for axis in axes]
    difference = grad(w["u"]) - np.stack(exact, axis=1)
    return np.einsum("ij...,ij...->...", difference, difference)
