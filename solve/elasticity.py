"""Small-strain isotropic elasticity on any scikit-fem mesh: the stiffness matrix, and fields from a solution."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from skfem import CellBasis, Element, ElementVector, Mesh

Floats = NDArray[np.float64]


def lame_parameters(E: float, poisson: float) -> tuple[float, float]:
    """Return Lame's lambda and mu [unit of E]."""
    return E * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), 0.5 * E / (1.0 + poisson)


def stress(gradient: Floats, E: float, poisson: float) -> Floats:
    """Return sigma [unit of E] of a displacement gradient, shape (3, 3, ...)."""
    lam, mu = lame_parameters(E, poisson)
    spread = np.multiply.outer(np.eye(3), np.trace(gradient))
    return np.asarray(mu * (gradient + gradient.swapaxes(0, 1)) + lam * spread, dtype=np.float64)


def von_mises(sigma: Floats) -> Floats:
    """Return the equivalent stress of sigma (3, 3, ...) [unit of sigma]."""
    deviator = sigma - np.multiply.outer(np.eye(3), np.trace(sigma)) / 3.0
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1))))


def vector_basis(mesh: Mesh, element: Element, order: int) -> CellBasis:
    """Return the displacement basis of a scalar element; `order` is the polynomial degree integrated exactly."""
    return CellBasis(mesh, ElementVector(element), intorder=order)


def stiffness_matrix(basis: CellBasis, E: float, poisson: float) -> csc_matrix:
    """Return the matrix of a(u, v) = int lambda div u div v + 2 mu eps(u):eps(v), shape (dofs, dofs).

    Same matrix as `skfem.models.elasticity.linear_elasticity` assembles, an order faster: the scalar gradient
    products M_ijab = int d_a N_i d_b N_j are formed for all elements at once, and the vector blocks are sums of them.
    """
    lam, mu = lame_parameters(E, poisson)
    scalar = basis.with_element(basis.elem.elem)
    gradients = np.stack([np.asarray(field[0].grad) for field in scalar.basis])  # (nodes, 3, elements, points)
    nodes, dim, elements, points = gradients.shape
    G = np.ascontiguousarray(gradients.transpose(2, 0, 1, 3)).reshape(elements, nodes * dim, points)
    M = (G * scalar.dx[:, None, :]) @ G.transpose(0, 2, 1)
    M = M.reshape(elements, nodes, dim, nodes, dim)
    trace = np.einsum("eiaja->eij", M)
    blocks = lam * M + mu * M.transpose(0, 1, 4, 3, 2)
    for a in range(dim):
        blocks[:, :, a, :, a] += mu * trace
    size = nodes * dim
    dofs = basis.element_dofs.T  # (elements, size): node by node, component inside, as ElementVector orders them
    rows = np.repeat(dofs, size, axis=1).ravel()
    columns = np.tile(dofs, (1, size)).ravel()
    return csc_matrix((blocks.reshape(elements, size * size).ravel(), (rows, columns)), shape=(basis.N, basis.N))
