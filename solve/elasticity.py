"""Small-strain isotropic elasticity on any scikit-fem mesh: the stiffness matrix, and fields from a solution."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis, Element, Mesh

from sensor.arrays import Floats, Ints
from solve.displacement_basis import DisplacementBasis, scalar_gradients

Quantity = TypeVar("Quantity", float, Floats)


def lame_parameters(E: Quantity, poisson: Quantity) -> tuple[Quantity, Quantity]:
    """Return Lame's lambda and mu [unit of E]."""
    return E * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), 0.5 * E / (1.0 + poisson)


def stress(gradient: Floats, E: Quantity, poisson: Quantity) -> Floats:
    """Return sigma [unit of E] of a displacement gradient, shape (3, 3, ...); E is one number, or one for each."""
    lam, mu = lame_parameters(E, poisson)
    dilatation = np.multiply.outer(np.eye(3), np.trace(gradient))
    return np.asarray(mu * (gradient + gradient.swapaxes(0, 1)) + lam * dilatation, dtype=np.float64)


def strain(sigma: Floats, E: float, poisson: float) -> Floats:
    """Return the strain [1] that Hooke's law gives for sigma [unit of E], shape (3, 3, ...)."""
    dilatation = np.multiply.outer(np.eye(3), np.trace(sigma))
    return np.asarray(((1.0 + poisson) * sigma - poisson * dilatation) / E, dtype=np.float64)


def von_mises(sigma: Floats) -> Floats:
    """Return the equivalent stress of sigma (3, 3, ...) [unit of sigma]."""
    deviator = sigma - np.multiply.outer(np.eye(3), np.trace(sigma)) / 3.0
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1))))


def vector_basis(mesh: Mesh, element: Element, order: int) -> CellBasis:
    """Return the displacement basis of a scalar element; `order` is the polynomial degree integrated exactly."""
    return DisplacementBasis(mesh, element, order)


def stiffness_matrix(
    basis: CellBasis, E: float | Floats, poisson: float | Floats, *, b_bar: bool = False
) -> csc_matrix:
    """Return the stiffness matrix of isotropic elasticity, shape (dofs, dofs) [E times mm].

    It is that of a(u, v) = int lambda div u div v + 2 mu eps(u):eps(v). E and Poisson's ratio are each one number, or
    one for each element.

    `skfem.models.elasticity.linear_elasticity` assembles the same matrix, ten times slower. Here the products of scalar
    gradients are formed for all elements at once. They are M_iajb = int d_a N_i d_b N_j, with nodes i, j and axes a, b.
    The element matrix is lambda M_iajb + mu M_ibja + mu delta_ab sum_c M_icjc.

    With `b_bar` the dilatation div u is projected on linear functions within each element (the B-bar method). Hexahedra
    then do not lock as nu tends to 0.5. With 27-node hexahedra this is the Q2 / P1 pair with the pressure condensed,
    stable for every nu < 0.5. See Boffi, Brezzi, Fortin, Mixed Finite Element Methods (2013), chapter 8,
    doi:10.1007/978-3-642-36519-5.
    """
    moduli = np.reshape(np.asarray(E, dtype=np.float64), (-1, 1, 1, 1, 1))
    ratios = np.reshape(np.asarray(poisson, dtype=np.float64), (-1, 1, 1, 1, 1))
    lam, mu = lame_parameters(moduli, ratios)
    gradients = scalar_gradients(basis)
    nodes, dim, elements, points = gradients.shape
    size = nodes * dim
    G = np.ascontiguousarray(gradients.transpose(2, 0, 1, 3)).reshape(elements, size, points)
    M = ((G * basis.dx[:, None, :]) @ G.transpose(0, 2, 1)).reshape(elements, nodes, dim, nodes, dim)
    dilatation = _projected_dilatation(G, basis).reshape(M.shape) if b_bar else M
    blocks = lam * dilatation + mu * M.transpose(0, 1, 4, 3, 2)
    # An einsum that sums nothing is a view: the term of delta_ab is added to the blocks with a = b in place.
    same_axis = np.einsum("eiaja->aeij", blocks)
    same_axis[:] += mu[..., 0, 0] * np.einsum("eiaja->eij", M)
    return assemble_elements(blocks.reshape(elements, size, size), basis.element_dofs.T, basis.N)


def _projected_dilatation(G: Floats, basis: CellBasis) -> Floats:
    """Return int P(div N_i) P(div N_j), P the projection on 1, X, Y, Z of the element, shape (elements, size, size)."""
    X = 2.0 * basis.quadrature[0] - 1.0
    linear = np.concatenate([np.ones((1, X.shape[-1])), X])
    weighted = linear[None] * basis.dx[:, None, :]  # (elements, 4, points)
    moments = weighted @ G.transpose(0, 2, 1)
    mass = weighted @ linear.T
    return np.asarray(moments.transpose(0, 2, 1) @ np.linalg.solve(mass, moments))


def assemble_elements(blocks: Floats, dofs: Ints, size: int) -> csc_matrix:
    """Return the sum of element matrices (elements, n, n) at their dofs (elements, n), shape (size, size)."""
    n = dofs.shape[1]
    rows = np.repeat(dofs, n, axis=1).ravel()
    columns = np.tile(dofs, (1, n)).ravel()
    return csc_matrix((blocks.ravel(), (rows, columns)), shape=(size, size))


@dataclass(frozen=True, kw_only=True, eq=False)
class NodalFields:
    """Displacement [mm], shape (nodes, 3), stress [MPa] and strain [1], both (3, 3, nodes)."""

    displacement: Floats
    stress: Floats
    strain: Floats

    @property
    def von_mises(self) -> Floats:
        """Return the equivalent stress [MPa], shape (nodes,)."""
        return von_mises(self.stress)

    @property
    def largest_principal_strain(self) -> Floats:
        """Return the principal strain that is largest in size, without its sign [1], shape (nodes,)."""
        principal = np.linalg.eigvalsh(self.strain.transpose(2, 0, 1))
        return np.asarray(np.abs(principal).max(axis=1))
