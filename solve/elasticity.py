"""Small-strain isotropic elasticity on any scikit-fem mesh: the stiffness matrix, stress and strain."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis, Element, Mesh

from sensor.arrays import Floats, Ints
from sensor.float_or_array import FloatOrArray
from solve.displacement_basis import DisplacementBasis, scalar_gradients

_GROUP_SIZE = 32  # number of elements whose matrices are formed at once; more would not fit into the CPU cache


def lame_parameters(E: FloatOrArray, poisson: FloatOrArray) -> tuple[FloatOrArray, FloatOrArray]:
    """Return Lame's constants lambda and mu, in the unit of E."""
    return E * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), 0.5 * E / (1.0 + poisson)


def stress(gradient: Floats, E: FloatOrArray, poisson: FloatOrArray) -> Floats:
    """Return the stress [unit of E] by Hooke's law for a displacement gradient [1], both (3, 3, ...).

    E and Poisson's ratio are each a number, or an array with one entry per gradient.
    """
    lam, mu = lame_parameters(E, poisson)
    dilatation = np.multiply.outer(np.eye(3), np.trace(gradient))
    return np.asarray(mu * (gradient + gradient.swapaxes(0, 1)) + lam * dilatation, dtype=np.float64)


def strain(sigma: Floats, E: float, poisson: float) -> Floats:
    """Return the strain [1] by Hooke's law for a stress `sigma` [unit of E], shape (3, 3, ...)."""
    dilatation = np.multiply.outer(np.eye(3), np.trace(sigma))
    return np.asarray(((1.0 + poisson) * sigma - poisson * dilatation) / E, dtype=np.float64)


def von_mises(sigma: Floats) -> Floats:
    """Return von Mises's equivalent stress (...) for a stress `sigma` (3, 3, ...), in the same unit."""
    deviator = sigma - np.multiply.outer(np.eye(3), np.trace(sigma)) / 3.0
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1))))


def vector_basis(mesh: Mesh, element: Element, order: int) -> CellBasis:
    """Return the basis of displacements, each component of which has the shape functions of a scalar element.

    `order` is the polynomial degree that the quadrature integrates exactly.
    """
    return DisplacementBasis(mesh, element, order)


def stiffness_matrix(
    basis: CellBasis, E: float | Floats, poisson: float | Floats, *, b_bar: bool = False
) -> csc_matrix:
    """Return the stiffness matrix of isotropic elasticity, shape (dofs, dofs) [E times mm].

    The bilinear form is a(u, v) = int lambda div u div v + 2 mu eps(u):eps(v). `basis` is a basis of displacements, as
    `vector_basis` returns it. E and Poisson's ratio are each a number, or an array with one entry per element.

    `skfem.models.elasticity.linear_elasticity` assembles the same matrix, but takes ten times as long. Here the
    matrices of many elements are computed at once.

    With `b_bar`, the dilatation div u is projected onto linear functions within each element (the B-bar method).
    Hexahedra then do not lock as nu tends to 0.5. For 27-node hexahedra, this is the Q2 / P1 pair with the pressure
    eliminated, which is stable for every nu < 0.5. See Boffi, Brezzi, Fortin, Mixed Finite Element Methods (2013),
    chapter 8, doi:10.1007/978-3-642-36519-5.
    """
    gradients = scalar_gradients(basis).transpose(1, 2, 0, 3)  # (dim, elements, nodes, points)
    dim, elements, nodes, _ = gradients.shape
    lam, mu = lame_parameters(_broadcast(E, elements), _broadcast(poisson, elements))
    # The element matrices are stored column by column, because `assemble_elements` sorts their columns.
    columns = np.empty((elements, nodes, dim, nodes, dim))
    projection_points = basis.quadrature[0] if b_bar else None
    for start in range(0, elements, _GROUP_SIZE):
        group = slice(start, start + _GROUP_SIZE)
        G = np.ascontiguousarray(gradients[:, group])
        matrices = _element_matrices(G, basis.dx[group], lam[group], mu[group], projection_points)
        columns[group] = matrices.transpose(2, 4, 1, 3, 0)  # (element, node j, axis b, node i, axis a)
    blocks = columns.reshape(elements, nodes * dim, nodes * dim).swapaxes(1, 2)  # (element, row, column)
    return assemble_elements(blocks, basis.element_dofs.T, basis.N)


def _element_matrices(G: Floats, dx: Floats, lam: Floats, mu: Floats, projection_points: Floats | None) -> Floats:
    """Return the stiffness matrices of a group of elements, shape (dim, dim, elements, nodes, nodes) [E times mm].

    Entry (a, b, e, i, j) is the force on component a at node i per displacement of component b at node j, in element e.
    With P_abij = int d_a N_i d_b N_j, it is lambda P_abij + mu P_baij + mu delta_ab sum_c P_ccij.

    `G` (dim, elements, nodes, points) [1/mm] are the gradients of the shape functions at the quadrature points, whose
    weights are `dx` (elements, points) [mm^3]. `lam` and `mu` (elements, 1, 1) are Lame's constants. For the B-bar
    method, `projection_points` (dim, points) are the quadrature points in the unit cube; otherwise it is None.
    """
    P = (G * dx[:, None])[:, None] @ G.swapaxes(2, 3)
    dilatation = P if projection_points is None else _projected_dilatation(G, dx, projection_points)
    matrices = lam * dilatation + mu * P.swapaxes(0, 1)
    same_axis = mu * np.einsum("cceij->eij", P)  # the term with delta_ab, so it is added only for a = b
    for axis in range(len(G)):
        matrices[axis, axis] += same_axis
    return np.asarray(matrices)


def _broadcast(value: float | Floats, elements: int) -> Floats:
    """Return a number or an array (elements,) as an array (elements, 1, 1), which can multiply element matrices."""
    return np.broadcast_to(np.reshape(np.asarray(value, dtype=np.float64), (-1, 1, 1)), (elements, 1, 1))


def _projected_dilatation(G: Floats, dx: Floats, points: Floats) -> Floats:
    """Return the integrals of products of projected gradients [mm], for the B-bar method.

    The integrals replace P_abij in the lambda term of `_element_matrices`. Each derivative d_a N_i is projected by
    least squares onto the functions 1, X, Y, Z of the unit cube. `G` (dim, elements, nodes, points) [1/mm] are the
    gradients at the quadrature points, whose weights are `dx` (elements, points) [mm^3]. `points` (dim, points) are
    their coordinates in the unit cube. The result has the shape (dim, dim, elements, nodes, nodes).
    """
    # 1, X, Y and Z at the points, with coordinates from -1 to 1.
    linear = np.concatenate([np.ones((1, points.shape[1])), 2.0 * points - 1.0])
    weighted = linear[None] * dx[:, None]  # (elements, 4, points)
    # The coefficients of the projections are mass^-1 moments. The integrals of their products are therefore
    # moments^T mass^-1 moments.
    moments = weighted @ G.swapaxes(2, 3)
    mass = weighted @ linear.T
    return np.asarray(moments.swapaxes(2, 3)[:, None] @ np.linalg.solve(mass, moments))


def assemble_elements(blocks: Floats, dofs: Ints, size: int) -> csc_matrix:
    """Assemble the element matrices `blocks` (elements, n, n) into a sparse matrix (size, size).

    `dofs` (elements, n) are the indices of the rows and columns of each block. The columns of all blocks are sorted by
    dof, and SciPy then sums duplicate entries within each column of the matrix. Sorting whole columns is faster than
    assembly from triplets, whose entries SciPy moves one by one.
    """
    n = dofs.shape[1]
    order = np.argsort(dofs, axis=None, kind="stable")  # sorts the columns of all elements by dof
    columns = blocks.swapaxes(1, 2).reshape(-1, n)[order]  # (elements times n, n), one element column per row
    rows = dofs[order // n]  # `order // n` is the element of each column, which determines its rows
    # Each dof is in as many element columns as it has elements, and each of these has n entries.
    ends = np.cumsum(n * np.bincount(dofs.ravel(), minlength=size))
    matrix = csc_matrix((columns.ravel(), rows.ravel(), np.append(0, ends)), shape=(size, size))
    matrix.sum_duplicates()
    return matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class NodalFields:
    """Displacement (nodes, 3) [mm], stress (3, 3, nodes) [MPa] and strain (3, 3, nodes) [1] at the nodes of a mesh."""

    displacement: Floats
    stress: Floats
    strain: Floats

    @property
    def von_mises(self) -> Floats:
        """Return von Mises's equivalent stress [MPa], shape (nodes,)."""
        return von_mises(self.stress)

    @property
    def largest_principal_strain(self) -> Floats:
        """Return the largest absolute value of the principal strains at each node [1], shape (nodes,)."""
        principal = np.linalg.eigvalsh(self.strain.transpose(2, 0, 1))
        return np.asarray(np.abs(principal).max(axis=1))
