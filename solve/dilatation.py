"""Stiffness of hexahedra that do not lock as nu tends to 0.5: the dilatation is projected on linear functions."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from skfem import CellBasis

from solve.elasticity import lame_parameters

Floats = NDArray[np.float64]


def projected_stiffness(basis: CellBasis, E: float, poisson: float) -> csc_matrix:
    """Return the matrix of int lambda P(div u) P(div v) + 2 mu eps(u):eps(v), shape (dofs, dofs).

    P projects on 1, X, Y, Z within each cell, X Y Z its reference coordinates. With 27-node hexahedra this is the
    Q2 / P1 pair with the pressure condensed, stable for every nu < 0.5: Boffi, Brezzi, Fortin, Mixed Finite Element
    Methods (2013), chapter 8, doi:10.1007/978-3-642-36519-5.
    """
    lam, mu = lame_parameters(E, poisson)
    scalar = basis.with_element(basis.elem.elem)
    gradients = np.stack([np.asarray(field[0].grad) for field in scalar.basis])  # (nodes, 3, cells, points)
    nodes, dim, cells, points = gradients.shape
    size = nodes * dim
    G = np.ascontiguousarray(gradients.transpose(2, 0, 1, 3)).reshape(cells, size, points)
    M = ((G * scalar.dx[:, None, :]) @ G.transpose(0, 2, 1)).reshape(cells, nodes, dim, nodes, dim)
    blocks = mu * M.transpose(0, 1, 4, 3, 2)
    trace = np.einsum("eiaja->eij", M)
    for a in range(dim):
        blocks[:, :, a, :, a] += mu * trace
    blocks = blocks.reshape(cells, size, size) + lam * _dilatation(G, scalar)
    dofs = basis.element_dofs.T
    rows, columns = np.repeat(dofs, size, axis=1).ravel(), np.tile(dofs, (1, size)).ravel()
    return csc_matrix((blocks.ravel(), (rows, columns)), shape=(basis.N, basis.N))


def _dilatation(G: Floats, scalar: CellBasis) -> Floats:
    """Return int P(div N_i) P(div N_j) for every cell, shape (cells, size, size)."""
    X = 2.0 * scalar.quadrature[0] - 1.0
    linear = np.concatenate([np.ones((1, X.shape[-1])), X])
    weighted = linear[None] * scalar.dx[:, None, :]  # (cells, 4, points)
    moments = weighted @ G.transpose(0, 2, 1)
    mass = weighted @ linear.T
    return np.asarray(moments.transpose(0, 2, 1) @ np.linalg.solve(mass, moments))
